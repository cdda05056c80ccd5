#include "apps/study/scene/hidden_mode.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/jobs/draws.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/problem.h"
#include "model/integrate/relax.h"

namespace clothfit {
namespace {

constexpr double kSame = 0.9;  ///< multiple correlation of modes that cannot be told apart
constexpr double kStabilityMargin = 1.5;  ///< as fits leave it

/// Series of draws under a trial's seed.
enum HiddenModeSeries : int { kShape = 300, kDirection, kSize };

const ShapeCandidates* shapes_of(const RecordingInformation& information, const HiddenMode& mode) {
  const auto found = std::ranges::find_if(information.modes, [&](const ShapeCandidates& shapes) {
    return shapes.front().effect == mode.effect && shapes.front().mode == mode.mode;
  });
  return found == information.modes.end() ? nullptr : &*found;
}

const EffectParameter& parameter_of(const EffectDescription& effect, const std::string& name) {
  return *std::ranges::find(effect.parameters, name, &EffectParameter::name);
}

double between(double least, double most, double share) {
  if (least > 0 && most > 5 * least) return least * std::pow(most / least, share);
  return least + (most - least) * share;
}

/// Sets the start to the truth's state at the first frame, as the guess that a fit corrects.
void start_at_truth(const SyntheticScene& scene, std::uint64_t seed, FitProblem& problem) {
  constexpr double kApartS = 1e-3;
  const auto positions_m = simulate_scene(
      scene, seed,
      std::vector<double>{scene.before_s - kApartS, scene.before_s, scene.before_s + kApartS});
  problem.start_state.position_m = positions_m[1];
  problem.start_state.velocity_m_per_s = (positions_m[2] - positions_m[0]) / (2 * kApartS);
}

}  // namespace

std::vector<HiddenMode> hidden_modes(ObservationKind observations) {
  std::vector<HiddenMode> modes = {
      {"bending_energy", ""},
      {"frame_acceleration", ""},
      {"gravity_tilt", ""},
      {"gust", ""},
      {"hysteresis", ""},
      {"nonuniform_mass", "gradient"},
      {"nonuniform_mass", "hem"},
      {"nonuniform_mass", "patch"},
      {"nonuniform_stiffness", "gradient"},
      {"nonuniform_stiffness", "patch"},
      {"quadratic_drag", "normal"},
      {"relaxation", ""},
      {"stiffening", "stretched"},
      {"support_motion", ""},
      {"viscous_damping", ""},
      {"wind", "pressure"},
      {"camera_drift", "turn"},
      {"camera_shake", "shift"},
      {"frame_rate_error", ""},
      {"marker_placement", "stretch"},
      {"scale", ""},
      {"temporal_smoothing", ""},
  };
  if (observations == ObservationKind::tracks2d) {
    modes.push_back({"focal_error", ""});
    modes.push_back({"lens_distortion", ""});
    modes.push_back({"rolling_shutter", ""});
  }
  return modes;
}

RecordingInformation recording_information(const SyntheticScene& scene, const FitOptions& fit,
                                           std::uint64_t seed) {
  // A coarse mesh sees some modes far better than a recording shows them, or far worse.
  const int mesh = std::min(scene.truth_mesh, 2 * fit.mesh_columns - 1);
  SyntheticScene twin = scene;
  twin.truth_mesh = mesh;
  twin.integrator = TruthIntegrator::euler;
  twin.hidden.clear();
  twin.noisy = false;
  SyntheticRecording recording = make_synthetic_recording(twin, seed);
  FitProblem problem = make_problem(recording.input, fit, mesh, mesh);
  if (problem.start == StartKind::unknown) start_at_truth(twin, seed, problem);
  const Eigen::VectorXd values = values_of(problem, recording.truth);
  const int frames = problem.first_held_out;
  const double duration_s =
      problem.frame_time_s[static_cast<size_t>(frames - 1)] - problem.frame_time_s.front();
  const TimeSteps stable = stable_time_steps(problem.cloth, parameter_set(problem, values));
  FittedModel model{.hypotheses = {},
                    .problems = {std::make_shared<const FitProblem>(std::move(problem))},
                    .parts = {}};
  PooledPart& part = model.parts.emplace_back();
  part.values = values;
  part.frames = frames;
  part.steps = stable.times(1 / kStabilityMargin);
  linearise_model(model);
  if (!model.usable())
    throw InputError("recover", "the scene has no derivatives", "a calmer motion",
                     "shorten it with --seconds, or raise the stiffness");
  std::vector<ShapeCandidates> modes = hypotheses_to_test(recording.input, fit, duration_s);
  ModelProjection projection(model, Loss::squared);
  return {.recording = std::move(recording),
          .modes = std::move(modes),
          .model = std::move(model),
          .projection = std::move(projection)};
}

DrawnMode draw_mode(const RecordingInformation& information, const HiddenMode& mode,
                    const DrawOptions& options, std::uint64_t seed, const Eigen::MatrixXd& beside) {
  const ShapeCandidates* shapes = shapes_of(information, mode);
  if (shapes == nullptr) return {};
  DrawnMode drawn{.hypothesis = shapes->front(), .amplitude = {}, .projected = {}};
  int place = 0;
  for (auto& [name, value] : drawn.hypothesis.shape) {
    double least = value, most = value;
    for (const Hypothesis& term : *shapes) {
      least = std::min(least, term.shape.at(name));
      most = std::max(most, term.shape.at(name));
    }
    value = between(least, most, Draws(seed, kShape, place++).uniform());
  }

  const EffectDescription effect = describe_effect(mode.effect);
  const auto count = static_cast<Eigen::Index>(drawn.hypothesis.amplitudes.size());
  Eigen::VectorXd direction(count);
  Draws draws(seed, kDirection, 0);
  for (Eigen::Index k = 0; k < count; ++k) {
    const EffectParameter& p =
        parameter_of(effect, drawn.hypothesis.amplitudes[static_cast<size_t>(k)]);
    double along = draws.normal();
    if (p.lower >= p.neutral) along = std::abs(along);
    if (p.upper <= p.neutral) along = -std::abs(along);
    direction[k] = p.typical * along;
  }
  const Columns columns = hypothesis_derivatives(information.model, {&drawn.hypothesis, 1}).front();
  if (columns.empty()) return {};
  Eigen::VectorXd projected = information.projection.columns({columns.front() * direction});
  if (beside.cols() > 0) projected -= beside * PivotedQr(beside).solve(projected);
  const double information_along = projected.norm();  // 1 / sigma along the amplitudes' direction
  if (!(information_along > 0)) return {};

  double reach = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < count; ++k) {
    const EffectParameter& p =
        parameter_of(effect, drawn.hypothesis.amplitudes[static_cast<size_t>(k)]);
    const double end = (direction[k] > 0 ? p.upper : p.lower) - p.neutral;
    if (direction[k] != 0) reach = std::min(reach, end / direction[k]);
  }
  const double most = std::min(options.most, reach * information_along);
  if (most < options.least) return {};
  drawn.sigmas = options.least * std::pow(most / options.least, Draws(seed, kSize, 0).uniform());
  drawn.amplitude = drawn.sigmas / information_along * direction;
  drawn.projected = projected / information_along;
  return drawn;
}

