// Checks pieces of the second founding paper's experiment: the exponents of its claims, what
// follows from runs, and that finished runs come back from a journal as they went in.

#include "apps/study/lethanh2007/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "data/input_error.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using Method = GarmentOptions::Method;

TEST(Lethanh2007Growth, IsTheExponentOfAPower) {
  const std::vector<double> count{100, 1000, 5000};
  std::vector<double> seconds;
  for (const double n : count) seconds.push_back(3e-4 * std::pow(n, 1.3));
  EXPECT_NEAR(growth_exponent(count, seconds), 1.3, 1e-12);
  EXPECT_FALSE(grows_exponentially(count, seconds));
  for (size_t k = 0; k < 3; ++k) seconds[k] = std::exp(1e-3 * count[k]);
  EXPECT_TRUE(grows_exponentially(count, seconds));
  EXPECT_TRUE(std::isnan(growth_exponent({1, 2}, {1, 2})));
}

/// A run that falls below a twentieth of the weight at a time.
GarmentRun run_that_reaches(double seconds, Method method, bool single, int particles,
                            double spacing_m) {
  return {.garment = "skirt",
          .method = method,
          .single = single,
          .spacing_m = spacing_m,
          .particles = particles,
          .seconds = 2 * seconds,
          .iterations = 10,
          .evaluations = 20,
          .reached_s = seconds,
          .steps = {{0, 1, 1, 0}, {seconds, 1, 0.01, 0}, {2 * seconds, 1, 0.001, 0}}};
}

TEST(Lethanh2007Claims, FollowFromTheRuns) {
  Lethanh2007Study study;
  for (const int n : {500, 2000, 8000})
    study.runs.push_back(
        run_that_reaches(n / 100.0, Method::conjugate_gradients, true, n, 1.0 / n));
  study.runs.push_back(run_that_reaches(8, Method::conjugate_gradients, false, 8000, 1.0 / 8000));
  std::vector<PaperClaim> claims = paper_claims(study);
  EXPECT_THAT(claims[0].measured, HasSubstr("skirt by conjugate gradients: n^1.00"));
  EXPECT_THAT(claims[0].verdict, HasSubstr("refuted"));
  EXPECT_THAT(claims[1].measured, HasSubstr("n^1.00"));
  EXPECT_EQ(claims[2].verdict, "confirmed");
  study.runs.back() = run_that_reaches(90, Method::conjugate_gradients, false, 8000, 1.0 / 8000);
  EXPECT_EQ(paper_claims(study)[2].verdict, "refuted");
  study.runs.back().reached_s = NAN;
  EXPECT_EQ(paper_claims(study)[2].verdict, "refuted") << "it never came so far";
  EXPECT_EQ(paper_claims({})[2].verdict, "open");
}

TEST(Lethanh2007Study, GoesOnFromItsJournal) {
  const test::ScratchFolder here("lethanh2007_journal");
  std::ofstream(here.path() / "tube.yaml")
      << "format: clothfit-pattern/1\nname: tube\nunit: cm\npanels:\n"
         "  front: {at: [0, -30, 90], turn: [90, 0, 0], outline: [[-45, 0], [45, 0], [45, 12], "
         "[-45, 12]]}\n"
         "  back: {at: [0, 30, 90], turn: [90, 0, 180], outline: [[-45, 0], [45, 0], [45, 12], "
         "[-45, 12]]}\n"
         "seams:\n  - [front.1, back.3]\n  - [front.3, back.1]\n";
  Lethanh2007Options options;
  options.patterns = {here.path() / "tube.yaml"};
  options.spacings_m = {0.1};
  options.most_iterations = 40;
  const auto go_on = [](const Progress&) { return true; };
  Journal journal(here.path() / "journal", options.key(), JournalStart::fresh);
  const Lethanh2007Study first = study_lethanh2007(options, &journal, go_on);
  ASSERT_EQ(first.runs.size(), 3U);
  EXPECT_EQ(journal.finished().size(), 3U);
  const Lethanh2007Study again = study_lethanh2007(
      options, &journal, [](const Progress&) -> bool { throw std::logic_error("it runs again"); });
  ASSERT_EQ(again.runs.size(), 3U);
  for (size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(again.runs[n].energy_j, first.runs[n].energy_j);
    EXPECT_EQ(again.runs[n].steps.size(), first.runs[n].steps.size());
    EXPECT_GT(first.runs[n].particles, 30);
  }
}

TEST(Lethanh2007Options, AreChecked) {
  Lethanh2007Options options;
  EXPECT_THROW(options.validate(), InputError);
  options.patterns = {"skirt.yaml"};
  EXPECT_NO_THROW(options.validate());
  options.springs.bending_n_per_m = -1;
  EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace clothfit
