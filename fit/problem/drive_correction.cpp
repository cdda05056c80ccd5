#include "fit/problem/drive_correction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

using Basis = DriveCorrection::Basis;

constexpr int kTail = 3;               ///< knots behind the last that carries a value
constexpr double kLeastNoiseM = 1e-6;  ///< added by path_covariance()
constexpr double kWidest = 20;         ///< standard deviations: the prior holds it, not the range
/// Times closer than these shares of the mean spacing are one. A covariance changes with the time
/// itself; a path would bend elsewhere.
constexpr double kSameSample = 1e-3, kSameKnot = 1e-5;
constexpr const char* kAxes[] = {"x", "y", "z"};

/// The form of c between knots: cubics of the values and second derivatives at both ends. At the
/// knots these are affine in the knots' values v.
template <int D>
struct Correction {
  std::shared_ptr<const Basis> basis;
  Eigen::Matrix<double, D, Eigen::Dynamic> value, second_derivative;  ///< D x (K + 3)

  Correction(std::shared_ptr<const Basis> of,
             const Eigen::Matrix<double, D, Eigen::Dynamic>& at_knots)
      : basis(std::move(of)),
        value(at_knots * basis->value.transpose()),
        second_derivative(at_knots * basis->second_derivative.transpose()) {}

  Eigen::Matrix<double, D, 1> operator()(double time_s) const {
    const std::vector<double>& knot_s = basis->time_s;
    if (time_s >= knot_s.back()) return Eigen::Matrix<double, D, 1>::Zero();
    if (time_s <= knot_s.front()) return value.col(0);
    const auto after = std::upper_bound(knot_s.begin(), knot_s.end(), time_s);
    const auto k = static_cast<Eigen::Index>(after - knot_s.begin()) - 1;
    const double h = *after - *(after - 1);
    const double u = (time_s - *(after - 1)) / h, v = 1 - u;
    return v * value.col(k) + u * value.col(k + 1) +
           h * h / 6 *
               ((v * v * v - v) * second_derivative.col(k) +
                (u * u * u - u) * second_derivative.col(k + 1));
  }
};

/// Returns the values at the knots, 3 x K.
Eigen::Matrix3Xd at_knots(const DriveCorrection::Point& point, const Eigen::VectorXd& values) {
  Eigen::Matrix3Xd at(3, static_cast<Eigen::Index>(point.values.size() / 3));
  for (size_t n = 0; n < point.values.size(); ++n) at.data()[n] = point.values[n].value(values);
  return at;
}

std::shared_ptr<const Basis> make_basis(double first_s, double last_s, int knots) {
  assert(knots >= 4 && first_s < last_s);
  const double spacing_s = (last_s - first_s) / (knots - 1);
  auto basis = std::make_shared<Basis>();
  for (int k = 0; k < knots; ++k) basis->time_s.push_back(first_s + k * spacing_s);
  // A smoothing spline that smooths nothing goes through all given values.
  const SmoothingSpline each =
      fit_smoothing_spline(basis->time_s, Eigen::MatrixXd::Identity(knots, knots), {},
                           {.smoothing = 1e-30, .robust = false});
  basis->value = Eigen::MatrixXd::Identity(knots + kTail, knots);
  basis->second_derivative = Eigen::MatrixXd::Zero(knots + kTail, knots);
  basis->second_derivative.topRows(knots) = each.second_derivative.transpose();

  // The tail follows from steps h and c, slope c', c'' = 0 at the last knot. Further conditions are
  // continuity to the second derivative at both knots between, and 0, 0, 0 at the end:
  //   c_2 = (c + h c') / 6,  c_1 = (5 c + 4 h c') / 6,
  //   c''_1 = 6 (c_1 - 6 c_2) / h^2,  c''_2 = 6 c_2 / h^2.
  const double h = spacing_s / kTail;
  const Eigen::RowVectorXd end = Eigen::RowVectorXd::Unit(knots, knots - 1);
  const Eigen::RowVectorXd slope = each.velocity(basis->time_s.back()).transpose();
  const Eigen::RowVectorXd second = (end + h * slope) / 6, first = (5 * end + 4 * h * slope) / 6;
  basis->value.row(knots) = first;
  basis->value.row(knots + 1) = second;
  basis->second_derivative.row(knots) = 6 * (first - 6 * second) / (h * h);
  basis->second_derivative.row(knots + 1) = 6 * second / (h * h);
  for (int k = 1; k <= kTail; ++k) basis->time_s.push_back(last_s + k * h);
  return basis;
}

/// Returns the index of the sample at a time, to a share of the mean spacing; -1 for none.
Eigen::Index sample_at(const std::vector<double>& sample_s, double time_s, double share) {
  const double same_s =
      share * (sample_s.back() - sample_s.front()) / static_cast<double>(sample_s.size());
  for (size_t n = 0; n < sample_s.size(); ++n)
    if (std::abs(sample_s[n] - time_s) <= same_s) return static_cast<Eigen::Index>(n);
  return -1;
}

}  // namespace

