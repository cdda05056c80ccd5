#include "vision/detect/tag_detector.h"

#include <apriltag/apriltag.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <map>
#include <tuple>

#include "data/parallel.h"
#include "vision/detect/sharpened_copy.h"
#include "vision/detect/tag_family.h"
#include "vision/detect/tag_refine.h"

namespace clothfit {
namespace {

/// Returns how many bits may be corrected before the library's table outgrows a few million
/// entries. The table holds every code with every correctable error, 16 bytes or more an entry.
int affordable_corrected_bits(const apriltag_family_t& family) {
  constexpr double kMaxEntries = 4e6;
  const double codes = family.ncodes;
  const double bits = family.nbits;
  if (codes * (1 + bits + bits * (bits - 1) / 2) <= kMaxEntries) return 2;
  return codes * (1 + bits) <= kMaxEntries ? 1 : 0;
}

/// Offset of AprilTag's pixel coordinates from ours. AprilTag counts from the outer corner of the
/// top left pixel, we from that pixel's centre. Its corners already come in our order.
const Eigen::Vector2d kHalfPixel(0.5, 0.5);

/// Returns the library's homography with pixels of the picture in our convention.
Eigen::Matrix3d pixel_from_tag(const matd_t& homography, const Eigen::Vector2d& pixels_across) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Eigen::Matrix3d picture_from_copy = Eigen::Matrix3d::Identity();
  picture_from_copy.diagonal().head<2>() = pixels_across.cwiseInverse();
  picture_from_copy.topRightCorner<2, 1>() = -kHalfPixel;
  return picture_from_copy * Eigen::Map<const RowMajor>(homography.data);
}

/// Returns how many wrong bits may be corrected safely: a quarter of the codes' distance. A code
/// with b wrong bits is twice as near to its own word as to any other while 3 b < distance; a
/// quarter leaves room for pictures of no tag at all.
int safe_corrected_bits(const apriltag_family_t& family) {
  return (static_cast<int>(family.h) - 1) / 4;
}

/// Returns the sigma of corners that the outline of a tag places. On drawn pictures, sharp and
/// under 6 px of motion, they are off by 0.2 to 0.3 px; where the pattern cannot be fitted it is
/// worse.
double outline_sigma_px(const std::array<Eigen::Vector2d, 4>& corner_px) {
  constexpr double kLeast_px = 0.5, kOfSide = 0.02;  // the latter for bent edges
  return std::max(kLeast_px, kOfSide * (corner_px[1] - corner_px[0]).norm());
}

/// Says whether the pattern was found where the outline is, to half a cell of eight and a pixel, by
/// the two corners that agree best: the border of the picture may spoil two of an outline.
bool agrees(const RefinedTag& refined, const std::array<Eigen::Vector2d, 4>& outline_px) {
  constexpr double kMostOfSide = 0.5 / 8;
  std::vector<double> apart;
  for (size_t c = 0; c < 4; ++c) apart.push_back((refined.corner_px[c] - outline_px[c]).norm());
  std::ranges::sort(apart);
  return apart[1] < kMostOfSide * (outline_px[1] - outline_px[0]).norm() + 1;
}

/// Notes what the refinement of a detection found, whose corners are those of the outline.
void note(const RefinedTag& refined, TagDetection& detection) {
  detection.explained = refined.explained;
  detection.contrast_levels = refined.contrast_levels;
  detection.black_levels = refined.black_levels;
  detection.noise_levels = refined.noise_levels;
  detection.roughness_px = refined.roughness_px;
  detection.lens_px = refined.lens_px;
  detection.motion_px = refined.motion_px;
  // Bits that the library corrected are doubted where the fit finds more wrong cells than these:
  // that is how tags of another border come through.
  detection.shows_tag =
      refined.evidence.shows_tag() &&
      (detection.corrected_bits == 0 || refined.evidence.wrong_cells <= detection.corrected_bits);
  detection.corner_seen = refined.evidence.corner_seen;
  detection.sigma_px.fill(outline_sigma_px(detection.corner_px));
  detection.refined = refined.usable;
  if (!refined.usable) {
    // Nothing but the code tells such a tag from one of another border.
    detection.shows_tag = detection.shows_tag && detection.corrected_bits == 0;
    return;
  }
  detection.shows_tag = detection.shows_tag && agrees(refined, detection.corner_px);
  detection.corner_px = refined.corner_px;
  detection.sigma_px = refined.sigma_px;
}

/// A tag as the library finds it, before it is refined.
struct Outline {
  TagDetection tag;
  Eigen::Matrix3d pixel_from_tag;
  const TagPattern* pattern = nullptr;
  bool suggested = false;  ///< by a sharpened copy only
};

/// Says whether that tag is among the outlines, about where they have it.
bool holds(const std::vector<Outline>& outlines, const TagDetection& tag) {
  const auto middle = [](const TagDetection& one) {
    return Eigen::Vector2d((one.corner_px[0] + one.corner_px[2]) / 2);
  };
  return std::ranges::any_of(outlines, [&](const Outline& one) {
    const double diagonal_px = (one.tag.corner_px[0] - one.tag.corner_px[2]).norm();
    return one.tag.id == tag.id && (middle(one.tag) - middle(tag)).norm() < diagonal_px / 2;
  });
}

/// Says whether the picture shows the tag that a sharpened copy suggests. Of the blurred tags of
/// drawn recordings no cell was wrong and 0.92 were right, of photos' other prints 0.89.
bool confirms(const RefinedTag& refined, const TagDetection& tag) {
  constexpr double kLeastRight = 0.9;
  const TagEvidence& cells = refined.evidence;
  return tag.refined && tag.shows_tag && cells.wrong_cells == 0 &&
         cells.right_cells >= kLeastRight * cells.cells;
}

/// Refines an outline; nothing where the picture does not confirm what a copy suggests.
std::optional<TagDetection> refined_outline(const cv::Mat& grey, const Outline& outline) {
  const RefinedTag refined = refine_tag(grey, *outline.pattern, outline.pixel_from_tag);
  TagDetection tag = outline.tag;
  note(refined, tag);
  if (!outline.suggested) return tag;
  if (!confirms(refined, tag)) return {};
  tag.decision_margin = 0.5 * refined.contrast_levels;  // the copy's is larger than life
  return tag;
}

/// Says whether the refined cells speak for that tag and for no rival.
bool is_read(const RefinedTag& refined, const TagPattern& pattern,
             std::span<const TagPattern* const> rivals) {
  return refined.usable && refined.evidence.shows_tag() &&
         std::ranges::all_of(rivals, [&](const TagPattern* rival) {
           return rival == &pattern || speaks_for(refined.evidence, pattern, *rival);
         });
}

/// Refines a tag at its predicted place. Nothing is returned where it is not read there, or moves
/// further than a close prediction is off.
std::optional<RefinedTag> read_close(const cv::Mat& grey, const TagPattern& pattern,
                                     const PredictedTag& predicted, RefineHints hints,
                                     std::span<const TagPattern* const> rivals) {
  hints.quick = true;
  const RefinedTag refined = refine_tag(grey, pattern, homography_to(predicted.corner_px), hints);
  if (!is_read(refined, pattern, rivals) || !agrees(refined, predicted.corner_px)) return {};
  return refined;
}

/// Reads a tag where it is predicted, after moving the prediction onto it where it is not close.
std::optional<TagDetection> read_one(const cv::Mat& grey, const TagPattern& pattern,
                                     const PredictedTag& predicted,
                                     std::span<const TagPattern* const> rivals) {
  if (!shows_front(predicted.corner_px)) return {};
  const RefineHints hints{
      .lens_px = predicted.lens_px, .motion_px = predicted.motion_px, .picture = predicted.picture};
  std::optional<RefinedTag> refined;
  if (predicted.close) refined = read_close(grey, pattern, predicted, hints, rivals);
  if (!refined) {
    const auto aligned =
        align_tag(grey, pattern, homography_to(predicted.corner_px), predicted.picture);
    if (!aligned) return {};
    refined = refine_tag(grey, pattern, *aligned, hints);
    if (!is_read(*refined, pattern, rivals)) return {};
  }
  TagDetection tag{.id = predicted.id, .corner_px = refined->corner_px, .predicted = true};
  tag.decision_margin = 0.5 * refined->contrast_levels;
  note(*refined, tag);
  return tag;
}

/// Calls `read(i)` for 0 to `count` - 1, several at once. A thread that waits for the others takes
/// no other work up, since that may want the same detector.
template <class Read>
void for_each_tag(size_t count, const Read& read) {
  tbb::this_task_arena::isolate([&] { for_each_index(count, read); });
}

}  // namespace

