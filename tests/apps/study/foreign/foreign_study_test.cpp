// Checks the study of another program's recordings, without a diagnosis that comes to an end. Not
// checked here: how a diagnosis is judged (judgement_test.cpp), what it finds
// (tests/fit/diagnosis).

#include "apps/study/foreign/foreign_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "apps/report/study/foreign_tables.h"
#include "apps/terminal/exit_code.h"
#include "data/input_error.h"
#include "data/text_file.h"
#include "tests/apps/bundled_recordings.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr const char* kNothingHidden = R"({"hidden_effects": [], "springs": {}})";
constexpr const char* kWindHidden = R"({"hidden_effects": [{"effect": "wind"}], "springs": {}})";

class ForeignStudy : public ::testing::Test {
 protected:
  const test::ScratchFolder scratch_{
      std::string("foreign_study_") +
      ::testing::UnitTest::GetInstance()->current_test_info()->name()};
  const fs::path folder_ = scratch_.path() / "recordings";

  /// Adds a recording that names files which are not there.
  void add_broken(const std::string& name, const std::string& truth) const {
    fs::create_directories(folder_ / name);
    fs::copy(kBundled / "swing_plain" / "recording.yaml", folder_ / name / "recording.yaml");
    if (!truth.empty()) write_text(truth, folder_ / name / "truth.json");
  }
  ForeignStudyOptions options() const {
    return {.recordings = find_foreign_recordings(folder_, {}), .threads = 1};
  }
};

/// Makes a row with a diagnosis that named these effects.
ForeignRow row_of(const std::string& name, const std::string& truth,
                  std::vector<NamedEffect> named) {
  ForeignRow row{.recording = name,
                 .truth = parse_foreign_truth(truth, "truth.json"),
                 .diagnosis = {.reason = "",
                               .verdict = named.empty() ? DiagnosisVerdict::adequate
                                                        : DiagnosisVerdict::explained,
                               .named = {},
                               .unit = "m",
                               .held_out_rms = 0.001,
                               .noise = 0.0006,
                               .seconds = 2}};
  row.diagnosis.named = std::move(named);
  return row;
}

TEST_F(ForeignStudy, FindsRecordingsWithATruthSortedByName) {
  add_broken("b", kNothingHidden);
  add_broken("a", kNothingHidden);
  add_broken("no_truth", "");
  fs::create_directories(folder_ / "empty");

  EXPECT_THAT(find_foreign_recordings(folder_, {}), ElementsAre(folder_ / "a", folder_ / "b"));
  EXPECT_THAT(find_foreign_recordings(folder_, {"b"}), ElementsAre(folder_ / "b"));
  EXPECT_THAT([&] { find_foreign_recordings(folder_, {"c"}); },
              ThrowsMessage<InputError>(HasSubstr("has no recording c")));
  EXPECT_THAT([&] { find_foreign_recordings(folder_ / "empty", {}); },
              ThrowsMessage<InputError>(HasSubstr("holds no recording")));
}

TEST_F(ForeignStudy, GoesOnAfterRecordingsThatFail) {
  add_broken("a", kNothingHidden);
  add_broken("b", "{");

  const std::vector<ForeignRow> rows =
      study_foreign(options(), scratch_.path() / "steps", nullptr, {});

  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[0].judged());
  EXPECT_THAT(rows[0].diagnosis.reason, HasSubstr("markers.csv"));
  EXPECT_FALSE(rows[1].truth.has_value());
  EXPECT_THAT(rows[1].diagnosis.reason, HasSubstr("is no truth of a recording"));
  EXPECT_THAT(short_foreign_table(rows).rows[0].back(), HasSubstr("markers.csv"));
  EXPECT_THAT(foreign_summary(rows).rows.back(), ElementsAre("all", "0", "2", "-", "-"));
}

TEST_F(ForeignStudy, TakesFinishedDiagnosesFromTheJournal) {
  add_broken("a", kWindHidden);
  const ForeignStudyOptions asked = options();
  const ForeignRow known = row_of("a", kWindHidden, {{"wind", "wind (pressure)", {}}});
  Journal journal(scratch_.path() / "journal", asked.key(), JournalStart::fresh);
  journal.append(0, payload_of(known.diagnosis));

  const std::vector<ForeignRow> rows =
      study_foreign(asked, scratch_.path() / "steps", &journal, {});

  EXPECT_TRUE(rows.front().right());
}

