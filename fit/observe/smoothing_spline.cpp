#include "fit/observe/smoothing_spline.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "data/median.h"

namespace clothfit {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHuber = 1.345;  ///< 95 % efficient for normal noise
/// Price of a degree of freedom in the cross-validation score. 1 is the plain score. 1.2 to 1.4
/// keep the score from following the noise and cost next to nothing elsewhere [kim2004].
constexpr double kCaution = 1.4;
constexpr int kMostIterations = 50;
constexpr Eigen::Index kFewestForOutliers = 8;
constexpr Eigen::Index kNeighbours = 6;  ///< to either side, with which a sample is compared
/// Largest distance of a moving coordinate from its path, as a share of its step from sample to
/// sample. For noise it is 0.7.
constexpr double kShareOfStep = 1.0 / 3;

/// Symmetric matrix with two bands above its diagonal: band(k, i) is entry [i, i + k].
using Band = Eigen::Matrix3Xd;

/// The parts of Reinsch's system that depend on times and weights alone. Column i belongs to the
/// inner knot i + 1. With h_i = t_{i+1} - t_i,
///   Q' f  = second divided differences, rows (1/h_i, -1/h_i - 1/h_{i+1}, 1/h_{i+1}),
///   R     = overlaps of the hat functions, and
///   (R + lambda Q' W^-1 Q) gamma = Q' y,  f = y - lambda W^-1 Q gamma,  gamma = f'' inside.
struct System {
  Eigen::Matrix3Xd q;  ///< column i: the three entries of Q's column i, at knots i, i + 1, i + 2
  Band r;
  Band qwq;                  ///< Q' W^-1 Q
  Eigen::VectorXd variance;  ///< diagonal of W^-1
};

System make_system(const std::vector<double>& time_s, const Eigen::VectorXd& variance) {
  const auto n = static_cast<Eigen::Index>(time_s.size());
  const Eigen::Index m = n - 2;
  System system;
  system.variance = variance;
  system.q.resize(3, m);
  system.r = Band::Zero(3, m);
  system.qwq = Band::Zero(3, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const auto k = static_cast<size_t>(i);
    const double before = time_s[k + 1] - time_s[k];
    const double after = time_s[k + 2] - time_s[k + 1];
    system.q.col(i) << 1 / before, -1 / before - 1 / after, 1 / after;
    system.r(0, i) = (before + after) / 3;
    if (i + 1 < m) system.r(1, i) = after / 6;
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index b = 0; b < 3 && i + b < m; ++b)
      for (Eigen::Index knot = i + b; knot <= i + 2; ++knot)
        system.qwq(b, i) += system.q(knot - i, i) * variance(knot) * system.q(knot - i - b, i + b);
  }
  return system;
}

/// Factorises a positive definite band matrix as L D L': d in row 0, L[i + k, i] in row k.
Band factorise(const Band& a) {
  const Eigen::Index m = a.cols();
  Band f = Band::Zero(3, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    double d = a(0, i), below = a(1, i);
    if (i >= 1) {
      d -= f(1, i - 1) * f(1, i - 1) * f(0, i - 1);
      below -= f(1, i - 1) * f(2, i - 1) * f(0, i - 1);
    }
    if (i >= 2) d -= f(2, i - 2) * f(2, i - 2) * f(0, i - 2);
    f(0, i) = d;
    f(1, i) = below / d;
    f(2, i) = a(2, i) / d;
  }
  return f;
}

/// Solves for each row of `right` (d x m).
Eigen::MatrixXd solve(const Band& f, Eigen::MatrixXd right) {
  const Eigen::Index m = f.cols();
  for (Eigen::Index i = 0; i < m; ++i) {
    if (i >= 1) right.col(i) -= f(1, i - 1) * right.col(i - 1);
    if (i >= 2) right.col(i) -= f(2, i - 2) * right.col(i - 2);
  }
  for (Eigen::Index i = m - 1; i >= 0; --i) {
    right.col(i) /= f(0, i);
    if (i + 1 < m) right.col(i) -= f(1, i) * right.col(i + 1);
    if (i + 2 < m) right.col(i) -= f(2, i) * right.col(i + 2);
  }
  return right;
}