struct TagDetector::Library {
  explicit Library(const std::string& name)
      : family(make_tag_family(name)),
        detector(apriltag_detector_create(), apriltag_detector_destroy) {}

  const TagPattern& pattern(int id) {
    const auto known = patterns.find(id);
    if (known != patterns.end()) return known->second;
    return patterns.emplace(id, printed_tag(*family, id)).first->second;
  }

  /// Finds the outlines of tags in a picture, or in a copy of it, by the order of the library.
  std::vector<Outline> find(const SharpenedCopy& copy, int least_contrast_levels);
  /// Finds the outlines of tags in a picture and in its sharpened copies.
  std::vector<Outline> find(const cv::Mat& grey);

  // The detector is destroyed first: it holds a pointer into the family.
  TagFamily family;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector;
  std::map<int, TagPattern> patterns;  ///< of the tags seen so far
};

std::vector<Outline> TagDetector::Library::find(const SharpenedCopy& copy,
                                                int least_contrast_levels) {
  detector->qtp.min_white_black_diff = least_contrast_levels;
  image_u8_t picture{.width = copy.grey.cols,
                     .height = copy.grey.rows,
                     .stride = static_cast<int32_t>(copy.grey.step),
                     .buf = copy.grey.data};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(
      apriltag_detector_detect(detector.get(), &picture), apriltag_detections_destroy);
  std::vector<Outline> outlines;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* raw = nullptr;
    zarray_get(found.get(), i, &raw);
    TagDetection tag;
    tag.id = raw->id;
    tag.corrected_bits = raw->hamming;
    tag.decision_margin = raw->decision_margin;
    for (size_t c = 0; c < 4; ++c)
      tag.corner_px[c] =
          Eigen::Vector2d(raw->p[c][0], raw->p[c][1]).cwiseQuotient(copy.pixels_across) -
          kHalfPixel;
    outlines.push_back({.tag = tag,
                        .pixel_from_tag = pixel_from_tag(*raw->H, copy.pixels_across),
                        .pattern = &pattern(raw->id)});
  }
  return outlines;
}

