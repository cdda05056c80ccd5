#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace clothfit {

/// A tag as one picture shows it, in this program's conventions. Pixel (0, 0) is the centre of the
/// top left pixel. Corners are those of the tag's border, 0 bottom left, 1 bottom right, 2 top
/// right, 3 top left as the printed tag is seen upright.
struct TagDetection {
  int id = 0;
  int corrected_bits = 0;      ///< bits of the code that were read wrong
  double decision_margin = 0;  ///< mean distance of a bit's grey level from the threshold
  std::array<Eigen::Vector2d, 4> corner_px{};
  std::array<double, 4> sigma_px{};  ///< one standard deviation per coordinate; 0 if not `refined`
  bool refined = false;              ///< corners are placed by the whole pattern (tag_refine.h)
  double explained = 0;  ///< share of the tag's pixels that its pattern explains; about 0.9 is all
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

  /// Finds tags in an 8-bit grey picture, sorted by id, then by place.
  std::vector<TagDetection> detect(const cv::Mat& grey);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace clothfit