/// Returns the same bands of the inverse [hutchinson1985].
Band inverse_band(const Band& f) {
  const Eigen::Index m = f.cols();
  Band s = Band::Zero(3, m);
  for (Eigen::Index i = m - 1; i >= 0; --i) {
    const double s11 = i + 1 < m ? s(0, i + 1) : 0;
    const double s12 = i + 1 < m ? s(1, i + 1) : 0;
    const double s22 = i + 2 < m ? s(0, i + 2) : 0;
    s(1, i) = -f(1, i) * s11 - f(2, i) * s12;
    s(2, i) = -f(1, i) * s12 - f(2, i) * s22;
    s(0, i) = 1 / f(0, i) - f(1, i) * s(1, i) - f(2, i) * s(2, i);
  }
  return s;
}

/// Applies Q' to each row of `y` (d x n).
Eigen::MatrixXd second_differences(const System& system, const Eigen::MatrixXd& y) {
  Eigen::MatrixXd z(y.rows(), system.q.cols());
  for (Eigen::Index i = 0; i < z.cols(); ++i) z.col(i) = y.middleCols<3>(i) * system.q.col(i);
  return z;
}

/// Returns the degrees of freedom of the path, given the bands of (R + lambda Q' W^-1 Q)^-1. Two
/// are for the straight lines, which are never penalised; the others are the trace of that inverse
/// times R.
double degrees_of_freedom(const System& system, const Band& inverse) {
  return 2 + inverse.row(0).dot(system.r.row(0)) + 2 * inverse.row(1).dot(system.r.row(1));
}

/// Returns the logarithm of the cross-validation score |W^1/2 (y - f)|^2 / (n - kCaution *
/// freedom)^2.
double score(const System& system, const Eigen::MatrixXd& z, double lambda) {
  const Band factors = factorise(system.r + lambda * system.qwq);
  const double n = static_cast<double>(system.variance.size());
  const double left_over = n - kCaution * degrees_of_freedom(system, inverse_band(factors));
  if (left_over <= 0) return std::numeric_limits<double>::infinity();
  // y - f = lambda W^-1 Q gamma, so its weighted square is lambda^2 gamma' (Q' W^-1 Q) gamma.
  const Eigen::MatrixXd gamma = solve(factors, z);
  double square = 0;
  for (Eigen::Index b = 0; b < 3 && b < gamma.cols(); ++b) {
    const Eigen::Index count = gamma.cols() - b;
    square += (b == 0 ? 1 : 2) *
              (gamma.leftCols(count).cwiseProduct(gamma.rightCols(count)).colwise().sum() *
               system.qwq.row(b).head(count).transpose())
                  .value();
  }
  square = std::max(lambda * lambda * square, std::numeric_limits<double>::min());
  return std::log(square) - 2 * std::log(left_over);
}

/// Returns the lambda of the least score. A scan by decades from the smoothest to nearly none comes
/// first, then golden sections. Ties go to the smoother path.
double choose_smoothing(const System& system, const Eigen::MatrixXd& z) {
  const double unit = system.r.row(0).sum() / system.qwq.row(0).sum();
  const auto at = [&](double decade) { return score(system, z, unit * std::pow(10.0, decade)); };
  // The scan reaches from 10^-5, where every sample is followed, to the smoothest that rounding
  // lets through. The slowest wave over n samples is damped by half at about (n / 5)^4.
  const double smoothest = 4 * std::log10(static_cast<double>(z.cols()) + 2) + 1;
  double best = smoothest, least = at(smoothest);
  for (double decade = smoothest - 1; decade > -5; decade -= 1) {
    const double value = at(decade);
    if (value < least - 1e-9 * std::abs(least)) {
      best = decade;
      least = value;
    }
  }
  if (best == smoothest) return unit * std::pow(10.0, best);
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = best - 1, high = best + 1;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = at(a), at_b = at(b);
  while (high - low > 0.02) {  // 5 % of lambda; the path depends on its fourth root
    if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = at(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = at(b);
    }
  }
  return unit * std::pow(10.0, (low + high) / 2);
}

/// Least-squares spline with given weights, and 1 - leverage of each sample.
struct Weighted {
  SmoothingSpline spline;
  Eigen::VectorXd freedom;  ///< 1 - A_ii
};

