#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace clothfit {

/// Options of a smooth path through a noisy track. It is the natural cubic spline f with knots at
/// the samples that minimises
///
///   sum_i |y_i - f(t_i)|^2 / sigma_i^2  +  lambda * integral |f''(t)|^2 dt
///
/// It is found in O(n) by Reinsch's banded system [reinsch1967]; leverages and degrees of freedom
/// follow from the central bands of its inverse [hutchinson1985].
///
/// lambda is chosen by generalised cross-validation in its cautious form: it minimises
///
///   sum_i |y_i - f(t_i)|^2 / sigma_i^2  /  (n - 1.4 * degrees of freedom)^2   [kim2004].
///
/// The plain score (1 in place of 1.4) has a flat minimum and now and then takes the noise itself
/// for motion. Restricted maximum likelihood, the other usual choice, takes f'' for white noise;
/// the motion of cloth is much smoother. On a swing of 60 samples it spends 37 degrees of freedom
/// where 14 do, and puts the noise 18 % too low.
///
/// Outliers are found with a path of its own, which bends within a sample or two. It is fitted with
/// iterated Huber weights, so that it takes neither an outlier for motion nor a kink for an
/// outlier. Samples beyond `reject_beyond` robust standard deviations of it are left out. The
/// deviations are those of all samples. Where the track moves from sample to sample by much more
/// than its distance from that path, they are those of the dozen around. So motion that begins
/// after a rest, sampled slowly, is no row of outliers. The smoothing spline is fitted to the rest
/// with full weights, so that its noise and degrees of freedom mean what they say.
struct SmoothingSplineOptions {
  std::optional<double> smoothing =
      std::nullopt;            ///< lambda, > 0; chosen from the data when absent
  bool robust = true;          ///< look for outliers; at least 8 samples are needed for that
  double reject_beyond = 4.5;  ///< > 0; of normal noise, 1 in 150 000 lies beyond 4.5
  bool valid() const;
};

/// A smoothed track with d coordinates. Straight beyond its ends.
struct SmoothingSpline {
  std::vector<double> time_s;         ///< knots: times of the samples used, rising
  Eigen::MatrixXd value;              ///< d x knots
  Eigen::MatrixXd second_derivative;  ///< d x knots, 0 at both ends

  double smoothing = 0;           ///< lambda as used
  double degrees_of_freedom = 0;  ///< per coordinate: trace of the map from samples to values
  /// Standard deviation of a sample's noise per coordinate, estimated from the residuals. Where
  /// sigmas are given, it is the factor by which to multiply these. NaN when fewer than three
  /// samples are used, which leave nothing to estimate it from.
  double noise_sigma = 0;
  std::vector<double> value_sigma;  ///< for each knot's value, per coordinate; from noise_sigma
  std::vector<bool> outlier;        ///< per sample given: left out

  Eigen::VectorXd position(double time) const;
  Eigen::VectorXd velocity(double time) const;
  Eigen::VectorXd acceleration(double time) const;
};

/// Smooths `samples` (d x n, n >= 1) taken at `time_s` (n, strictly rising). `sigma` gives each
/// sample's standard deviation (> 0) up to a common factor; empty means all alike. All coordinates
/// share one lambda and one noise. A sample is an outlier when any of its coordinates is. One
/// sample gives a constant, two the straight line.
SmoothingSpline fit_smoothing_spline(const std::vector<double>& time_s,
                                     const Eigen::MatrixXd& samples,
                                     const std::vector<double>& sigma = {},
                                     const SmoothingSplineOptions& options = {});

}  // namespace clothfit
