#include "apps/study/vision/tag_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "vision/track/tag_history.h"
#include "vision/track/track_options.h"

namespace clothfit {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNone;
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<size_t>(place)];
}

}  // namespace

void TagScore::add(const TagScore& other) {
  visible += other.visible;
  found += other.found;
  hidden_reported += other.hidden_reported;
  false_tags += other.false_tags;
  error_px.insert(error_px.end(), other.error_px.begin(), other.error_px.end());
  error_over_sigma.insert(error_over_sigma.end(), other.error_over_sigma.begin(),
                          other.error_over_sigma.end());
}

double TagScore::found_share() const {
  return visible > 0 ? static_cast<double>(found) / visible : kNone;
}

double TagScore::error_quantile_px(double share) const {
  return quantile(error_px, share);
}

double TagScore::error_over_sigma_rms() const {
  if (error_over_sigma.empty()) return kNone;
  double sum = 0;
  for (const double one : error_over_sigma) sum += one * one;
  return std::sqrt(sum / (2 * static_cast<double>(error_over_sigma.size())));
}

double TagScore::error_over_sigma_robust() const {
  const double kMedianOfRayleigh = std::sqrt(2 * std::log(2.0));
  return quantile(error_over_sigma, 0.5) / kMedianOfRayleigh;
}

TagScore score_tags(const std::vector<TagDetection>& tags, const std::vector<JudgedCorner>& truth,
                    const std::set<int>& other_tags, const cv::Size& picture) {
  std::map<int, TagHistory> by_tag;
  for (const TagDetection& tag : tags)
    by_tag[tag.id].push_back({.frame = 0, .tag = tag, .rejected = {}});
  for (auto& [id, history] : by_tag) judge(history, TrackOptions(), picture);

  TagScore score;
  std::set<int> known = other_tags;
  for (const JudgedCorner& corner : truth) {
    known.insert(corner.truth.tag);
    if (!corner.judged) continue;
    score.visible += corner.truth.visible;
    const auto history = by_tag.find(corner.truth.tag);
    if (history == by_tag.end()) continue;
    const TagReading& reading = history->second.front();
    const auto c = static_cast<size_t>(corner.truth.corner);
    if (!reading.rejected[c].empty()) continue;
    if (!corner.truth.visible) {
      ++score.hidden_reported;
      continue;
    }
    ++score.found;
    const double error = (reading.tag.corner_px[c] - corner.truth.pixel_px).norm();
    score.error_px.push_back(error);
    score.error_over_sigma.push_back(error / reading.tag.sigma_px[c]);
  }
  for (const auto& [id, history] : by_tag)
    score.false_tags += !known.contains(id) && history.front().good();
  return score;
}

}  // namespace clothfit