/// Returns the straight line through at most two samples.
Weighted line_through(const std::vector<double>& time_s, const Eigen::MatrixXd& y) {
  Weighted fit;
  fit.spline.time_s = time_s;
  fit.spline.value = y;
  fit.spline.second_derivative = Eigen::MatrixXd::Zero(y.rows(), y.cols());
  fit.spline.degrees_of_freedom = static_cast<double>(y.cols());
  fit.spline.noise_sigma = kNan;
  fit.spline.value_sigma.assign(time_s.size(), kNan);
  fit.freedom = Eigen::VectorXd::Zero(y.cols());
  return fit;
}

Weighted fit_weighted(const std::vector<double>& time_s, const Eigen::MatrixXd& y,
                      const Eigen::VectorXd& variance, const std::optional<double>& smoothing) {
  const Eigen::Index n = y.cols();
  if (n < 3) return line_through(time_s, y);
  const System system = make_system(time_s, variance);
  const Eigen::MatrixXd z = second_differences(system, y);
  const double lambda = smoothing ? *smoothing : choose_smoothing(system, z);

  const Band f = factorise(system.r + lambda * system.qwq);
  const Eigen::MatrixXd gamma = solve(f, z);
  const Band s = inverse_band(f);

  Weighted fit;
  SmoothingSpline& spline = fit.spline;
  spline.time_s = time_s;
  spline.smoothing = lambda;
  spline.second_derivative = Eigen::MatrixXd::Zero(y.rows(), n);
  spline.second_derivative.middleCols(1, n - 2) = gamma;
  spline.degrees_of_freedom = degrees_of_freedom(system, s);
  fit.freedom = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd residual = Eigen::MatrixXd::Zero(y.rows(), n);
  for (Eigen::Index i = 0; i < n - 2; ++i) {
    for (Eigen::Index a = 0; a < 3; ++a) {
      const double factor = lambda * variance(i + a) * system.q(a, i);
      residual.col(i + a) += factor * gamma.col(i);
      // diag(Q S Q'), each pair of Q's columns once
      fit.freedom(i + a) += factor * system.q(a, i) * s(0, i);
      for (Eigen::Index b = 1; b <= a && i + b < n - 2; ++b)
        fit.freedom(i + a) += 2 * factor * system.q(a - b, i + b) * s(b, i);
    }
  }
  spline.value = y - residual;

  const double left_over = static_cast<double>(y.rows()) * fit.freedom.sum();
  const double weighted_sum =
      (residual.array().square().rowwise() / variance.transpose().array()).sum();
  spline.noise_sigma = std::sqrt(weighted_sum / left_over);
  for (Eigen::Index i = 0; i < n; ++i)
    spline.value_sigma.push_back(spline.noise_sigma *
                                 std::sqrt(variance(i) * std::max(0.0, 1 - fit.freedom(i))));
  return fit;
}

/// Returns times and indices of the samples that are not left out.
std::pair<std::vector<double>, std::vector<Eigen::Index>> used_samples(
    const std::vector<double>& time_s, const std::vector<bool>& outlier) {
  std::pair<std::vector<double>, std::vector<Eigen::Index>> used;
  for (size_t k = 0; k < time_s.size(); ++k) {
    if (outlier[k]) continue;
    used.first.push_back(time_s[k]);
    used.second.push_back(static_cast<Eigen::Index>(k));
  }
  return used;
}

/// Returns the samples around one, without it.
std::vector<Eigen::Index> around(Eigen::Index sample, Eigen::Index count) {
  std::vector<Eigen::Index> result;
  for (Eigen::Index k = std::max<Eigen::Index>(0, sample - kNeighbours);
       k <= std::min(count - 1, sample + kNeighbours); ++k)
    if (k != sample) result.push_back(k);
  return result;
}

