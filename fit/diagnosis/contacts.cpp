#include "fit/diagnosis/contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "data/parallel.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/residual_acceleration.h"
#include "fit/diagnosis/search_context.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// A hard obstacle: cloth of 0.2 kg/m2 sinks into it by 0.1 mm and does not bounce.
constexpr double kStiffness_pa_per_m = 2e4, kDamping_pa_s_per_m = 130;

/// Frames since it was met from which it is placed.
constexpr int kStretches[] = {2, 4, 8, 1000};
/// Radii that are tried, as shares of the cloth's width.
constexpr double kRadii[] = {0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0};
/// Places of one kind that are fitted.
constexpr size_t kFitted = 2;

/// A push on one marker.
struct Push {
  int frame = 0;
  Eigen::Vector3d at_m, along;  ///< a unit vector
  double weight = 0;            ///< square of the acceleration
};

using Shape = std::map<std::string, double>;

std::vector<Push> pushes_in(const FittedModel& model) {
  std::vector<Push> pushes;
  std::map<int, int> of_frame;
  for (const ResidualAcceleration& of : residual_accelerations(model, 0)) {
    const double size = of.acceleration_m_per_s2.norm();
    if (size < kCriteria.push_sigmas * of.sigma_m_per_s2) continue;
    pushes.push_back({.frame = of.frame,
                      .at_m = of.observed_m,
                      .along = of.acceleration_m_per_s2 / size,
                      .weight = size * size});
    ++of_frame[of.frame];
  }
  const auto met = std::ranges::find_if(
      of_frame, [](const auto& frame) { return frame.second >= kCriteria.fewest_pushed; });
  if (met == of_frame.end()) return {};
  std::erase_if(pushes, [&](const Push& push) { return push.frame < met->first; });
  std::ranges::stable_sort(pushes, {}, &Push::frame);
  return pushes;
}

/// The middle of the pushes that lie together around the strongest, and where they go.
Push together(const std::vector<Push>& pushes, double reach_m) {
  const Push& strongest = *std::ranges::max_element(pushes, {}, &Push::weight);
  Push sum{.at_m = Eigen::Vector3d::Zero(), .along = Eigen::Vector3d::Zero()};
  for (const Push& push : pushes) {
    if ((push.at_m - strongest.at_m).norm() > reach_m) continue;
    sum.at_m += push.weight * push.at_m;
    sum.along += push.weight * push.along;
    sum.weight += push.weight;
  }
  sum.at_m /= sum.weight;
  sum.along.normalize();
  return sum;
}

Shape ball(const Eigen::Vector3d& centre_m, double radius_m) {
  return {{"centre_x", centre_m.x()},
          {"centre_y", centre_m.y()},
          {"centre_z", centre_m.z()},
          {"radius", radius_m}};
}

/// Returns the ball in whose centre the pushes meet, by least squares of their distances from it.
/// Pushes that do not point away from there count less in turn. Its radius is not above 0 where
/// they point towards it.
std::pair<Eigen::Vector3d, double> where_pushes_meet(const std::vector<Push>& pushes) {
  constexpr int kRounds = 6;
  constexpr double kFirmness = 1e-3;  // of lines that are nearly parallel
  std::vector<double> agreement(pushes.size(), 1);
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double radius_m = 0;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
    Eigen::Vector3d target = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
    double all = 0;
    for (size_t k = 0; k < pushes.size(); ++k) {
      const double weight = pushes[k].weight * agreement[k];
      const Eigen::Matrix3d off =
          Eigen::Matrix3d::Identity() - pushes[k].along * pushes[k].along.transpose();
      across += weight * off;
      target += weight * off * pushes[k].at_m;
      middle += weight * pushes[k].at_m;
      all += weight;
    }
    if (!(all > 0)) return {centre_m, 0};
    across += kFirmness * all * Eigen::Matrix3d::Identity();
    target += kFirmness * middle;
    centre_m = SymmetricFactors(Eigen::MatrixXd(across)).solve(Eigen::MatrixXd(target));
    double sum_m = 0;
    for (size_t k = 0; k < pushes.size(); ++k) {
      const Eigen::Vector3d out = pushes[k].at_m - centre_m;
      const double cosine = std::max(0.0, pushes[k].along.dot(out.stableNormalized()));
      sum_m += pushes[k].weight * agreement[k] * pushes[k].along.dot(out);
      agreement[k] = std::pow(cosine, 4);
    }
    radius_m = sum_m / all;
  }
  return {centre_m, radius_m};
}

std::vector<Shape> balls(const std::vector<Push>& pushes, double width_m) {
  std::vector<Shape> shapes;
  const auto [centre_m, radius_m] = where_pushes_meet(pushes);
  if (radius_m > 0) shapes.push_back(ball(centre_m, radius_m));
  const Push one = together(pushes, kRadii[2] * width_m);
  for (const double share : kRadii)
    shapes.push_back(ball(one.at_m - share * width_m * one.along, share * width_m));
  return shapes;
}

std::vector<Shape> planes(const std::vector<Push>& pushes, double width_m) {
  const Push one = together(pushes, width_m);
  return {{{"n_x", one.along.x()},
           {"n_y", one.along.y()},
           {"n_z", one.along.z()},
           {"offset", one.along.dot(one.at_m)}}};
}