HiddenEffect hidden_effect(const DrawnMode& drawn) {
  HiddenEffect hidden{.name = drawn.hypothesis.effect, .values = {}};
  for (const EffectParameter& parameter : describe_effect(hidden.name).parameters) {
    double value = parameter.neutral;
    if (const auto shape = drawn.hypothesis.shape.find(parameter.name);
        shape != drawn.hypothesis.shape.end())
      value = shape->second;
    if (const auto one = drawn.hypothesis.picked.find(parameter.name);
        one != drawn.hypothesis.picked.end())
      value = one->second;
    const auto& amplitudes = drawn.hypothesis.amplitudes;
    if (const auto at = std::ranges::find(amplitudes, parameter.name); at != amplitudes.end())
      value += drawn.amplitude[at - amplitudes.begin()];
    hidden.values.push_back(value);
  }
  return hidden;
}

std::vector<std::vector<Eigen::MatrixXd>> projected_modes(const RecordingInformation& information) {
  std::vector<Hypothesis> all;
  for (const ShapeCandidates& mode : information.modes)
    all.insert(all.end(), mode.begin(), mode.end());
  const std::vector<Columns> derivatives = hypothesis_derivatives(information.model, all);
  std::vector<std::vector<Eigen::MatrixXd>> result;
  size_t n = 0;
  for (const ShapeCandidates& mode : information.modes) {
    std::vector<Eigen::MatrixXd>& shapes = result.emplace_back();
    for (size_t k = 0; k < mode.size(); ++k, ++n)
      shapes.push_back(derivatives[n].empty() ? Eigen::MatrixXd()
                                              : information.projection.columns(derivatives[n]));
  }
  return result;
}

std::vector<std::string> right_class(const RecordingInformation& information,
                                     const DrawnMode& drawn,
                                     const std::vector<std::vector<Eigen::MatrixXd>>& projected) {
  std::set<std::string> effects{drawn.hypothesis.effect};
  for (size_t n = 0; n < information.modes.size(); ++n)
    for (const Eigen::MatrixXd& columns : projected[n])
      if (squared_multiple_correlation(drawn.projected, columns) > kSame * kSame)
        effects.insert(information.modes[n].front().effect);
  return {effects.begin(), effects.end()};
}

double mimicked_by_others(const RecordingInformation& information, const DrawnMode& drawn,
                          const std::vector<std::vector<Eigen::MatrixXd>>& projected, int most) {
  // Forward selection removes the chosen modes from the hidden one's derivatives and all others'.
  Eigen::VectorXd left = drawn.projected;
  std::vector<Eigen::MatrixXd> others;
  for (size_t n = 0; n < projected.size(); ++n)
    for (const Eigen::MatrixXd& columns : projected[n])
      if (information.modes[n].front().effect != drawn.hypothesis.effect && columns.cols() > 0)
        others.push_back(columns);
  const double all = left.squaredNorm();
  for (int taken = 0; taken < most; ++taken) {
    const Eigen::MatrixXd* best = nullptr;
    double least = left.squaredNorm();
    for (const Eigen::MatrixXd& columns : others) {
      const double rest = (1 - squared_multiple_correlation(left, columns)) * left.squaredNorm();
      if (rest >= least) continue;
      least = rest;
      best = &columns;
    }
    if (best == nullptr) break;
    const Eigen::MatrixXd chosen = best->colwise().normalized();
    const PivotedQr qr(chosen);
    const Eigen::MatrixXd basis = qr.first_of_q(qr.rank());
    left -= basis * (basis.transpose() * left);
    for (Eigen::MatrixXd& columns : others) columns -= basis * (basis.transpose() * columns);
  }
  return 1 - left.squaredNorm() / all;
}

}  // namespace clothfit
