// Checks twins of recordings: what is observed there is a model's, and their noise is normal.
#include "fit/diagnosis/twin.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/problem/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const SyntheticCloth kCloth{.mesh = 5, .markers = 5, .frames = 20, .held_out_from = 14};

FitOptions on_pixels_or_not(ObservationKind kind) {
  FitOptions options;
  options.observations = kind;
  options.mesh_columns = options.mesh_rows = 5;
  return options;
}

/// Returns the chi-square that the true model leaves of a recording.
double chi_square(const FitReport& report) {
  double sum = 0;
  for (const FitReport::Residuals& kind : report.residuals)
    for (const FitReport::Residuals::Row& row : kind.rows)
      sum += (row.predicted - row.observed).squaredNorm() / (row.sigma * row.sigma);
  return sum;
}

class Twin : public testing::TestWithParam<ObservationKind> {};

TEST_P(Twin, ShowsTheModelWithNoiseOfTheRecordingsOwnSize) {
  const FitInput input = synthetic_input(kCloth);
  const FitOptions options = on_pixels_or_not(GetParam());
  const KnownParameters truth{.values = named(kCloth.fabric), .sigma = {}};
  const FitReport seen = report_at(input, options, truth);
  ASSERT_TRUE(seen.usable()) << seen.message;

  const FitInput twin = twin_of(input, seen, 3);
  const FitReport again = report_at(twin, options, truth);

  ASSERT_TRUE(again.usable()) << again.message;
  ASSERT_EQ(again.residuals.front().rows.size(), seen.residuals.front().rows.size());
  const double numbers = static_cast<double>(seen.residuals.front().rows.size()) *
                         static_cast<double>(seen.residuals.front().rows.front().observed.size());
  EXPECT_NEAR(chi_square(again) / numbers, 1,
              4 * std::sqrt(2 / numbers));  // seed 3: 4 of its sigmas
}

TEST_P(Twin, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const FitInput input = synthetic_input(kCloth);
  const FitOptions options = on_pixels_or_not(GetParam());
  const FitReport seen = report_at(input, options, {.values = named(kCloth.fabric), .sigma = {}});
  const auto first_row = [&](std::uint64_t seed) {
    return report_at(twin_of(input, seen, seed), options, {.values = {}, .sigma = {}})
        .residuals.front()
        .rows.front()
        .observed;
  };
  EXPECT_EQ(first_row(1), first_row(1));
  EXPECT_NE(first_row(1), first_row(2));
}

INSTANTIATE_TEST_SUITE_P(OfEachKind, Twin,
                         testing::Values(ObservationKind::tracks3d, ObservationKind::tracks2d),
                         [](const auto& of) {
                           return of.param == ObservationKind::tracks3d ? "tracks3d" : "tracks2d";
                         });

}  // namespace
}  // namespace clothfit