Eigen::MatrixXd path_covariance(const TrackedPoint& point, const std::vector<double>& time_s,
                                const std::string& where) {
  const SmoothingSpline& path = *point.path;
  if (!std::isfinite(path.noise_sigma))
    throw InputError(where, "a tracked held point has too short a track to tell its noise",
                     "at least 3 good 3D positions of its marker",
                     "leave it out, or track the held point");
  const std::vector<double> sigma =
      point.sigma.empty() ? std::vector<double>(path.time_s.size(), 1.0) : point.sigma;
  const auto count = static_cast<Eigen::Index>(time_s.size());
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double knot_s = time_s[static_cast<size_t>(k)];
    std::vector<double> sample_s = path.time_s, sample_sigma = sigma;
    Eigen::Index at = sample_at(sample_s, knot_s, kSameSample);
    const bool added = at < 0;
    if (added) {
      at = std::upper_bound(sample_s.begin(), sample_s.end(), knot_s) - sample_s.begin();
      sample_s.insert(sample_s.begin() + at, knot_s);
      sample_sigma.insert(sample_sigma.begin() + at, sigma.front());
    }
    const Eigen::RowVectorXd unit =
        Eigen::RowVectorXd::Unit(static_cast<Eigen::Index>(sample_s.size()), at);
    const SmoothingSpline smoothed = fit_smoothing_spline(
        sample_s, unit, sample_sigma, {.smoothing = path.smoothing, .robust = false});
    const double own_sigma = sample_sigma[static_cast<size_t>(at)];
    const double factor = own_sigma * own_sigma / (added ? 1 - smoothed.value(0, at) : 1);
    for (Eigen::Index j = 0; j < count; ++j)
      covariance(j, k) = factor * smoothed.position(time_s[static_cast<size_t>(j)])(0);
  }
  // Both triangles are the same except for rounding.
  covariance = 0.5 * path.noise_sigma * path.noise_sigma *
               (covariance + Eigen::MatrixXd(covariance.transpose()));
  covariance.diagonal().array() += kLeastNoiseM * kLeastNoiseM;
  return covariance;
}

DriveCorrection make_drive_correction(const std::vector<TrackedPoint>& tracked, double first_s,
                                      double last_s, int knots, const MarkerSet& markers,
                                      ParameterSpace& space, std::vector<GaussianPrior>& priors) {
  DriveCorrection correction;
  correction.basis = make_basis(first_s, last_s, knots);
  const std::vector<double> knot_s(correction.basis->time_s.begin(),
                                   correction.basis->time_s.begin() + knots);
  double sum_of_variances = 0;
  for (const TrackedPoint& point : tracked) {
    const Eigen::MatrixXd covariance = path_covariance(point, knot_s, "FitOptions::drive_knots");
    const std::string& marker = markers.markers[static_cast<size_t>(point.marker)].name;
    const int first = space.size();
    DriveCorrection::Point corrected{.held = point.held, .values = {}};
    for (int k = 0; k < knots; ++k) {
      const double sigma_m = std::sqrt(covariance(k, k));
      for (const char* axis : kAxes) {
        corrected.values.push_back({.parameter = space.size()});
        space.parameters.push_back(
            {.name = "drive_" + marker + "_" + std::to_string(k) + "_" + axis,
             .unit = "m",
             .role = ParameterRole::drive,
             .scale = ParameterScale::linear,
             .lower = -kWidest * sigma_m,
             .upper = kWidest * sigma_m,
             .start = 0,
             .typical = sigma_m});
      }
    }
    // C = L L', so that L^-1 c is standard normal.
    const CholeskyFactors factors(covariance);
    assert(factors.usable());
    for (int axis = 0; axis < 3; ++axis) {
      GaussianPrior prior{.indices = {},
                          .mean = Eigen::VectorXd::Zero(knots),
                          .sqrt_information = factors.inverse_lower()};
      for (int k = 0; k < knots; ++k) prior.indices.push_back(first + 3 * k + axis);
      priors.push_back(std::move(prior));
    }
    sum_of_variances += covariance.trace() / knots;
    correction.points.push_back(std::move(corrected));
  }
  correction.prior_rms_m = std::sqrt(sum_of_variances / static_cast<double>(tracked.size()));
  return correction;
}

std::vector<std::function<Eigen::Vector3d(double time_s)>> drive_shifts(
    const DriveCorrection& correction, const Eigen::VectorXd& values, size_t held) {
  std::vector<std::function<Eigen::Vector3d(double time_s)>> shifts(held);
  for (const DriveCorrection::Point& point : correction.points)
    shifts[static_cast<size_t>(point.held)] =
        Correction<3>(correction.basis, at_knots(point, values));
  return shifts;
}

std::function<Eigen::Vector3d(double time_s)> drive_shift_by_value(
    const DriveCorrection& correction, int knot, const Eigen::Vector3d& change) {
  const Correction<1> share(correction.basis, Eigen::RowVectorXd::Unit(correction.knots(), knot));
  return [share, change](double time_s) -> Eigen::Vector3d { return share(time_s)(0) * change; };
}

std::vector<double> corrected_times(const DriveCorrection& correction,
                                    const std::vector<double>& frame_time_s) {
  std::vector<double> time_s = frame_time_s;
  if (correction.points.empty()) return time_s;
  for (const double knot_s : correction.basis->time_s)
    if (sample_at(frame_time_s, knot_s, kSameKnot) < 0) time_s.push_back(knot_s);
  std::ranges::sort(time_s);
  return time_s;
}

double rms_correction_m(const DriveCorrection& correction, const Eigen::VectorXd& values,
                        const std::vector<double>& time_s) {
  double sum = 0;
  for (const DriveCorrection::Point& point : correction.points) {
    const Correction<3> path(correction.basis, at_knots(point, values));
    for (const double t : time_s) sum += path(t).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(3 * correction.points.size() * time_s.size()));
}

}  // namespace clothfit
