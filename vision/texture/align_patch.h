#pragma once

#include <Eigen/Core>

#include "vision/texture/patch_warp.h"
#include "vision/texture/texture_patch.h"

namespace clothfit {

struct AlignOptions {
  int most_iterations = 20;
  double step_px = 0.002;  ///< a step that moves no sample further ends the iteration
  /// Standard deviations of the priors, at the patch's rim. The linear part of the warp is drawn to
  /// its start and bending to none, in radii; the slope of the light to none, as a share.
  double linear_prior = 0.1, second_prior = 0.05, light_prior = 0.2;
  double blur_prior_px2 = 0.5;  ///< of the blur's covariance beyond the first picture's
  double least_levels = 0.4;    ///< residuals are never taken for smaller; what 8 bits leave
};

enum class AlignEnd {
  converged,
  outside,    ///< too little of the patch lies in the picture
  collapsed,  ///< the warp's area vanishes or turns over
  unsettled   ///< no minimum in the iterations, or no texture to find one by
};

/// A patch as it lies in another picture.
struct PatchFit {
  AlignEnd end = AlignEnd::unsettled;
  PatchWarp warp;
  double gain = 0;             ///< contrast over that of the first picture
  double level = 0;            ///< mean grey level
  double explained = 0;        ///< share of the variance of levels that the patch explains, <= 1
  double kept = 0;             ///< mean robust weight
  double kept_in_middle = 0;   ///< the same within a third of the radius
  double residual_levels = 0;  ///< standard deviation of residuals times their robust weights
  /// Per sample: its residual times its robust weight, in `residual_levels`; and how far the place
  /// moves per grey level of that.
  Eigen::VectorXf residual;
  Eigen::MatrixX2f influence;

  bool converged() const { return end == AlignEnd::converged; }
};

/// Aligns a patch of the first picture with another picture. It minimises
///
///   sum weight rho(I(W(d)) - gain (T(d) - mean) - light . d T(d) - blur : D T(d) - level)
///
/// over the warp W, gain, level, the slope of the light and the blur, by Gauss-Newton with the
/// picture's own slopes [lucas1981, baker2004]; rho is Cauchy's at three robust standard
/// deviations, so that what lies in front loses its weight. Light that varies multiplies the print,
/// whence the slope's form. D T are half the second derivatives, by which a print blurs to first
/// order: motion blurs it, and so do the lens and the pixels where it is seen from aside. Errors do
/// not add up over pictures, since T is always the first picture's.
PatchFit align_patch(const SmoothPicture& picture, const TexturePatch& patch,
                     const PatchWarp& start, const AlignOptions& options = {});

namespace align {

inline constexpr int kUnknowns = 19;
/// Place (2), linear part by column (4), second part by column (6), gain, slope of light (2),
/// level, gain times blur (3). Those of the warp are px at the rim.
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

struct Linearised {
  Eigen::VectorXf residual;  ///< grey levels; 0 beyond the picture
  Eigen::Matrix<float, Eigen::Dynamic, kUnknowns> jacobian;
  Eigen::VectorXf weight;  ///< of the patch; 0 beyond the picture
};

Unknowns to_unknowns(const PatchWarp& warp, double radius_px);
PatchWarp to_warp(const Unknowns& unknowns, double radius_px);

/// Gives residuals and their derivatives by the unknowns.
Linearised linearise(const SmoothPicture& picture, const TexturePatch& patch,
                     const Unknowns& unknowns);

}  // namespace align

}  // namespace clothfit
