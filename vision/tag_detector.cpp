#include "vision/tag_detector.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <map>
#include <tuple>

#include "data/input_error.h"
#include "vision/tag_refine.h"

namespace clothfit {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr std::array kFamilies = {
    // alphabetical
    Family{"tag16h5", tag16h5_create, tag16h5_destroy},
    Family{"tag25h9", tag25h9_create, tag25h9_destroy},
    Family{"tag36h10", tag36h10_create, tag36h10_destroy},
    Family{"tag36h11", tag36h11_create, tag36h11_destroy},
    Family{"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    Family{"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy},
    Family{"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
    Family{"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    Family{"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
};

const Family& find_family(const std::string& name) {
  const auto found = std::find_if(kFamilies.begin(), kFamilies.end(),
                                  [&](const Family& family) { return name == family.name; });
  if (found == kFamilies.end()) {
    throw InputError("markers", fmt::format("unknown tag family '{}'", name),
                     fmt::format("one of {}", fmt::join(tag_families(), ", ")));
  }
  return *found;
}

/// The library keeps a table of every code with every correctable error, 16 bytes or more an entry.
/// Bits that may be corrected before that table outgrows a few million entries.
int affordable_corrected_bits(const apriltag_family_t& family) {
  constexpr double kMaxEntries = 4e6;
  const double codes = family.ncodes;
  const double bits = family.nbits;
  if (codes * (1 + bits + bits * (bits - 1) / 2) <= kMaxEntries) return 2;
  return codes * (1 + bits) <= kMaxEntries ? 1 : 0;
}

/// What AprilTag's pixel coordinates have too much: it counts from the outer corner of the top left
/// pixel, we from that pixel's centre. Its corners already come in our order.
const Eigen::Vector2d kHalfPixel(0.5, 0.5);

/// The library's homography with pixels in our convention.
Eigen::Matrix3d pixel_from_tag(const matd_t& homography) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity();
  shift.topRightCorner<2, 1>() = -kHalfPixel;
  return shift * Eigen::Map<const RowMajor>(homography.data);
}

TagPattern printed_pattern(apriltag_family_t* family, int id) {
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> image(apriltag_to_image(family, id),
                                                                 image_u8_destroy);
  TagPattern pattern{
      .border_cells = family->width_at_border, .total_cells = family->total_width, .white = {}};
  assert(image->width == pattern.total_cells && image->height == pattern.total_cells);
  for (int row = 0; row < image->height; ++row) {
    for (int column = 0; column < image->width; ++column) {
      pattern.white.push_back(image->buf[row * image->stride + column] > 127 ? 1.0F : 0.0F);
    }
  }
  return pattern;
}

/// A code with b wrong bits is still twice as near to its own word as to any other while
/// 3 b < distance; a quarter of the distance leaves room for what is no tag at all.
int safe_corrected_bits(const apriltag_family_t& family) {
  return (static_cast<int>(family.h) - 1) / 4;
}

}  // namespace

std::vector<std::string> tag_families() {
  std::vector<std::string> names;
  for (const Family& family : kFamilies) names.emplace_back(family.name);
  return names;
}

struct TagDetector::Library {
  explicit Library(const Family& kind)
      : family(kind.create(), kind.destroy),
        detector(apriltag_detector_create(), apriltag_detector_destroy) {}

  const TagPattern& pattern(int id) {
    const auto known = patterns.find(id);
    if (known != patterns.end()) return known->second;
    return patterns.emplace(id, printed_pattern(family.get(), id)).first->second;
  }

  // The detector is destroyed first: it holds a pointer into the family.
  std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector;
  std::map<int, TagPattern> patterns;  ///< of the tags seen so far
};

TagDetector::TagDetector(const std::string& family, int max_corrected_bits)
    : library_(std::make_unique<Library>(find_family(family))) {
  const apriltag_family_t& kind = *library_->family;
  const int bits =
      std::min({max_corrected_bits, safe_corrected_bits(kind), affordable_corrected_bits(kind)});
  apriltag_detector_add_family_bits(library_->detector.get(), library_->family.get(), bits);
  library_->detector->nthreads = 1;  // pictures are what runs in parallel
  library_->detector->quad_decimate = 1;
  library_->detector->refine_edges = true;
}

TagDetector::~TagDetector() = default;
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;

std::vector<TagDetection> TagDetector::detect(const cv::Mat& grey) {
  assert(grey.type() == CV_8UC1 && !grey.empty());
  image_u8_t picture{.width = grey.cols,
                     .height = grey.rows,
                     .stride = static_cast<int32_t>(grey.step),
                     .buf = grey.data};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(
      apriltag_detector_detect(library_->detector.get(), &picture), apriltag_detections_destroy);

  std::vector<TagDetection> detections;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* raw = nullptr;
    zarray_get(found.get(), i, &raw);
    TagDetection detection;
    detection.id = raw->id;
    detection.corrected_bits = raw->hamming;
    detection.decision_margin = raw->decision_margin;
    for (std::size_t c = 0; c < 4; ++c) {
      detection.corner_px[c] = Eigen::Vector2d(raw->p[c][0], raw->p[c][1]) - kHalfPixel;
    }
    const RefinedTag refined =
        refine_tag(grey, library_->pattern(raw->id), pixel_from_tag(*raw->H));
    detection.explained = refined.explained;
    detection.refined = refined.usable;
    if (refined.usable) {
      detection.corner_px = refined.corner_px;
      detection.sigma_px = refined.sigma_px;
    }
    detections.push_back(detection);
  }
  std::sort(detections.begin(), detections.end(), [](const TagDetection& a, const TagDetection& b) {
    const auto key = [](const TagDetection& d) {
      return std::tuple(d.id, d.corner_px[0].x(), d.corner_px[0].y());
    };
    return key(a) < key(b);
  });
  return detections;
}

}  // namespace clothfit
