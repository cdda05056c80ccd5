#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "vision/texture/align_patch.h"
#include "vision/texture/texture_layout.h"

namespace clothfit {

/// Why a marker of a textured sheet is not found in a picture.
namespace texture_missing {
inline constexpr const char* kHidden = "hidden";    ///< the cloth turns away there or folds over it
inline constexpr const char* kCovered = "covered";  ///< the picture shows something else there
inline constexpr const char* kOutside = "outside";  ///< beyond the picture's border, or across it
inline constexpr const char* kBlurred = "blurred";  ///< only its coarse shades are seen
inline constexpr const char* kDark = "dark";        ///< too little light to tell its texture
inline constexpr const char* kPlain = "plain";  ///< the first picture shows no texture around it
inline constexpr const char* kUnplaced = "unplaced";  ///< no neighbour says where it would be
}  // namespace texture_missing

struct TextureTrackOptions {
  AlignOptions align;
  double fine_blur_px = 0.7;    ///< > 0; of the pictures that places are read from
  double coarse_blur_px = 2.5;  ///< > 0; of those that lead there from further away
  /// Patches have this share of the distance to the next markers as radius, within these bounds.
  /// Larger ones average over more texture, and bend more.
  double radius_share = 0.62;
  double least_radius_px = 9, most_radius_px = 24;
  double least_explained = 0.5;  ///< 0 to 1; share of a patch's variance that must be explained
  /// A patch is left out as covered in part if it keeps less than this share of the weight that is
  /// usual in the picture, or has residuals this many times as large as usual, or lies aside of
  /// where its neighbours lead by this many times the usual and that many times their spread, and
  /// by a pixel. A higher share and lower ratios drop more good ones.
  double cut_kept = 0.88, cut_residual = 2.2, cut_aside = 8, cut_spread = 2;
  void validate() const;  ///< throws InputError
};

/// A marker of the sheet in one picture.
struct TextureRow {
  int marker = 0;  ///< index into the markers
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< one standard deviation per coordinate
};

/// What one picture shows of a textured sheet.
struct TextureFrame {
  std::vector<TextureRow> rows;                      ///< sorted by marker
  std::vector<std::pair<int, const char*>> missing;  ///< marker and reason, sorted by marker
};

/// Follows the markers of a textured sheet through the pictures of one camera, which come in order.
///
/// Optical flow from the picture before leads to a start; the place comes from aligning the patch
/// of the first picture (align_patch.h), so that errors do not add up. Markers that are lost are
/// sought where their neighbours expect them, and all must lie where these do. Patches are aligned
/// in parallel; the result does not depend on the number of threads.
class TextureTracker {
 public:
  /// `first` is the picture, 8-bit grey, in which the layout's places lie.
  TextureTracker(const TextureLayout& layout, const cv::Mat& first,
                 const TextureTrackOptions& options = {});
  ~TextureTracker();
  TextureTracker(TextureTracker&&) noexcept;
  TextureTracker& operator=(TextureTracker&&) noexcept;

  /// Returns the first picture's markers, where the layout has them. Sigma is no less than what the
  /// texture lets a place be known to.
  TextureFrame first() const;
  /// Takes the next picture, 8-bit grey, of the first one's size.
  TextureFrame next(const cv::Mat& grey);

 private:
  class Follower;
  std::unique_ptr<Follower> follower_;
};

}  // namespace clothfit