std::vector<Outline> TagDetector::Library::find(const cv::Mat& grey) {
  // What the library takes for flat. Edges of a sharpened copy are up to three times as high, and
  // so is noise: 5 there finds no more blurred tags and searches twice as long.
  constexpr int kLeastContrast_levels = 5, kLeastInCopy_levels = 20;
  std::vector<Outline> outlines =
      find({.grey = grey, .pixels_across = {1, 1}}, kLeastContrast_levels);
  // Codes as short as tag16h5's are read in any texture: of 160 photos without its tags one had a
  // suggestion confirmed.
  if (safe_corrected_bits(*family) < 2) return outlines;
  for (const SharpenedCopy& copy : sharpened_copies(grey))
    for (Outline& one : find(copy, kLeastInCopy_levels)) {
      if (holds(outlines, one.tag)) continue;
      one.suggested = true;
      outlines.push_back(one);
    }
  return outlines;
}

TagDetector::TagDetector(const std::string& family, int max_corrected_bits)
    : library_(std::make_unique<Library>(family)) {
  const apriltag_family_t& kind = *library_->family;
  const int bits =
      std::min({max_corrected_bits, safe_corrected_bits(kind), affordable_corrected_bits(kind)});
  apriltag_detector_add_family_bits(library_->detector.get(), library_->family.get(), bits);
  library_->detector->nthreads = 1;  // tags are what runs in parallel
  library_->detector->quad_decimate = 1;
  library_->detector->refine_edges = true;
}

TagDetector::~TagDetector() = default;
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;

std::vector<TagDetection> TagDetector::detect(const cv::Mat& grey) {
  assert(grey.type() == CV_8UC1 && !grey.empty());
  const std::vector<Outline> outlines = library_->find(grey);
  std::vector<std::optional<TagDetection>> refined(outlines.size());
  for_each_tag(outlines.size(), [&](size_t i) { refined[i] = refined_outline(grey, outlines[i]); });
  std::vector<TagDetection> detections;
  for (const std::optional<TagDetection>& one : refined)
    if (one) detections.push_back(*one);
  std::ranges::sort(detections, {}, [](const TagDetection& tag) {
    return std::tuple(tag.id, tag.corner_px[0].x(), tag.corner_px[0].y());
  });
  return detections;
}

std::vector<TagDetection> TagDetector::read_predicted(const cv::Mat& grey,
                                                      std::span<const PredictedTag> predicted,
                                                      std::span<const int> rivals) {
  assert(grey.type() == CV_8UC1 && !grey.empty());
  std::vector<const TagPattern*> patterns;
  for (const PredictedTag& one : predicted) patterns.push_back(&library_->pattern(one.id));
  std::vector<const TagPattern*> others;
  for (const int id : rivals) others.push_back(&library_->pattern(id));
  std::vector<std::optional<TagDetection>> read(predicted.size());
  for_each_tag(predicted.size(),
               [&](size_t i) { read[i] = read_one(grey, *patterns[i], predicted[i], others); });
  std::vector<TagDetection> detections;
  for (const std::optional<TagDetection>& one : read)
    if (one) detections.push_back(*one);
  return detections;
}

}  // namespace clothfit
