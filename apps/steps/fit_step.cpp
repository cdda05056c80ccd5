#include "apps/steps/fit_step.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "fit/diagnosis/base_fit.h"
#include "fit/fit.h"
#include "fit/verdict/verdict.h"

namespace clothfit {
namespace {

/// Work of the trial of other masses, of a fit's. A tenth shows whether they explain a recording.
constexpr double kWorkOfOtherMasses = 0.1;

/// Tries the other way to spread the cloth's mass over its vertices, from where the fit stands.
/// Returns a warning where that way explains the recording and the declared one does not.
std::optional<Finding> try_other_masses(const FitInput& input, FitOptions options,
                                        const FitReport& report, const ProgressCallback& progress) {
  FitInput other = input;
  MassDistribution& masses = other.recording.cloth.masses;
  const bool by_area = masses == MassDistribution::by_area;
  masses = by_area ? MassDistribution::equal : MassDistribution::by_area;
  options.start = report.values;
  options.work *= kWorkOfOtherMasses;
  options.bootstrap = 0;
  options.profile = options.two_meshes = false;
  options.checkpoint.clear();
  options.resume = false;
  FitReport fitted = fit(other, options, progress);
  if (!fitted.usable()) return std::nullopt;
  for (size_t k = 0; k < fitted.result.errors.size(); ++k) {
    ObservationErrors& errors = fitted.result.errors[k];
    const ObservationErrors& own = report.result.errors[k];
    errors.discretisation = own.discretisation;
    errors.discretisation_found = own.discretisation_found;
  }
  const double own = errors_over_floor(report.result).worst(),
               others = errors_over_floor(fitted.result).worst();
  constexpr double kClearly = 0.6;
  if (others > kVerdict.usable || others > kClearly * own) return std::nullopt;
  return Finding{.check = "masses",
                 .state = FindingState::warning,
                 .found = fmt::format(
                     "with masses: {} the model is off by {:.1f} times the floor, with {} by "
                     "{:.1f} times",
                     by_area ? "equal" : "by_area", others, by_area ? "by_area" : "equal", own),
                 .where = (input.recording.folder / "recording.yaml").string(),
                 .expected = "masses as the cloth has them: an edge vertex weighs half by area",
                 .remedy = fmt::format("give masses: {} if that is true of it",
                                       by_area ? "equal" : "by_area")};
}

}  // namespace

FitReport fit_and_judge(const FitInput& input, FitOptions options,
                        const ProgressCallback& progress) {
  options.to_nothing = true;
  if (!options.forecast && options.cost == LeadingCost::trajectory && !options.two_meshes &&
      !options.profile && options.bootstrap == 0)
    options.coarse_beyond = gross_on_any_mesh(input, options);
  FitReport report = fit(input, options, progress);
  if (!report.usable()) return report;
  FitResult& result = report.result;
  result.converged = report.stop == FitStop::converged;
  const double over = errors_over_floor(result).worst();
  constexpr double kBeyondAnyMesh = 8;  // times the noise
  if (!options.forecast && over > kVerdict.good && over < kBeyondAnyMesh) {
    const std::optional<DiscretisationOfFit> discretisation =
        discretisation_of_fit(input, options, report, progress);
    if (!discretisation) {
      report.stop = FitStop::cancelled;
      return report;
    }
    for (ObservationErrors& errors : result.errors) {
      errors.discretisation = errors.noise * discretisation->expected;
      errors.discretisation_found = errors.noise * discretisation->found;
    }
  }
  // An edge that weighs twice as much leaves some floors, not tens, and the trial takes a fit.
  constexpr double kBeyondMasses = 10;
  const double worst = errors_over_floor(result).worst();
  if (!options.forecast && worst > kVerdict.good && worst < kBeyondMasses)
    if (const auto masses = try_other_masses(input, options, report, progress))
      result.warnings.push_back(*masses);
  judge(result);
  return report;
}

}  // namespace clothfit