/// Returns the largest coordinate of each sample's distance from the path, in robust standard
/// deviations. `freedom` is 1 - leverage of each sample: a sample that the path follows closely has
/// a small residual for that reason alone.
///
/// The standard deviation is that of all samples and coordinates. Where a coordinate moves, it is
/// that of the samples around, if this is larger. Consider a track that was still and begins to
/// move fast. Between samples that are far apart, or stamped late, it leaves the path by much more
/// than the noise at rest, but by little of its step from sample to sample. Rows of outliers leave
/// the path by as much as their step.
Eigen::VectorXd robust_distances(const SmoothingSpline& spline, const Eigen::VectorXd& freedom,
                                 const std::vector<double>& time_s, const Eigen::MatrixXd& samples,
                                 const Eigen::VectorXd& variance) {
  const Eigen::Index n = samples.cols();
  const Eigen::ArrayXd sigma = variance.array().sqrt();
  Eigen::MatrixXd distance(samples.rows(), n), step = Eigen::MatrixXd::Zero(samples.rows(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    distance.col(i) =
        (samples.col(i) - spline.position(time_s[static_cast<size_t>(i)])).cwiseAbs() /
        (sigma[i] * std::sqrt(std::max(freedom(i), 1e-6)));
    if (i > 0) step.col(i) = (samples.col(i) - samples.col(i - 1)).cwiseAbs() / sigma[i];
  }
  // Samples on a line to the last digit have no noise to measure outliers by; rounding serves.
  const double rounding =
      8 * std::numeric_limits<double>::epsilon() * samples.cwiseAbs().maxCoeff() / sigma.minCoeff();
  const double of_all =
      std::max({kMadToSigma * median({distance.data(), distance.data() + distance.size()}),
                rounding, std::numeric_limits<double>::min()});
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::vector<Eigen::Index> others = around(i, n);
    for (Eigen::Index c = 0; c < samples.rows(); ++c) {
      const auto median_of = [&](const Eigen::MatrixXd& amounts) {
        const Eigen::VectorXd these = amounts(c, others).transpose();
        return median({these.begin(), these.end()});
      };
      const double near = median_of(distance);
      const bool moves = near < kShareOfStep * median_of(step);
      result[i] = std::max(
          result[i], distance(c, i) / (moves ? std::max(of_all, kMadToSigma * near) : of_all));
    }
  }
  return result;
}

/// Returns the lambda whose path has half a degree of freedom per sample. The path bends within a
/// sample or two, so that a curved end or a kink of the motion is not taken for an outlier.
double local_smoothing(const std::vector<double>& time_s, const Eigen::VectorXd& variance) {
  const System system = make_system(time_s, variance);
  const double unit = system.r.row(0).sum() / system.qwq.row(0).sum();
  double low = -6, high = 12;  // decades; the degrees of freedom fall from n to 2
  while (high - low > 0.01) {
    const double middle = (low + high) / 2;
    const Band factors = factorise(system.r + unit * std::pow(10.0, middle) * system.qwq);
    const bool too_free = degrees_of_freedom(system, inverse_band(factors)) >
                          0.5 * static_cast<double>(variance.size());
    (too_free ? low : high) = middle;
  }
  return unit * std::pow(10.0, (low + high) / 2);
}

/// Finds the samples that lie off the path on which their neighbours agree. With lambda fixed,
/// Huber's cost is convex, and an outlier pulls its path by a bounded amount however far off it is.
/// It may pull the path away from other samples; these are taken back once it is left out. No
/// samples are left out afterwards, so that one mistake does not lead to the next.
std::vector<bool> find_outliers(const std::vector<double>& time_s, const Eigen::MatrixXd& samples,
                                const Eigen::VectorXd& variance, double reject_beyond) {
  const Eigen::Index n = samples.cols();
  std::vector<bool> outlier(time_s.size(), false);
  if (n < kFewestForOutliers) return outlier;
  const double lambda = local_smoothing(time_s, variance);

  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  Eigen::VectorXd distance;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Weighted fit = fit_weighted(time_s, samples, variance.cwiseQuotient(weight), lambda);
    distance = robust_distances(fit.spline, fit.freedom, time_s, samples, variance);
    const Eigen::VectorXd before = weight;
    weight = kHuber / distance.array().max(kHuber);
    if ((weight - before).cwiseAbs().maxCoeff() < 0.01) break;
  }
  for (size_t k = 0; k < outlier.size(); ++k)
    outlier[k] = distance(static_cast<Eigen::Index>(k)) > reject_beyond;

  for (bool changed = true; changed;) {
    const auto [used_time_s, used] = used_samples(time_s, outlier);
    const Weighted fit =
        fit_weighted(used_time_s, samples(Eigen::all, used), variance(used), lambda);
    // A sample left out is off by its own noise and by the path's, about as large in a gap.
    Eigen::VectorXd freedom = Eigen::VectorXd::Constant(n, 2);
    freedom(used) = fit.freedom;
    distance = robust_distances(fit.spline, freedom, time_s, samples, variance);
    changed = false;
    for (size_t k = 0; k < outlier.size(); ++k) {
      if (outlier[k] && distance(static_cast<Eigen::Index>(k)) <= reject_beyond) {
        outlier[k] = false;
        changed = true;
      }
    }
  }
  return outlier;
}

