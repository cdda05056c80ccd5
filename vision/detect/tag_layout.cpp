#include "vision/detect/tag_layout.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>

#include "data/median.h"

namespace clothfit {
namespace {

/// A corner that was read.
struct ReadCorner {
  Eigen::Vector2d place_m, pixel_px;
};

/// Lists the corners of the refined tags of a sheet that were read once, but one's.
std::vector<ReadCorner> read_corners(std::span<const TagDetection> tags, const TagLayout& layout,
                                     int but) {
  std::vector<ReadCorner> corners;
  std::map<int, int> times;
  for (const TagDetection& tag : tags) ++times[tag.id];
  for (const TagDetection& tag : tags) {
    const auto known = layout.find(tag.id);
    if (tag.id == but || times[tag.id] > 1 || known == layout.end()) continue;
    if (!tag.refined || !tag.shows_tag) continue;
    for (size_t c = 0; c < 4; ++c)
      corners.push_back({.place_m = known->second[c], .pixel_px = tag.corner_px[c]});
  }
  return corners;
}

/// Predicts one tag; false where too little is read around it.
bool predict(const std::array<Eigen::Vector2d, 4>& corners_m, const std::vector<ReadCorner>& read,
             std::array<Eigen::Vector2d, 4>& corner_px) {
  const Eigen::Vector2d middle = (corners_m[0] + corners_m[1] + corners_m[2] + corners_m[3]) / 4;
  const double side = (corners_m[1] - corners_m[0]).norm();
  constexpr int kTerms = 6;
  const auto terms = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector2d at = (place - middle) / side;
    return Eigen::Matrix<double, 1, kTerms>(1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(),
                                            at.y() * at.y());
  };
  constexpr double kReach = 2;       // tags, standard deviation of the weights
  constexpr double kNear = 3;        // tags
  constexpr int kLeastNear = 3 * 4;  // corners of three tags
  const auto near = std::ranges::count_if(read, [&](const ReadCorner& corner) {
    return (corner.place_m - middle).norm() < kNear * side;
  });
  if (near < kLeastNear) return false;
  const auto rows = static_cast<Eigen::Index>(read.size());
  Eigen::Matrix<double, Eigen::Dynamic, kTerms> equations(rows + kTerms, kTerms);
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(rows + kTerms, 2);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const ReadCorner& corner = read[static_cast<size_t>(row)];
    const double distance = (corner.place_m - middle).norm() / (kReach * side);
    const double weight = std::exp(-0.5 * distance * distance);
    equations.row(row) = weight * terms(corner.place_m);
    right.row(row) = weight * corner.pixel_px.transpose();
  }
  // Bending that nothing tells is small.
  constexpr double kStiff = 0.05;  // 1/px: bends of up to 20 px per tag^2 are likely
  equations.bottomRows<kTerms>().setZero();
  equations.bottomRightCorner<3, 3>() = kStiff * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, kTerms, 2> map = equations.colPivHouseholderQr().solve(right);
  for (size_t c = 0; c < 4; ++c) corner_px[c] = (terms(corners_m[c]) * map).transpose();
  return true;
}

/// Returns what the tags around a place say of the picture there: light by their mean, weighed by
/// distance^-4, noise by medians.
ExpectedPicture expected_picture(const std::vector<const TagDetection*>& tags,
                                 const TagLayout& layout, const Eigen::Vector2d& place_m) {
  ExpectedPicture expected;
  double weights = 0;
  std::vector<double> noise, roughness;
  for (const TagDetection* tag : tags) {
    const auto& corners_m = layout.at(tag->id);
    const double square = (corners_m[0] - place_m).squaredNorm();
    const double side = (corners_m[1] - corners_m[0]).squaredNorm();
    const double weight = 1 / (square * square + side * side);
    weights += weight;
    expected.black_levels += weight * tag->black_levels;
    expected.contrast_levels += weight * tag->contrast_levels;
    noise.push_back(tag->noise_levels);
    roughness.push_back(tag->roughness_px);
  }
  expected.black_levels /= weights;
  expected.contrast_levels /= weights;
  constexpr double kMore = 1.5, kLeast_px = 0.02;  // a tag may be somewhat noisier than most
  expected.most_noise_levels = kMore * median(std::move(noise));
  expected.most_roughness_px = kMore * median(std::move(roughness)) + kLeast_px;
  return expected;
}

/// Returns the tag that lies nearest; there is one.
const TagDetection& nearest(const std::vector<const TagDetection*>& tags, const TagLayout& layout,
                            const Eigen::Vector2d& place_m) {
  const auto distance = [&](const TagDetection* tag) {
    return (layout.at(tag->id)[0] - place_m).squaredNorm();
  };
  return **std::ranges::min_element(tags, {}, distance);
}

/// Says whether two predictions of a tag differ by a quarter of a cell or more, so that the later
/// one may be read where the earlier one was not.
bool differs(const PredictedTag& one, const PredictedTag& other) {
  constexpr double kOfSide = 0.25 / 8;
  double apart = 0, side = 0;
  for (size_t c = 0; c < 4; ++c) {
    apart = std::max(apart, (one.corner_px[c] - other.corner_px[c]).norm());
    side = std::max(side, (one.corner_px[(c + 1) % 4] - one.corner_px[c]).norm());
  }
  return apart > kOfSide * side;
}