TEST_F(ForeignStudy, RefusesAJournalOfOtherRecordingsOrSeeds) {
  add_broken("a", kNothingHidden);
  ForeignStudyOptions asked = options();
  const std::string key = asked.key();

  asked.threads = 2;
  EXPECT_EQ(asked.key(), key);
  asked.seed = 2;
  EXPECT_NE(asked.key(), key);
  add_broken("b", kNothingHidden);
  EXPECT_NE(options().key(), key);
}

TEST(ForeignRow, SurvivesTheJournal) {
  ForeignDiagnosis diagnosis{.reason = "",
                             .verdict = DiagnosisVerdict::partly_explained,
                             .named = {{"wind", "wind (pressure)", {"gravity_tilt", "gust"}}},
                             .unit = "px",
                             .held_out_rms = 0.1,
                             .noise = std::numeric_limits<double>::quiet_NaN(),
                             .seconds = 12.5};

  const ForeignDiagnosis back = foreign_diagnosis_of(payload_of(diagnosis));

  EXPECT_TRUE(back.reached());
  EXPECT_EQ(back.verdict, diagnosis.verdict);
  ASSERT_EQ(back.named.size(), 1u);
  EXPECT_EQ(back.named[0].effect, "wind");
  EXPECT_EQ(back.named[0].title, "wind (pressure)");
  EXPECT_THAT(back.named[0].alike, ElementsAre("gravity_tilt", "gust"));
  EXPECT_EQ(back.unit, "px");
  EXPECT_EQ(back.held_out_rms, 0.1);
  EXPECT_TRUE(std::isnan(back.noise));
  EXPECT_EQ(back.seconds, 12.5);
  diagnosis.reason = "no cloth";
  EXPECT_FALSE(foreign_diagnosis_of(payload_of(diagnosis)).reached());
}

TEST(ForeignRow, ComparesTheErrorWithNoiseAndFloor) {
  ForeignRow row = row_of("a", kNothingHidden, {});
  EXPECT_TRUE(std::isnan(row.error_over_floor()));  // no floor is stated

  row.truth->floor_m = 0.0008;
  row.truth->floor_px = 3;
  EXPECT_NEAR(row.error_over_floor(), 1, 1e-12);  // 0.6 and 0.8 mm give 1 mm
  row.diagnosis.unit = "px";
  EXPECT_LT(row.error_over_floor(), 1e-3);
}

TEST(ForeignTables, TellWhatIsRightAndWhatIsWrong) {
  const std::vector<ForeignRow> rows{
      row_of("calm", kNothingHidden, {}),
      row_of("breeze", kWindHidden, {{"wind", "wind (pressure)", {"gust", "scale"}}}),
      row_of("storm", kWindHidden, {{"scale", "scale", {}}})};

  const Table table = short_foreign_table(rows);
  EXPECT_THAT(table.rows[0], ElementsAre("calm", "-", "adequate", "-", "yes", "-", "2.00", ""));
  EXPECT_THAT(table.rows[1], ElementsAre("breeze", "wind", "explained",
                                         "wind (pressure) [gust, scale]", "yes", "-", "2.00", ""));
  EXPECT_EQ(table.rows[2].back(), "missed: wind; not there: scale");
  const Table summary = foreign_summary(rows);
  EXPECT_THAT(summary.rows,
              ElementsAre(ElementsAre("hidden effects", "1", "2", "wind (storm)", "scale (storm)"),
                          ElementsAre("nothing hidden", "1", "1", "-", "-"),
                          ElementsAre("foreign law", "0", "0", "-", "-"),
                          ElementsAre("all", "2", "3", "wind (storm)", "scale (storm)")));
  EXPECT_EQ(longest_text(rows), "Longest: calm, 2.00 s");
  EXPECT_EQ(foreign_table(rows).rows[0].size(), foreign_table(rows).header.size());
}

}  // namespace
}  // namespace clothfit
