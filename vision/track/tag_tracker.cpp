#include "vision/track/tag_tracker.h"

#include <Eigen/QR>
#include <algorithm>

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

/// Returns what a tag says of itself in the next picture.
ExpectedPicture expected_picture(const TagDetection& tag) {
  constexpr double kMore = 1.5, kLeast_px = 0.02;  // noise and print differ a little
  return {.black_levels = tag.black_levels,
          .contrast_levels = tag.contrast_levels,
          .most_noise_levels = kMore * tag.noise_levels,
          .most_roughness_px = kMore * tag.roughness_px + kLeast_px};
}

/// Moves the tags that lead to the front, some spread evenly over those of the sheet. Returns how
/// many there are.
size_t put_leads_first(const TagLayout& layout, std::vector<PredictedTag>& predicted) {
  constexpr size_t kLeads = 9;
  const auto beside = std::ranges::stable_partition(
      predicted, [&](const PredictedTag& tag) { return layout.contains(tag.id); });
  const size_t count = predicted.size() - beside.size();
  const size_t every = std::max<size_t>(1, count / kLeads);
  std::vector<PredictedTag> leads, others;
  for (size_t i = 0; i < predicted.size(); ++i)
    (i < count && i % every == every / 2 ? leads : others).push_back(predicted[i]);
  predicted = leads;
  predicted.insert(predicted.end(), others.begin(), others.end());
  return leads.size();
}

}  // namespace

TagTracker::TagTracker(const std::string& family, TagLayout layout, const std::set<int>& listed)
    : detector_(family), layout_(std::move(layout)), listed_(listed) {
  for (const auto& [id, corners] : layout_) sheet_ids_.push_back(id);
}

SheetTags TagTracker::next(const cv::Mat& grey, int frame) {
  SheetTags tags;
  bool search = must_search(frame);
  if (!search) {
    tags = follow(grey, frame);
    search = lost_many(tags);
  }
  ++since_search_;
  if (search) {
    tags = detect_on_sheet(detector_, grey, layout_);
    since_search_ = 0;
  }
  remember(tags, frame);
  return tags;
}

bool TagTracker::must_search(int frame) const {
  constexpr int kFirst = 2;      // pictures, for the motion
  constexpr int kWidestGap = 3;  // frames
  constexpr int kPatience = 30;  // pictures
  if (pictures_ < kFirst || followed_.empty() || frame - frame_ > kWidestGap) return true;
  return since_search_ + 1 >= kPatience &&
         std::ranges::any_of(listed_, [&](int id) { return !followed_.contains(id); });
}

std::vector<PredictedTag> TagTracker::predictions(int frame) const {
  std::vector<PredictedTag> predicted;
  for (const auto& [id, followed] : followed_) {
    PredictedTag tag{.id = id,
                     .corner_px = followed.tag.corner_px,
                     .lens_px = followed.tag.lens_px,
                     .motion_px = followed.tag.motion_px,
                     .picture = expected_picture(followed.tag)};
    for (size_t c = 0; c < 4; ++c) tag.corner_px[c] += (frame - frame_) * followed.motion_px[c];
    tag.close = followed.moves || !layout_.contains(id);
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
    predicted[i].close = false;
  }
  const std::span<PredictedTag> all(predicted), others = all.subspan(leads);
  SheetTags tags;
  tags.read = detector_.read_predicted(grey, all.first(leads), sheet_ids_);

  std::vector<Miss> misses;
  for (const TagDetection& tag : tags.read)
    for (size_t c = 0; c < 4; ++c)
      misses.push_back(
          {.place_m = layout_.at(tag.id)[c], .off_px = tag.corner_px[c] - led.at(tag.id)[c]});
  constexpr size_t kFewest = 3 * 4;
  const bool known = misses.size() >= kFewest;
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
  constexpr double kMost = 0.3;  // of the tags of the picture before
  const auto kept = std::ranges::count_if(
      tags.read, [&](const TagDetection& tag) { return followed_.contains(tag.id); });
  return static_cast<double>(kept) < (1 - kMost) * static_cast<double>(followed_.size());
}

void TagTracker::remember(const SheetTags& tags, int frame) {
  std::map<int, Followed> now;
  std::set<int> twice;
  for (const TagDetection& tag : tags.read) {
    if (!tag.refined || !tag.shows_tag) continue;
    Followed followed{.tag = tag};
    followed.motion_px.fill(Eigen::Vector2d::Zero());
    if (const auto before = followed_.find(tag.id); before != followed_.end()) {
      followed.moves = true;
      for (size_t c = 0; c < 4; ++c)
        followed.motion_px[c] =
            (tag.corner_px[c] - before->second.tag.corner_px[c]) / (frame - frame_);
    }
    if (!now.emplace(tag.id, followed).second) twice.insert(tag.id);
  }
  for (const int id : twice) now.erase(id);
  followed_ = std::move(now);
  frame_ = frame;
  ++pictures_;
}

}  // namespace clothfit