/// Returns the places where an effect's obstacle may be.
std::vector<Shape> places(const std::string& effect, const std::vector<Push>& pushes,
                          double width_m) {
  const std::vector<EffectParameter> parameters = describe_effect(effect).parameters;
  const bool is_round =
      std::ranges::find(parameters, "radius", &EffectParameter::name) != parameters.end();
  std::vector<Shape> shapes;
  for (const int stretch : kStretches) {
    std::vector<Push> first;
    for (const Push& push : pushes)
      if (push.frame <= pushes.front().frame + stretch) first.push_back(push);
    const std::vector<Shape> more = is_round ? balls(first, width_m) : planes(first, width_m);
    shapes.insert(shapes.end(), more.begin(), more.end());
    if (first.size() == pushes.size()) break;
  }
  std::erase_if(shapes, [&](const Shape& shape) {
    return std::ranges::any_of(shape, [&](const auto& number) {
      const auto range = std::ranges::find(parameters, number.first, &EffectParameter::name);
      return number.second < range->lower || number.second > range->upper;
    });
  });
  return shapes;
}

/// Returns how far the numbers of a shape may lie from where they were placed.
Shape sigma_of(const Shape& shape, double width_m) {
  Shape sigma;
  for (const auto& [name, value] : shape)
    sigma[name] = name == "radius"         ? std::max(0.5 * value, 0.05 * width_m)
                  : name.starts_with("n_") ? 0.5
                                           : 0.5 * width_m;
  return sigma;
}

/// Runs a model over the frames of another one, with its corrections. The model has failed where it
/// does not run.
FittedModel run_as(const FittedModel& other, FittedModel model) {
  model.state = FitState::unrefined;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    PooledPart& part = model.parts[n];
    part.frames = other.parts[n].frames;
    part.correction = other.parts[n].correction;
    const TrajectoryObjective objective = model.objective(n);
    part.linear.residual = objective.residuals({part.values}).front();
    if (part.linear.residual.size() != objective.residual_count()) model.state = FitState::failed;
  }
  return model;
}

/// Returns the model with a hard obstacle, run over the frames of `at`.
FittedModel with_obstacle(const DiagnosisSetup& mesh, const FittedModel& at,
                          const std::vector<NamedValues>& values, const Hypothesis& obstacle) {
  std::vector<Hypothesis> hypotheses = at.hypotheses;
  hypotheses.push_back(obstacle);
  std::vector<NamedValues> start = values;
  for (NamedValues& known : start) {
    known[obstacle.effect + ".stiffness"] = kStiffness_pa_per_m;
    known[obstacle.effect + ".damping"] = kDamping_pa_s_per_m;
  }
  return run_as(at, model_at(mesh, hypotheses, start));
}

/// Returns the model that has not met the obstacle yet, run over the frames of `at`.
FittedModel going_on(const DiagnosisSetup& mesh, const FittedModel& before, const FittedModel& at) {
  if (!before.usable()) return at;
  FittedModel model = run_as(at, model_at(mesh, at.hypotheses, before.values()));
  return model.usable() ? model : at;
}

/// Fits the obstacle's place along with the model, and scores what that leaves.
Score score_of(const SearchContext& search, const FittedModel& at, const FittedModel& fitted) {
  Score score{.hypothesis = fitted.hypotheses.back(),
              .amplitude = Eigen::VectorXd(2),
              .sigma = Eigen::VectorXd::Constant(2, std::numeric_limits<double>::infinity()),
              .decrease = search.left_by(at) - search.left_by(fitted),
              .columns = {},
              .fitted = fitted.values()};
  const PooledPart& part = at.parts.front();
  score.fitted_share = static_cast<double>(part.frames) / at.problems.front()->first_held_out;
  const NamedValues& values = score.fitted.front();
  const std::string& effect = score.hypothesis.effect;
  score.amplitude << values.at(effect + ".stiffness"), values.at(effect + ".damping");
  for (auto& [name, value] : score.hypothesis.shape) value = values.at(effect + "." + name);
  const auto count = static_cast<double>(at.residual_count());
  score.share = score.decrease / std::max(search.left_by(at) - count, std::sqrt(2 * count));
  return score;
}

}  // namespace

std::vector<Score> score_contacts(const SearchContext& search, const DiagnosisSetup& mesh,
                                  const FittedModel& before, const FittedModel& at,
                                  const std::vector<Hypothesis>& contacts) {
  if (contacts.empty()) return {};
  const FittedModel onward = going_on(mesh, before, at);
  const std::vector<Push> pushes = pushes_in(onward);
  if (pushes.empty()) return {};
  const double width_m = mesh.inputs.front().recording.cloth.width_m;
  const std::vector<NamedValues> values = onward.values();

  std::vector<Score> scores;
  for (const Hypothesis& contact : contacts) {
    std::vector<FittedModel> models;
    for (Shape& shape : places(contact.effect, pushes, width_m)) {
      Hypothesis obstacle = contact;
      obstacle.shape_sigma = sigma_of(shape, width_m);
      obstacle.shape = std::move(shape);
      obstacle.fits_shape = true;
      models.push_back({.hypotheses = {obstacle}, .problems = {}, .parts = {}});
    }
    for_each_index(models.size(), [&](size_t k) {
      models[k] = with_obstacle(mesh, at, values, models[k].hypotheses.front());
    });
    std::ranges::stable_sort(models, {},
                             [&](const FittedModel& model) { return search.left_by(model); });
    models.resize(std::min(models.size(), kFitted));
    std::erase_if(models, [&](const FittedModel& model) {
      return search.left_by(model) >= search.left_by(onward);
    });
    for_each_index(models.size(), [&](size_t k) {
      refine_model(models[k], mesh, {.rounds = 1, .linearisations = 3}, search.progress);
    });
    const auto best = std::ranges::min_element(
        models, {}, [&](const FittedModel& model) { return search.left_by(model); });
    if (best == models.end() || search.left_by(*best) >= search.left_by(at)) continue;
    scores.push_back(score_of(search, at, *best));
  }
  return scores;
}

}  // namespace clothfit