/// Notes corners of half hidden tags as hidden that lie where neither the tags around nor the tag's
/// other corners expect them: the border was taken to the edge of something in front. Tags whose
/// pixels are all explained are left alone, since folds too are where neighbours do not expect
/// them.
void doubt_corners(const TagLayout& layout, std::vector<TagDetection>& tags) {
  constexpr double kMostOfSide = 0.03, kMostSigmas = 4;
  const std::vector<TagDetection> read = tags;
  for (TagDetection& tag : tags) {
    const auto known = layout.find(tag.id);
    if (known == layout.end() || !tag.refined || !tag.shows_tag) continue;
    if (seen_whole(tag)) continue;
    std::array<Eigen::Vector2d, 4> expected;
    if (!predict(known->second, read_corners(read, layout, tag.id), expected)) continue;
    std::array<double, 4> off_u, off_v;
    for (size_t c = 0; c < 4; ++c) {
      off_u[c] = tag.corner_px[c].x() - expected[c].x();
      off_v[c] = tag.corner_px[c].y() - expected[c].y();
    }
    // The median of four ignores the one that is out of place.
    const Eigen::Vector2d common(median({off_u.begin(), off_u.end()}),
                                 median({off_v.begin(), off_v.end()}));
    const double side = (tag.corner_px[1] - tag.corner_px[0]).norm();
    for (size_t c = 0; c < 4; ++c)
      if ((Eigen::Vector2d(off_u[c], off_v[c]) - common).norm() >
          kMostOfSide * side + kMostSigmas * tag.sigma_px[c])
        tag.corner_seen[c] = 0;
  }
}

}  // namespace

bool seen_whole(const TagDetection& tag) {
  // Chosen on the study's tags behind a drawn hand, seed 1. Most clean tags have 0.89 to 0.92.
  // Lower values let more hidden corners through, higher ones doubt folds.
  constexpr double kAllExplained = 0.88;
  return tag.explained >= kAllExplained;
}

std::vector<PredictedTag> predict_from_neighbours(std::span<const TagDetection> found,
                                                  const TagLayout& layout) {
  std::vector<ReadCorner> read;
  std::vector<const TagDetection*> tags;
  std::map<int, int> times;
  for (const TagDetection& tag : found) ++times[tag.id];
  for (const TagDetection& tag : found) {
    const auto known = layout.find(tag.id);
    if (known == layout.end() || times[tag.id] > 1 || !tag.refined || !tag.shows_tag) continue;
    tags.push_back(&tag);
    for (size_t c = 0; c < 4; ++c)
      read.push_back({.place_m = known->second[c], .pixel_px = tag.corner_px[c]});
  }
  std::vector<PredictedTag> predicted;
  std::set<int> known;
  for (const TagDetection* tag : tags) known.insert(tag->id);
  for (const auto& [id, corners_m] : layout) {
    std::array<Eigen::Vector2d, 4> corner_px;
    if (known.contains(id) || times[id] > 1 || !predict(corners_m, read, corner_px)) continue;
    predicted.push_back({.id = id,
                         .corner_px = corner_px,
                         .motion_px = nearest(tags, layout, corners_m[0]).motion_px,
                         .picture = expected_picture(tags, layout, corners_m[0])});
  }
  return predicted;
}

void read_by_neighbours(TagDetector& detector, const cv::Mat& grey, const TagLayout& layout,
                        SheetTags& tags) {
  std::vector<int> ids;
  for (const auto& [id, corners] : layout) ids.push_back(id);
  std::map<int, PredictedTag> unread;
  constexpr int kMostRounds = 12;  // a sheet of 24 rows, read from its middle
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<PredictedTag> predicted = predict_from_neighbours(tags.read, layout);
    std::erase_if(predicted, [&](const PredictedTag& tag) {
      const auto before = unread.find(tag.id);
      return before != unread.end() && !differs(tag, before->second);
    });
    if (predicted.empty()) break;
    for (const PredictedTag& tag : predicted) unread[tag.id] = tag;
    for (const TagDetection& tag : detector.read_predicted(grey, predicted, ids)) {
      unread.erase(tag.id);
      // Outlines that could not be refined give way.
      std::erase_if(tags.read, [&](const TagDetection& one) { return one.id == tag.id; });
      tags.read.push_back(tag);
    }
  }
  doubt_corners(layout, tags.read);
  std::ranges::stable_sort(tags.read, {}, &TagDetection::id);
  const auto outlined = [&](int id) {
    return std::ranges::binary_search(tags.read, id, {}, &TagDetection::id);
  };
  for (const auto& [id, tag] : unread)
    if (!outlined(id)) tags.unread.push_back(tag);
}

SheetTags detect_on_sheet(TagDetector& detector, const cv::Mat& grey, const TagLayout& layout) {
  SheetTags tags{.read = detector.detect(grey), .unread = {}};
  read_by_neighbours(detector, grey, layout, tags);
  return tags;
}

}  // namespace clothfit
