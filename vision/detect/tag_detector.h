#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vision/detect/tag_refine.h"

namespace clothfit {

/// A tag as one picture shows it, in this program's conventions. Pixel (0, 0) is the centre of the
/// top left pixel. Corners are those of the tag's border, 0 bottom left, 1 bottom right, 2 top
/// right, 3 top left as the printed tag is seen upright.
struct TagDetection {
  int id = 0;
  int corrected_bits = 0;      ///< bits of the code that were read wrong
  double decision_margin = 0;  ///< mean distance of a bit's grey level from the threshold; half
                               ///< the contrast of tags that are predicted or in a copy only
  std::array<Eigen::Vector2d, 4> corner_px{};
  std::array<double, 4> sigma_px{};  ///< one standard deviation per coordinate
  /// Corners are placed by the whole pattern (tag_refine.h); else by its outline, with a wide
  /// sigma.
  bool refined = false;
  double explained = 0;  ///< share of the tag's pixels that its pattern explains; about 0.9 is all
  double contrast_levels = 0;  ///< white above black, grey levels; 0 where it is not known
  double black_levels = 0;
  double noise_levels = 0;  ///< of flat places, one standard deviation
  double roughness_px = 0;  ///< by which printed edges are off, one standard deviation
  double lens_px = 0;       ///< blur of the lens, one standard deviation
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();  ///< blur of motion; its sign means nothing
  /// The printed cells are there, and so are border and white around them (TagEvidence).
  bool shows_tag = false;
  /// How well each corner is seen (TagEvidence); 0 also where the tags around contradict it.
  std::array<double, 4> corner_seen{};
  bool predicted = false;  ///< it was looked for where a prediction had it
};

/// A tag that should be somewhere: its place by its neighbours, or by the pictures before.
struct PredictedTag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corner_px{};  ///< right to a cell
  bool close = false;                          ///< right to a third of a cell, most likely
  std::optional<double> lens_px;               ///< blur of the lens, where it is known
  std::optional<Eigen::Vector2d> motion_px;    ///< while the shutter is open, where it is known
  std::optional<ExpectedPicture> picture;      ///< by tags around it, or by itself before
};

/// Reads the tags of one family in pictures. Each thread needs its own detector.
class TagDetector {
 public:
  /// `max_corrected_bits` is at most 2. Families correct fewer where their codes lie close
  /// together, and large ones to save memory. Throws InputError for an unknown family and lists the
  /// known ones.
  explicit TagDetector(const std::string& family, int max_corrected_bits = 2);
  ~TagDetector();
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;

  /// Finds tags in an 8-bit grey picture, sorted by id, then by place. Sharpened copies of it are
  /// searched too (sharpened_copy.h), which takes 0.4 to 1 times as long again. Tags that only
  /// they suggest are listed where the cells of the picture itself confirm them.
  std::vector<TagDetection> detect(const cv::Mat& grey);

  /// Reads tags where they are predicted: their cells are read again there, and what does not show
  /// them is left out, so that no prediction becomes a place by itself. Parts of a tag may be
  /// hidden. The cells must speak against each of the `rivals`, tags that may be there instead. In
  /// the order of `predicted`.
  std::vector<TagDetection> read_predicted(const cv::Mat& grey,
                                           std::span<const PredictedTag> predicted,
                                           std::span<const int> rivals = {});

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace clothfit