/// Returns value, slope and second derivative at a time.
std::array<Eigen::VectorXd, 3> evaluate(const SmoothingSpline& spline, double time) {
  assert(!spline.time_s.empty());
  const Eigen::Index d = spline.value.rows(), n = spline.value.cols();
  if (n == 1) return {spline.value.col(0), Eigen::VectorXd::Zero(d), Eigen::VectorXd::Zero(d)};
  const double inside = std::clamp(time, spline.time_s.front(), spline.time_s.back());
  const auto after = std::upper_bound(spline.time_s.begin(), spline.time_s.end() - 1, inside);
  const auto k = std::clamp<Eigen::Index>(after - spline.time_s.begin() - 1, 0, n - 2);
  const double start = spline.time_s[static_cast<size_t>(k)];
  const double h = spline.time_s[static_cast<size_t>(k) + 1] - start;
  const double u = (inside - start) / h, v = 1 - u;
  const auto f0 = spline.value.col(k), f1 = spline.value.col(k + 1);
  const auto m0 = spline.second_derivative.col(k), m1 = spline.second_derivative.col(k + 1);

  const Eigen::VectorXd slope =
      (f1 - f0) / h + h / 6 * ((3 * u * u - 1) * m1 - (3 * v * v - 1) * m0);
  const Eigen::VectorXd value = v * f0 + u * f1 +
                                h * h / 6 * ((v * v * v - v) * m0 + (u * u * u - u) * m1) +
                                (time - inside) * slope;
  return {value, slope,
          time == inside ? Eigen::VectorXd(v * m0 + u * m1) : Eigen::VectorXd::Zero(d)};
}

}  // namespace

bool SmoothingSplineOptions::valid() const {
  return (!smoothing || (*smoothing > 0 && std::isfinite(*smoothing))) && reject_beyond > 0;
}

SmoothingSpline fit_smoothing_spline(const std::vector<double>& time_s,
                                     const Eigen::MatrixXd& samples,
                                     const std::vector<double>& sigma,
                                     const SmoothingSplineOptions& options) {
  assert(options.valid());
  const Eigen::Index n = samples.cols();
  assert(n >= 1 && time_s.size() == static_cast<size_t>(n));
  assert(sigma.empty() || sigma.size() == time_s.size());
  assert(samples.allFinite());
  assert(std::adjacent_find(time_s.begin(), time_s.end(), std::greater_equal<>()) == time_s.end());

  Eigen::VectorXd variance = Eigen::VectorXd::Ones(n);
  if (!sigma.empty()) {
    variance = Eigen::Map<const Eigen::VectorXd>(sigma.data(), n).array().square();
    assert(variance.minCoeff() > 0);
  }
  std::vector<bool> outlier(time_s.size(), false);
  if (options.robust) outlier = find_outliers(time_s, samples, variance, options.reject_beyond);
  const auto [used_time_s, used] = used_samples(time_s, outlier);
  SmoothingSpline spline =
      fit_weighted(used_time_s, samples(Eigen::all, used), variance(used), options.smoothing)
          .spline;
  spline.outlier = outlier;
  return spline;
}

Eigen::VectorXd SmoothingSpline::position(double time) const {
  return evaluate(*this, time)[0];
}
Eigen::VectorXd SmoothingSpline::velocity(double time) const {
  return evaluate(*this, time)[1];
}
Eigen::VectorXd SmoothingSpline::acceleration(double time) const {
  return evaluate(*this, time)[2];
}

}  // namespace clothfit
