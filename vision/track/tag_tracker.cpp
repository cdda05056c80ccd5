#include "vision/track/tag_tracker.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "data/median.h"

namespace clothfit {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// A corner of the sheet and by how much its prediction was off.
struct Miss {
  Eigen::Vector2d place_m, off_px;
};

/// By how much predictions are off over the sheet, a polynomial of degree 2.
class MissField {
 public:
  /// Needs the corners of two tags at least.
  explicit MissField(const std::vector<Miss>& misses) {
    const auto rows = static_cast<Eigen::Index>(misses.size());
    for (const Miss& miss : misses) middle_ += miss.place_m / static_cast<double>(rows);
    for (const Miss& miss : misses)
      reach_ = std::max(reach_, (miss.place_m - middle_).cwiseAbs().maxCoeff());
    // What few corners do not tell is small.
    constexpr double kStiff = 0.1;
    Eigen::Matrix<double, Eigen::Dynamic, kTerms> equations(rows + kTerms, kTerms);
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(rows + kTerms, 2);
    for (Eigen::Index row = 0; row < rows; ++row) {
      const Miss& miss = misses[static_cast<size_t>(row)];
      equations.row(row) = terms(miss.place_m);
      right.row(row) = miss.off_px.transpose();
    }
    equations.bottomRows<kTerms>() = kStiff * Eigen::Matrix<double, kTerms, kTerms>::Identity();
    field_ = equations.colPivHouseholderQr().solve(right);
  }

  Eigen::Vector2d at(const Eigen::Vector2d& place_m) const {
    return (terms(place_m) * field_).transpose();
  }

 private:
  static constexpr int kTerms = 6;

  Eigen::Matrix<double, 1, kTerms> terms(const Eigen::Vector2d& place_m) const {
    const Eigen::Vector2d at = (place_m - middle_) / reach_;
    return {1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y()};
  }

  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  double reach_ = 1e-9;
  Eigen::Matrix<double, kTerms, 2> field_;
};

/// Returns how many tags lead: a quarter of a small sheet's, 9 of a large one's.
size_t lead_count(size_t tags) {
  return std::min<size_t>(tags, std::clamp<size_t>(tags / 4, 3, 9));
}

/// Moves the tags that lead to the front, each as far as possible from those before it on the
/// sheet. Returns how many there are.
size_t put_leads_first(const TagLayout& layout, std::vector<PredictedTag>& predicted) {
  const auto beside = std::ranges::stable_partition(
      predicted, [&](const PredictedTag& tag) { return layout.contains(tag.id); });
  const size_t count = predicted.size() - beside.size(), leads = lead_count(count);
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  for (size_t lead = 0; lead < leads; ++lead) {
    const auto farthest =
        std::max_element(distance.begin() + static_cast<std::ptrdiff_t>(lead), distance.end());
    const auto which = static_cast<size_t>(farthest - distance.begin());
    std::swap(predicted[lead], predicted[which]);
    std::swap(distance[lead], distance[which]);
    const Eigen::Vector2d place = layout.at(predicted[lead].id)[0];
    for (size_t i = lead + 1; i < count; ++i)
      distance[i] = std::min(distance[i], (layout.at(predicted[i].id)[0] - place).norm());
  }
  return leads;
}

std::ptrdiff_t refined_count(const SheetTags& tags) {
  return std::ranges::count_if(
      tags.read, [](const TagDetection& tag) { return tag.refined && tag.shows_tag; });
}

bool holds(const std::vector<TagDetection>& tags, int id) {
  return std::ranges::find(tags, id, &TagDetection::id) != tags.end();
}

}  // namespace

TagTracker::TagTracker(const std::string& family, TagLayout layout, const std::set<int>& listed)
    : detector_(family), layout_(std::move(layout)), listed_(listed) {
  for (const auto& [id, corners] : layout_) sheet_ids_.push_back(id);
}

SheetTags TagTracker::next(const cv::Mat& grey, int frame) {
  SheetTags tags;
  bool whole = must_search(frame);
  if (!whole) {
    tags = follow(grey, frame);
    whole = lost_many(tags);
  }
  ++since_search_;
  if (whole) {
    steady_ = false;
    tags = search(grey, tags);
  }
  remember(tags, frame);
  return tags;
}

/// Searches the whole picture, and keeps what was read of it before.
SheetTags TagTracker::search(const cv::Mat& grey, const SheetTags& followed) {
  SheetTags tags = detect_on_sheet(detector_, grey, layout_);
  for (const TagDetection& tag : followed.read) {
    if (holds(tags.read, tag.id)) continue;
    tags.read.push_back(tag);
    std::erase_if(tags.unread, [&](const PredictedTag& one) { return one.id == tag.id; });
  }
  std::ranges::stable_sort(tags.read, {}, &TagDetection::id);
  since_search_ = 0;
  read_by_search_ = refined_count(tags);
  return tags;
}

bool TagTracker::must_search(int frame) const {
  constexpr int kFirst = 2;      // pictures, for the motion
  constexpr int kWidestGap = 3;  // frames
  constexpr int kEvery = 30;     // pictures
  const bool any = std::ranges::any_of(
      followed_, [](const auto& followed) { return followed.second.unread == 0; });
  if (pictures_ < kFirst || !any || frame - frame_ > kWidestGap) return true;
  return since_search_ + 1 >= kEvery && std::ranges::any_of(listed_, [&](int id) {
           const auto found = followed_.find(id);
           return found == followed_.end() || found->second.unread > 0;
         });
}

