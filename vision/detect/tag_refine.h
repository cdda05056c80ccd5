#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "vision/detect/tag_evidence.h"
#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// A tag's four corners as the whole printed pattern places them.
struct RefinedTag {
  bool usable = false;  ///< false: the fit did not converge; corners then mean nothing
  std::array<Eigen::Vector2d, 4> corner_px{};  ///< order and pixels as in TagDetection
  std::array<double, 4> sigma_px{};            ///< one standard deviation per coordinate
  /// Mean robust weight of the pixels; about 0.9 where the pattern and noise explain all of them.
  double explained = 0;
  double contrast_levels = 0;  ///< white above black
  double black_levels = 0;
  double noise_levels = 0;  ///< of flat places, one standard deviation
  double roughness_px = 0;  ///< by which edges are off, one standard deviation
  double lens_px = 0;       ///< blur of the lens, one standard deviation
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();  ///< blur of motion; its sign means nothing
  TagEvidence evidence;  ///< cells and corners, whether usable or not
};

/// What the tags around one say of its picture. Of a tag that is half hidden, the
/// picture itself cannot tell it: noise is a median, and the hand's tone may pass for the light.
struct ExpectedPicture {
  double black_levels = 0;
  double contrast_levels = 0;    ///< white above black; right to 15 %
  double most_noise_levels = 0;  ///< bound of the standard deviation of flat places
  double most_roughness_px = 0;  ///< bound of that of edges
};

/// What is known of a tag before it is refined.
struct RefineHints {
  std::optional<double> lens_px;  ///< where tags around it or the picture before tell it
  std::optional<Eigen::Vector2d>
      motion_px;  ///< while the shutter is open, where tags around it tell it
  std::optional<ExpectedPicture> picture;
  /// The start is near the end: there is one, with few steps. What fails is sought in another way.
  bool quick = false;
};

/// Places a printed tag on a picture by least squares on the grey levels of all its pixels. The map
/// to the picture is smoothly bent. Fitting straight lines to the border instead is biased where
/// cloth bends, and uses a fraction of the tag's edges.
///
///   grey(p) = a(q) + c(q) T(q'),   q = homography^-1(p),   q' = q + d(q)
///
/// T is the pattern under the blur of the picture: a round lens and motion along a line, which are
/// estimated too, and may differ a little over the tag. a and c are linear (light). d holds all
/// polynomials up to degree 3 with a normal prior: place, size and shear nearly free, the higher
/// degrees small. Noise grows with the slope of the picture, as ragged edges make it; both parts
/// are estimated. Pixels that the pattern does not explain (something in front, a fold) lose their
/// weight (Cauchy loss). A hidden corner is therefore placed by the rest of the tag, with the sigma
/// that this implies; `evidence` says that it is hidden.
///
/// It starts from the blur that is known. Where it does not converge it starts from a sharp
/// picture, and where no blur is known from motion in several directions. Sigma is described at
/// corner_places.
///
/// `pixel_from_tag` maps tag coordinates to pixels (pixel (0, 0) is the centre of the top left one)
/// and must be right to a third of a cell.
RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag, const RefineHints& hints = {});

/// Moves a homography that is right to a cell onto the tag: the pattern is fitted to a picture
/// smoothed by a third of a cell. Returns nothing where that does not converge.
std::optional<Eigen::Matrix3d> align_tag(const cv::Mat& grey, const TagPattern& pattern,
                                         const Eigen::Matrix3d& pixel_from_tag,
                                         const std::optional<ExpectedPicture>& expected = {});

/// Says whether corners, in the order of TagDetection, are those of a tag seen from its front and
/// not edge on: convex, and with 0.15 of the area that its longest side would have head on.
bool shows_front(const std::array<Eigen::Vector2d, 4>& corner_px);

/// Returns the homography from tag coordinates to four corners, in the order of TagDetection.
Eigen::Matrix3d homography_to(const std::array<Eigen::Vector2d, 4>& corner_px);

}  // namespace clothfit
