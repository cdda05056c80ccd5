#include "fit/diagnosis/residual_force.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "fit/observe/smoothing_spline.h"
#include "fit/problem/parameterised_model.h"

namespace clothfit {
namespace {

constexpr size_t kFewestFramesOfMarker = 10;
constexpr size_t kEnds = 2;  ///< frames left out at each of its ends

/// A marker in one frame: the residual acceleration, and the model's motion there.
struct Sample {
  int marker = 0, frame = 0;
  Eigen::Vector3d residual_m_per_s2;
  Eigen::Vector3d velocity_m_per_s, acceleration_m_per_s2;
  Eigen::Vector3d normal;
  double strain_s = 0, strain_t = 0;
  double strain_rate_s_per_s = 0, strain_rate_t_per_s = 0;
  double height_m = 0, time_s = 0, s = 0, t = 0;
};

/// The motion of the model's markers: 3 x markers in each frame.
struct Motion {
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s, by_s, by_t, rate_by_s, rate_by_t;
};

Motion motion_of(const FitProblem& problem, const PooledPart& part) {
  const SimulateResult run =
      run_model(problem, {part.values}, part.frames, part.steps, true).front();
  Motion motion;
  if (!run.usable()) return motion;
  const Mesh& mesh = problem.cloth.mesh;
  const auto surface = [&](SurfaceQuantity quantity) {
    return make_surface(mesh.columns, mesh.rows, mesh.width_m, mesh.height_m,
                        problem.marker_place_m, SurfaceInterpolation::bicubic, quantity);
  };
  const Surface place = surface(SurfaceQuantity::place), by_s = surface(SurfaceQuantity::by_s),
                by_t = surface(SurfaceQuantity::by_t);
  for (size_t f = 0; f < static_cast<size_t>(part.frames); ++f) {
    motion.position_m.push_back(place.evaluate(run.position_m[f]));
    motion.velocity_m_per_s.push_back(place.evaluate(run.velocity_m_per_s[f]));
    motion.by_s.push_back(by_s.evaluate(run.position_m[f]));
    motion.by_t.push_back(by_t.evaluate(run.position_m[f]));
    motion.rate_by_s.push_back(by_s.evaluate(run.velocity_m_per_s[f]));
    motion.rate_by_t.push_back(by_t.evaluate(run.velocity_m_per_s[f]));
  }
  return motion;
}

/// Takes a path's least-squares parabola out of it, and returns that parabola's acceleration. A
/// natural spline, straight at its ends, would bend a constant acceleration down to nothing there.
Eigen::Vector3d take_out_parabola(const std::vector<double>& time_s, Eigen::MatrixXd& path_m) {
  const Eigen::Index count = path_m.cols();
  const Eigen::Map<const Eigen::VectorXd> time(time_s.data(), count);
  const Eigen::VectorXd t = time.array() - time.mean();
  Eigen::MatrixXd powers(count, 3);
  powers << Eigen::VectorXd::Ones(count), t, 0.5 * t.cwiseAbs2();
  const Eigen::MatrixXd coefficients =
      PivotedQr(powers).solve(path_m.transpose());  // 3 x coordinates
  path_m -= (powers * coefficients).transpose();
  return coefficients.row(2).transpose();
}

/// Returns samples of all markers whose residuals can be differentiated twice.
std::vector<Sample> samples_of(const FitProblem& problem, const PooledPart& part, int set,
                               const Motion& motion) {
  const Mesh& mesh = problem.cloth.mesh;
  const TrajectoryObjective objective(problem, part.frames, part.steps);
  const Eigen::VectorXd residual = residual_of(part);
  std::map<int, std::vector<const Objective::Block*>> of_marker;
  for (const Objective::Block& block : objective.blocks())
    if (block.set == set) of_marker[block.marker].push_back(&block);
  const Eigen::Vector3d up = -problem.gravity_m_per_s2.stableNormalized();

  std::vector<Sample> samples;
  for (const auto& [marker, blocks] : of_marker) {
    if (blocks.size() < kFewestFramesOfMarker) continue;
    std::vector<double> time_s, sigma_m;
    Eigen::MatrixXd residual_m(3, static_cast<Eigen::Index>(blocks.size()));
    for (const Objective::Block* block : blocks) {
      const auto& rows = problem.observations[static_cast<size_t>(set)].rows;
      sigma_m.push_back(rows[static_cast<size_t>(block->row)].sigma);
      // Residuals are predicted less observed, in sigmas.
      residual_m.col(static_cast<Eigen::Index>(time_s.size())) =
          -sigma_m.back() * residual.segment<3>(block->offset);
      time_s.push_back(problem.frame_time_s[static_cast<size_t>(block->frame)]);
    }
    const Eigen::Vector3d steady_m_per_s2 = take_out_parabola(time_s, residual_m);
    const SmoothingSpline spline = fit_smoothing_spline(time_s, residual_m, sigma_m);
    for (size_t k = kEnds; k + kEnds < blocks.size(); ++k) {
      const auto f = static_cast<size_t>(blocks[k]->frame);
      if (f == 0 || f + 1 >= motion.position_m.size()) continue;
      const auto at = [&, m = marker](const std::vector<Eigen::Matrix3Xd>& of, size_t frame) {
        return Eigen::Vector3d(of[frame].col(m));
      };
      const Eigen::Vector3d x_s = at(motion.by_s, f), x_t = at(motion.by_t, f);
      const Eigen::Vector3d v_s = at(motion.rate_by_s, f), v_t = at(motion.rate_by_t, f);
      samples.push_back(
          {.marker = marker,
           .frame = static_cast<int>(f),
           .residual_m_per_s2 = steady_m_per_s2 + spline.acceleration(time_s[k]),
           .velocity_m_per_s = at(motion.velocity_m_per_s, f),
           .acceleration_m_per_s2 =
               (at(motion.velocity_m_per_s, f + 1) - at(motion.velocity_m_per_s, f - 1)) /
               (problem.frame_time_s[f + 1] - problem.frame_time_s[f - 1]),
           .normal = x_s.cross(x_t).stableNormalized(),
           .strain_s = x_s.norm() - 1,
           .strain_t = x_t.norm() - 1,
           .strain_rate_s_per_s = x_s.stableNormalized().dot(v_s),
           .strain_rate_t_per_s = x_t.stableNormalized().dot(v_t),
           .height_m = up.dot(at(motion.position_m, f)),
           .time_s = time_s[k],
           .s = 2 * problem.marker_place_m(0, marker) / mesh.width_m - 1,
           .t = 2 * problem.marker_place_m(1, marker) / mesh.height_m - 1});
    }
  }
  return samples;
}

/// Returns the standard deviation of a slope whose residuals may depend on each other within a
/// marker. `pull` is x (y - slope x) of each sample, `square` the sum of x^2.
double clustered_sigma(const std::vector<Sample>& samples, const Eigen::VectorXd& pull,
                       double square) {
  std::map<int, double> of_marker;
  for (size_t k = 0; k < samples.size(); ++k)
    of_marker[samples[k].marker] += pull[static_cast<Eigen::Index>(k)];
  double sum = 0;
  for (const auto& [marker, own] : of_marker) sum += own * own;
  const auto count = static_cast<double>(of_marker.size());
  return count > 1 ? std::sqrt(sum * count / (count - 1)) / square
                   : std::numeric_limits<double>::infinity();
}

/// Regresses on a vector, which `of` gives for a sample.
template <class Of>
void regress_on_vector(const std::vector<Sample>& samples, const std::string& on,
                       const std::string& unit, const Of& of, ResidualForce& result) {
  double product = 0, square = 0, whole = 0;
  for (const Sample& sample : samples) {
    const Eigen::Vector3d x = of(sample);
    product += x.dot(sample.residual_m_per_s2);
    square += x.squaredNorm();
    whole += sample.residual_m_per_s2.squaredNorm();
  }
  if (square == 0 || whole == 0) return;
  const double slope = product / square;
  Eigen::VectorXd pull(static_cast<Eigen::Index>(samples.size()));
  for (size_t k = 0; k < samples.size(); ++k) {
    const Eigen::Vector3d x = of(samples[k]);
    pull[static_cast<Eigen::Index>(k)] = x.dot(samples[k].residual_m_per_s2 - slope * x);
  }
  result.regressions.push_back({.on = on,
                                .unit = unit,
                                .correlation = product / std::sqrt(square * whole),
                                .slope = slope,
                                .sigma = clustered_sigma(samples, pull, square)});
}

/// Regresses on a number, which `of` gives for a sample.
template <class Of>
void regress_on_number(const std::vector<Sample>& samples, const std::string& on,
                       const std::string& unit, const Of& of, ResidualForce& result) {
  const auto count = static_cast<double>(samples.size());
  double mean_x = 0;
  Eigen::Vector3d mean_y = Eigen::Vector3d::Zero();
  for (const Sample& sample : samples) {
    mean_x += of(sample) / count;
    mean_y += sample.residual_m_per_s2 / count;
  }
  double square = 0, whole = 0;
  Eigen::Vector3d product = Eigen::Vector3d::Zero();
  for (const Sample& sample : samples) {
    const double x = of(sample) - mean_x;
    const Eigen::Vector3d y = sample.residual_m_per_s2 - mean_y;
    product += x * y;
    square += x * x;
    whole += y.squaredNorm();
  }
  if (!(square > 0) || whole == 0) return;
  const Eigen::Vector3d slope = product / square, along = slope.stableNormalized();
  Eigen::VectorXd pull(static_cast<Eigen::Index>(samples.size()));
  for (size_t k = 0; k < samples.size(); ++k) {
    const double x = of(samples[k]) - mean_x;
    pull[static_cast<Eigen::Index>(k)] =
        x * along.dot(samples[k].residual_m_per_s2 - mean_y - slope * x);
  }
  result.regressions.push_back({.on = on,
                                .unit = unit,
                                .correlation = product.norm() / std::sqrt(square * whole),
                                .slope = slope.norm(),
                                .sigma = clustered_sigma(samples, pull, square)});
}

void regress(const std::vector<Sample>& samples, ResidualForce& result) {
  const auto normal_velocity = [](const Sample& at) -> Eigen::Vector3d {
    return at.normal.dot(at.velocity_m_per_s) * at.normal;
  };
  const auto on_vector = [&](const char* on, const char* unit, const auto& of) {
    regress_on_vector(samples, on, unit, of, result);
  };
  const auto on_number = [&](const char* on, const char* unit, const auto& of) {
    regress_on_number(samples, on, unit, of, result);
  };
  using Vector = Eigen::Vector3d;
  on_vector("velocity", "1/s", [](const Sample& at) -> Vector { return at.velocity_m_per_s; });
  on_vector("speed times velocity", "1/m", [](const Sample& at) -> Vector {
    return at.velocity_m_per_s.norm() * at.velocity_m_per_s;
  });
  on_vector("normal velocity", "1/s", normal_velocity);
  on_vector("normal speed times normal velocity", "1/m", [&](const Sample& at) -> Vector {
    return normal_velocity(at).norm() * normal_velocity(at);
  });
  on_vector("velocity in the surface", "1/s",
            [&](const Sample& at) -> Vector { return at.velocity_m_per_s - normal_velocity(at); });
  on_vector("acceleration", "1",
            [](const Sample& at) -> Vector { return at.acceleration_m_per_s2; });
  on_vector("normal", "m/s2", [](const Sample& at) -> Vector { return at.normal; });
  on_number("strain along the weft", "m/s2", [](const Sample& at) { return at.strain_s; });
  on_number("strain along the warp", "m/s2", [](const Sample& at) { return at.strain_t; });
  on_number("strain rate along the weft", "m/s",
            [](const Sample& at) { return at.strain_rate_s_per_s; });
  on_number("strain rate along the warp", "m/s",
            [](const Sample& at) { return at.strain_rate_t_per_s; });
  on_number("place along s", "m/s2", [](const Sample& at) { return at.s; });
  on_number("place along t", "m/s2", [](const Sample& at) { return at.t; });
  on_number("height", "1/s2", [](const Sample& at) { return at.height_m; });
  on_number("time", "m/s3", [](const Sample& at) { return at.time_s; });
}

void average(const std::vector<Sample>& samples, int frames, ResidualForce& result) {
  std::map<int, std::pair<Eigen::Matrix<double, 3, 2>, int>> of_marker;
  std::vector<double> sum(static_cast<size_t>(frames), 0), count = sum;
  for (const Sample& sample : samples) {
    auto [entry, is_new] = of_marker.try_emplace(
        sample.marker, Eigen::Matrix<double, 3, 2>(Eigen::Matrix<double, 3, 2>::Zero()), 0);
    entry->second.first.col(0) += sample.residual_m_per_s2;
    entry->second.first.col(1) += sample.residual_m_per_s2.cwiseAbs2();
    ++entry->second.second;
    sum[static_cast<size_t>(sample.frame)] += sample.residual_m_per_s2.squaredNorm();
    ++count[static_cast<size_t>(sample.frame)];
  }
  for (const auto& [marker, sums] : of_marker)
    result.markers.push_back({.marker = marker,
                              .mean_m_per_s2 = sums.first.col(0) / sums.second,
                              .rms_m_per_s2 = (sums.first.col(1) / sums.second).cwiseSqrt()});
  for (size_t f = 0; f < sum.size(); ++f)
    result.rms_by_frame_m_per_s2.push_back(count[f] > 0 ? std::sqrt(sum[f] / count[f])
                                                        : std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

ResidualForce residual_force(const FittedModel& model) {
  ResidualForce result;
  const FitProblem& problem = *model.problems.front();
  const PooledPart& part = model.parts.front();
  const std::vector<ObservationSet>& sets = problem.observations;
  const auto set = std::ranges::find(sets, 3, &ObservationSet::dimension);
  if (set == sets.end()) {
    result.why_none = "pixels say nothing of accelerations in space";
    return result;
  }
  const Motion motion = motion_of(problem, part);
  if (motion.position_m.empty()) {
    result.why_none = "the model's run did not end";
    return result;
  }
  const std::vector<Sample> samples =
      samples_of(problem, part, static_cast<int>(set - sets.begin()), motion);
  if (samples.empty()) {
    result.why_none = "no marker was seen in ten frames";
    return result;
  }
  average(samples, part.frames, result);
  regress(samples, result);
  return result;
}

}  // namespace clothfit
