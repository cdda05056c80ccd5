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

/// Returns the motion of the tag that lies nearest; there is one.
Eigen::Vector2d nearest_motion(const std::vector<const TagDetection*>& tags,
                               const TagLayout& layout, const Eigen::Vector2d& place_m) {
  const auto distance = [&](const TagDetection* tag) {
    return (layout.at(tag->id)[0] - place_m).squaredNorm();
  };
  return (*std::ranges::min_element(tags, {}, distance))->motion_px;
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

}  // namespace

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
                         .motion_px = nearest_motion(tags, layout, corners_m[0]),
                         .picture = expected_picture(tags, layout, corners_m[0])});
  }
  return predicted;
}

SheetTags detect_on_sheet(TagDetector& detector, const cv::Mat& grey, const TagLayout& layout) {
  SheetTags result{.read = detector.detect(grey), .unread = {}};
  std::vector<int> ids;
  for (const auto& [id, corners] : layout) ids.push_back(id);
  std::map<int, PredictedTag> unread;
  constexpr int kMostRounds = 12;  // a sheet of 24 rows, read from its middle
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<PredictedTag> predicted = predict_from_neighbours(result.read, layout);
    std::erase_if(predicted, [&](const PredictedTag& tag) {
      const auto before = unread.find(tag.id);
      return before != unread.end() && !differs(tag, before->second);
    });
    if (predicted.empty()) break;
    for (const PredictedTag& tag : predicted) unread[tag.id] = tag;
    for (const TagDetection& tag : detector.read_predicted(grey, predicted, ids)) {
      unread.erase(tag.id);
      // Outlines that could not be refined give way.
      std::erase_if(result.read, [&](const TagDetection& one) { return one.id == tag.id; });
      result.read.push_back(tag);
    }
  }
  std::ranges::stable_sort(result.read, {}, &TagDetection::id);
  const auto outlined = [&](int id) {
    return std::ranges::binary_search(result.read, id, {}, &TagDetection::id);
  };
  for (const auto& [id, tag] : unread)
    if (!outlined(id)) result.unread.push_back(tag);
  return result;
}

}  // namespace clothfit