std::vector<PredictedTag> TagTracker::predictions(int frame) const {
  // Noise and print differ a little from tag to tag; a half hidden one does not tell its own.
  constexpr double kMore = 1.5, kLeast_px = 0.02;
  std::vector<double> noise, roughness;
  for (const auto& [id, followed] : followed_) {
    noise.push_back(followed.tag.noise_levels);
    roughness.push_back(followed.tag.roughness_px);
  }
  const double most_noise = kMore * median(std::move(noise));
  const double most_roughness_px = kMore * median(std::move(roughness)) + kLeast_px;
  std::vector<PredictedTag> predicted;
  for (const auto& [id, followed] : followed_) {
    PredictedTag tag{.id = id,
                     .corner_px = followed.tag.corner_px,
                     .lens_px = followed.tag.lens_px,
                     .motion_px = followed.tag.motion_px,
                     .picture = ExpectedPicture{.black_levels = followed.black_levels,
                                                .contrast_levels = followed.contrast_levels,
                                                .most_noise_levels = most_noise,
                                                .most_roughness_px = most_roughness_px}};
    for (size_t c = 0; c < 4; ++c) tag.corner_px[c] += (frame - frame_) * followed.motion_px[c];
    tag.close = followed.unread == 0 && (followed.moves || !layout_.contains(id));
    predicted.push_back(tag);
  }
  return predicted;
}

SheetTags TagTracker::follow(const cv::Mat& grey, int frame) {
  std::vector<PredictedTag> predicted = predictions(frame);
  const size_t leads = put_leads_first(layout_, predicted);
  std::map<int, Corners> led;
  for (size_t i = 0; i < leads; ++i) {
    led[predicted[i].id] = predicted[i].corner_px;
    predicted[i].close = predicted[i].close && steady_;
  }
  const std::span<PredictedTag> all(predicted), others = all.subspan(leads);
  SheetTags tags;
  tags.read = detector_.read_predicted(grey, all.first(leads), sheet_ids_);

  std::vector<Miss> misses;
  std::vector<double> of_side;
  for (const TagDetection& tag : tags.read)
    for (size_t c = 0; c < 4; ++c) {
      misses.push_back(
          {.place_m = layout_.at(tag.id)[c], .off_px = tag.corner_px[c] - led.at(tag.id)[c]});
      const double side_px = (tag.corner_px[1] - tag.corner_px[0]).norm();
      of_side.push_back(misses.back().off_px.norm() / side_px);
    }
  constexpr size_t kFewest = 3 * 4;
  const bool known = misses.size() >= kFewest;
  constexpr double kSteady = 0.2 / 8;  // a fifth of a cell
  steady_ = known && median(std::move(of_side)) < kSteady;
  if (known) {
    const MissField field(misses);
    for (PredictedTag& tag : others)
      if (const auto place = layout_.find(tag.id); place != layout_.end())
        for (size_t c = 0; c < 4; ++c) tag.corner_px[c] += field.at(place->second[c]);
  }
  for (PredictedTag& tag : others) tag.close = tag.close && (known || !layout_.contains(tag.id));
  const std::vector<TagDetection> more = detector_.read_predicted(grey, others, sheet_ids_);
  tags.read.insert(tags.read.end(), more.begin(), more.end());
  read_by_neighbours(detector_, grey, layout_, tags);
  return tags;
}

bool TagTracker::lost_many(const SheetTags& tags) const {
  constexpr double kMost = 0.3;  // of the tags of the last search
  return static_cast<double>(refined_count(tags)) <
         (1 - kMost) * static_cast<double>(read_by_search_);
}

void TagTracker::remember(const SheetTags& tags, int frame) {
  std::map<int, Followed> now;
  std::set<int> twice;
  for (const TagDetection& tag : tags.read) {
    if (!tag.refined || !tag.shows_tag) continue;
    Followed followed{
        .tag = tag, .black_levels = tag.black_levels, .contrast_levels = tag.contrast_levels};
    followed.motion_px.fill(Eigen::Vector2d::Zero());
    if (const auto before = followed_.find(tag.id); before != followed_.end()) {
      const Followed& then = before->second;
      followed.moves = then.unread == 0;
      for (size_t c = 0; c < 4 && followed.moves; ++c)
        followed.motion_px[c] = (tag.corner_px[c] - then.tag.corner_px[c]) / (frame - frame_);
      // Something in front spoils what a tag tells of its light.
      if (!seen_whole(tag)) {
        followed.black_levels = then.black_levels;
        followed.contrast_levels = then.contrast_levels;
      }
    }
    if (!now.emplace(tag.id, followed).second) twice.insert(tag.id);
  }
  for (const int id : twice) now.erase(id);
  // What no neighbour predicts is sought for some time where it was.
  constexpr int kPatience = 10;  // pictures
  for (auto& [id, followed] : followed_) {
    const bool predicted =
        std::ranges::find(tags.unread, id, &PredictedTag::id) != tags.unread.end();
    if (predicted || twice.contains(id) || ++followed.unread > kPatience) continue;
    followed.motion_px.fill(Eigen::Vector2d::Zero());
    now.emplace(id, followed);
  }
  followed_ = std::move(now);
  frame_ = frame;
  ++pictures_;
}

}  // namespace clothfit
