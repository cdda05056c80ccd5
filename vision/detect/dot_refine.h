#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit {

/// A dot's outline: the points c + A u with |u| = 1, whose `shape_px2` is A A^T. For a circle it is
/// the squared radius times the identity.
struct DotOutline {
  Eigen::Vector2d centre_px =
      Eigen::Vector2d::Zero();  ///< pixel (0, 0): centre of the top left one
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();  ///< symmetric, positive definite

  /// Semi-axes, the smaller first.
  Eigen::Vector2d radii_px() const;
  /// Area of the ellipse.
  double area_px2() const;
};

/// Why a dot's place is doubted.
enum class DotDoubt {
  none,
  border,      ///< it reaches over the picture's border
  not_a_disc,  ///< the model does not explain the pixels: cut, covered or something else
  faint,       ///< contrast is too small against the noise
  blurred,     ///< its blur is as wide as the dot
  unsettled    ///< the fit did not converge
};

/// A dot as one picture shows it.
struct Dot {
  DotOutline outline;
  DotDoubt doubt = DotDoubt::unsettled;
  /// Of the centre, px^2: the posterior's. It takes pixels' errors for independent
  /// (`scale_covariances` in vision/detect/dot_detector.h).
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d blur_px2 = Eigen::Matrix2d::Zero();  ///< covariance of the blur
  double blur_px = 0;                                  ///< root of its mean variance per direction
  double paper_levels = 0;                             ///< grey level around it
  double contrast = 0;      ///< share of the paper's light that the dot lacks; negative: bright dot
  double explained = 0;     ///< mean robust weight of its pixels; about 0.9 is all
  double noise_levels = 0;  ///< standard deviation of a pixel where the picture is flat
  double misfit = 0;        ///< rms residual of its pixels over the step from paper to dot

  double waves_px = 0;  ///< size of the outline's waves with 3 to 5 periods; 0: an ellipse
  /// Half the square of the waves with 3, 4 and 5 periods over their variance if pixels err
  /// independently.
  std::array<double, 3> waves_chi2{};
  int steps = 0;  ///< of the fit

  bool good() const { return doubt == DotDoubt::none; }
  /// One standard deviation per coordinate.
  double sigma_px() const;
};

/// What the fit starts from beside the outline.
struct DotStart {
  DotOutline outline;  ///< right to half a radius
  double blur_px = 0.8;
};

/// Places a dot by least squares on the grey levels around it. The model is an elliptic disc under
/// a Gaussian, in light that varies linearly:
///
///   grey(p) = a(p) (1 - k T(p)),   T = Phi(-d / s),   d = (sqrt(|q|^2 + t^2) - 1) / |grad |q||
///
/// q = A^-1 (p - c) takes the outline to the unit circle; d is the distance from the outline to
/// first order. t is the blur across the line of sight in units of q: it moves the half level
/// inwards on a small disc, as a Gaussian does. Unknown are c, A A^T, s, k and the three of a. The
/// model is even about c, as is every blur by a lens in focus or by steady motion, so that neither
/// biases c. Noise grows with the slope of the picture and the loss is Cauchy's, as in
/// vision/detect/tag_refine.h.
///
/// c is where the centre of the outline lies. That is not the place of the printed centre where the
/// map from cloth to picture bends within the dot (vision/track/dot_bend.h).
Dot refine_dot(const cv::Mat& grey, const DotStart& start);

/// Moves an outline to the middle of what is darker (brighter) than half way around it. It stays
/// where it is if that lies 1.5 radii away.
void centre_on_dark(const cv::Mat& grey, double half_level, bool bright, DotOutline& outline);

}  // namespace clothfit
