// Checks structure and safety of report.html and of the tables beside it, from a made-up fit. The
// numbers of a real fit: program_end_to_end_test.cpp. The look of the page is for a person to
// judge.
#include "apps/report/fit/fit_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <set>
#include <vector>

#include "apps/report/fit/summary.h"
#include "apps/report/page/html.h"
#include "tests/apps/sample_fit.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Returns nothing when every element that opens also closes, in order; otherwise what is wrong.
std::string tag_imbalance(const std::string& page) {
  const std::regex tag("<(/?)([A-Za-z][A-Za-z0-9]*)([^<>]*?)(/?)>");
  std::vector<std::string> open;
  for (std::sregex_iterator it(page.begin(), page.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2];
    if ((*it)[1] == "/") {
      if (open.empty() || open.back() != name) return "</" + name + "> closes nothing";
      open.pop_back();
    } else if ((*it)[4] != "/") {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> stays open";
}

/// Returns the page without its style sheet and embedded pictures.
std::string text_of(const std::string& page) {
  const std::string without_style = page.substr(page.find("</style>"));
  std::string text;
  size_t from = 0;
  while (true) {
    const size_t uri = without_style.find("data:image", from);
    text += without_style.substr(from, uri - from);
    if (uri == std::string::npos) return text;
    from = without_style.find('"', uri);
  }
}

class FitPage : public ::testing::TestWithParam<int> {
 protected:
  const test::SampleFit sample_ = test::sample_fit(GetParam());
  const std::string page_ = fit_page_html(sample_.report, sample_.recording, {});
};
INSTANTIATE_TEST_SUITE_P(PixelsAndSpace, FitPage, ::testing::Values(2, 3));

TEST_P(FitPage, ClosesEveryElement) {
  EXPECT_EQ(tag_imbalance(page_), "");
}

TEST_P(FitPage, NeedsNothingFromOutside) {
  const std::regex reference("(href|src)=\"([^\"]*)\"");
  for (std::sregex_iterator it(page_.begin(), page_.end(), reference), end; it != end; ++it)
    EXPECT_EQ((*it)[2].str().rfind("data:", 0), 0U) << (*it)[2];
  EXPECT_THAT(page_, Not(HasSubstr("<script")));
  EXPECT_THAT(page_, Not(HasSubstr("<link")));
  EXPECT_THAT(page_, Not(HasSubstr("@import")));
  EXPECT_THAT(page_, Not(HasSubstr("url(")));
}

TEST_P(FitPage, ListsTheBasinsOfTheSearch) {
  EXPECT_THAT(page_, HasSubstr("88.7"));
  EXPECT_THAT(page_, HasSubstr("2.93"));

  FitReport without = sample_.report;
  without.result.basins.clear();
  EXPECT_THAT(fit_page_html(without, sample_.recording, {}), Not(HasSubstr("Basins:")));
}

TEST_P(FitPage, EscapesNamesFromTheRecording) {
  EXPECT_THAT(page_, HasSubstr("a &lt;b&gt;bold&lt;/b&gt; name &amp; more"));
  EXPECT_THAT(page_, HasSubstr("decision margin &lt; 20 &amp; blurred"));
  EXPECT_THAT(page_, HasSubstr("8&lt;8"));
  EXPECT_THAT(page_, HasSubstr("a&lt;b"));
  EXPECT_THAT(page_, Not(HasSubstr("<b>")));
}

TEST_P(FitPage, NeverPrintsNan) {
  test::SampleFit broken = test::sample_fit(GetParam());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  broken.report.result.parameters[0].sigma = nan;
  broken.report.result.errors[0].trivial.rigid = nan;
  broken.report.residuals[0].rms_by_frame[3] = nan;
  broken.report.residuals[0].rows[5].predicted[0] = nan;
  broken.report.correlation(0, 1) = nan;

  const std::string page = fit_page_html(broken.report, broken.recording, {});

  const std::regex not_a_number("\\b-?(nan|inf)\\b", std::regex::icase);
  EXPECT_FALSE(std::regex_search(text_of(page_), not_a_number));
  EXPECT_FALSE(std::regex_search(text_of(page), not_a_number));
}

TEST_P(FitPage, TellsEveryFigureInWords) {
  const std::regex figure(
      "<svg xmlns[^>]*role=\"img\"[^>]*>\\s*<title>[^<]+</title>\\s*<desc>[^<]+");
  const auto described =
      std::distance(std::sregex_iterator(page_.begin(), page_.end(), figure), {});
  const std::regex any("<svg xmlns");
  const auto figures = std::distance(std::sregex_iterator(page_.begin(), page_.end(), any), {});

  EXPECT_EQ(described, figures);
  EXPECT_EQ(figures, 4);  // over time, over the cloth, observed and predicted, search
}

TEST_P(FitPage, HoldsWhatAReaderAsksFor) {
  for (const char* title : {"Parameters", "Errors", "Where and when it is off",
                            "Which parameters trade against each other", "Observations", "Model",
                            "Search", "What the words mean", "Do it again"})
    EXPECT_THAT(page_, HasSubstr(std::string("<h2>") + title + "</h2>"));
  EXPECT_THAT(page_, HasSubstr("undetermined: sigma exceeds the value, p &lt; 1"));
  EXPECT_THAT(page_, HasSubstr("held out: no fit saw these frames"));
  EXPECT_THAT(page_, HasSubstr("clothfit fit &#39;a &amp; b&#39; --seed 7"));
}

TEST(FitPageOfPixels, DrawsOnThePictureOfTheShownFrame) {
  const test::SampleFit sample = test::sample_fit(2);
  const int frame = overlay_frame(sample.report.residuals[0]);
  ASSERT_EQ(frame, 23);

  const std::string shown =
      fit_page_html(sample.report, sample.recording, {{"front", frame, 960, 720, "bytes"}});
  const std::string other =
      fit_page_html(sample.report, sample.recording, {{"side", frame, 960, 720, "bytes"}});

  EXPECT_THAT(shown, HasSubstr("data:image/jpeg;base64,Ynl0ZXM="));
  EXPECT_THAT(other, Not(HasSubstr("data:image")));
  EXPECT_EQ(tag_imbalance(shown), "");
}

TEST(FitPageOfNothing, IsStillAPage) {
  const test::SampleFit sample = test::sample_fit(2);
  FitReport empty;
  empty.result.recording = "empty";

  const std::string page = fit_page_html(empty, sample.recording, {});

  EXPECT_EQ(tag_imbalance(page), "");
  EXPECT_THAT(page, HasSubstr("Usable with care"));
}

TEST(FitSummary, SaysTheVerdictFirst) {
  test::SampleFit sample = test::sample_fit(2);
  FitResult& result = sample.report.result;
  result.verdict_reason = "it is off by 3.0 times the floor";
  std::vector<std::string> said;
  for (const FitVerdict verdict : {FitVerdict::good, FitVerdict::usable_with_care,
                                   FitVerdict::model_lacks, FitVerdict::do_not_use}) {
    result.verdict = verdict;
    said.push_back(summarise(sample.report).verdict);
  }

  EXPECT_EQ(said[0], "Good: it is off by 3.0 times the floor");
  EXPECT_THAT(said[1], HasSubstr("Usable with care: "));
  EXPECT_THAT(said[2], HasSubstr("its numbers are not the cloth's: "));
  EXPECT_THAT(said[3], HasSubstr("Do not use: "));
}

TEST(FitSummary, NamesMarkersThatContradictAllOthers) {
  test::SampleFit sample = test::sample_fit(3);
  FitResult& result = sample.report.result;
  result.contradicting = {{"m16_08", "tracks3d", 20, 71, 0.14}};
  result.errors.front().fitted_without = ErrorSummary{.rms = 5.2e-4, .count = 10};

  const std::string said = summarise(sample.report).contradicting;

  EXPECT_THAT(said, HasSubstr("m16_08 (140 mm off in frames 20 to 71)"));
  EXPECT_THAT(said, HasSubstr("0.520 mm off in the fitted frames"));
}

TEST(FitSummary, SaysMillimetresForPositionsInSpace) {
  const test::SampleFit sample = test::sample_fit(3);

  const std::string paragraph = summarise(sample.report).paragraph;

  EXPECT_THAT(paragraph, HasSubstr("0.300 mm"));  // noise of 0.3e-3 m
  EXPECT_THAT(paragraph, HasSubstr("these data do not determine damping"));
}

TEST(FitTables, CarryAllDigitsToCsv) {
  test::SampleFit sample = test::sample_fit(3);
  ParameterEstimate& tension = sample.report.result.parameters[0];
  tension.interval_90 = {.lower = 54.1, .upper = 56 + 1.0 / 8};
  tension.bootstrap_90 = {.lower = 54.2, .upper = 56};
  tension.mesh_shift = -0.25;

  const Table parameters = parameter_table(sample.report.result);
  const Table residuals = residual_table(sample.report, sample.recording);

  EXPECT_EQ(parameters.rows[0],
            (std::vector<std::string>{"base", "tension_warp", "N/m", "55.1234", "0.61", "fitted",
                                      "", "54.1", "56.125", "54.2", "56", "-0.25"}));
  EXPECT_EQ(parameters.rows[1].size(), parameters.header.size());
  EXPECT_EQ(residuals.rows.size(), sample.report.residuals[0].rows.size());
  EXPECT_EQ(residuals.rows[0].size(), residuals.header.size());
}

TEST(FitTables, LeaveHeldOutErrorsOpenWhereNothingWasHeldOut) {
  test::SampleFit sample = test::sample_fit(2);
  sample.report.result.errors[0].held_out = {};

  EXPECT_EQ(short_error_table(sample.report.result).rows[0][2], "-");
  EXPECT_EQ(error_table(sample.report.result).rows[0][5], "");
}

TEST(FitTables, ShowCloudsWhereThereAreAny) {
  test::SampleFit sample = test::sample_fit(2);
  EXPECT_TRUE(cloud_table(sample.report.result).rows.empty());
  sample.report.result.clouds =
      CloudErrors{.fitted = {0.5e-4, 35}, .held_out = {}, .all = {0.5e-4, 35}};

  const Table clouds = cloud_table(sample.report.result);

  ASSERT_EQ(clouds.rows.size(), 1u);
  EXPECT_EQ(clouds.rows[0][1], "0.500");
  EXPECT_EQ(clouds.rows[0][2], "-");
}

TEST(DataUri, EncodesBase64WithPadding) {
  EXPECT_EQ(data_uri("text/plain", ""), "data:text/plain;base64,");
  EXPECT_EQ(data_uri("text/plain", "M"), "data:text/plain;base64,TQ==");
  EXPECT_EQ(data_uri("text/plain", "Ma"), "data:text/plain;base64,TWE=");
  EXPECT_EQ(data_uri("text/plain", "Man"), "data:text/plain;base64,TWFu");
  EXPECT_EQ(data_uri("text/plain", "\xff\xfe"), "data:text/plain;base64,//4=");
}

TEST(TagImbalance, CatchesAnElementThatStaysOpen) {
  EXPECT_EQ(tag_imbalance("<p><b>x</b></p><br/>"), "");
  EXPECT_NE(tag_imbalance("<p><b>x</p></b>"), "");
  EXPECT_NE(tag_imbalance("<p>"), "");
}

}  // namespace
}  // namespace clothfit
