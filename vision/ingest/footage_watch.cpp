#include "vision/ingest/footage_watch.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "vision/ingest/frame_list.h"

namespace clothfit {
namespace {

/// Grey level that a thousandth of the pixels exceeds. Hot pixels are fewer.
int bright_level(const cv::Mat& grey) {
  std::array<int, 256> histogram{};
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x) ++histogram[grey.at<uchar>(y, x)];
  long rest = static_cast<long>(grey.total()) / 1000;
  int level = 255;
  while (level > 0 && (rest -= histogram[static_cast<size_t>(level)]) >= 0) --level;
  return level;
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size()) return false;
  for (int y = 0; y < a.rows; ++y)
    if (std::memcmp(a.ptr(y), b.ptr(y), static_cast<size_t>(a.cols)) != 0) return false;
  return true;
}

/// Grey levels by which a line must stick out, and a pixel change to be in motion. Beyond noise.
constexpr int kStep = 12;

/// Says whether something moves from a picture to the next, beyond what a codec refines.
bool moves_between(const cv::Mat& before, const cv::Mat& after) {
  if (before.size() != after.size()) return true;
  constexpr long kOfPixels = 5000;
  long changed = 0;
  for (int y = 0; y < after.rows; ++y) {
    const uchar *a = before.ptr(y), *b = after.ptr(y);
    for (int x = 0; x < after.cols; ++x) changed += std::abs(a[x] - b[x]) >= kStep ? 1 : 0;
  }
  return changed > static_cast<long>(after.total()) / kOfPixels;
}

/// Says whether seven levels in a line, `stride` apart, are two curves woven into one: the middle
/// five stick out in turn on the same side of both neighbours, which agree better. Returns on which
/// side the middle one does, 1 or -1, and 0 where they are not.
int comb(const uchar* middle, std::ptrdiff_t stride) {
  for (int i = -2; i <= 2; ++i) {
    const int here = middle[i * stride], before = middle[(i - 1) * stride],
              after = middle[(i + 1) * stride];
    const int least = std::min(std::abs(here - before), std::abs(here - after));
    const bool one_side = (here > before) == (here > after);
    if (least < kStep || !one_side || 2 * std::abs(before - after) >= least) return 0;
  }
  return *middle > middle[stride] ? 1 : -1;
}

}  // namespace

void FootageWatch::Combs::add(int side, int line) {
  if (side != 0) ++((side > 0) == (line % 2 == 0) ? even_brighter : odd_brighter);
}

long FootageWatch::Combs::count() const {
  return 2 * std::min(even_brighter, odd_brighter);
}

void FootageWatch::see(const cv::Mat& grey, int frame) {
  constexpr int kCombed = 120;  // pictures; cloth has moved by then
  if (pictures_ < kCombed && grey.size() == last_.size()) count_combs(grey);
  compare(grey, frame);
  constexpr int kNearlyBlack = 16;  // grey level; a tag printed in black and white spans no less
  const int bright = bright_level(grey);
  last_dark_ = bright < kNearlyBlack;
  if (last_dark_) {
    dark_.push_back(frame);
    brightest_ = std::max(brightest_, bright);
  }
  ++pictures_;
}

void FootageWatch::compare(const cv::Mat& grey, int frame) {
  if (!last_.empty()) {
    if (equal(grey, last_)) {
      if (moves_) equal_.push_back(frame);
    } else {
      // A codec repeats pictures of a scene at rest. A copy lies between two that move.
      const bool moves = moves_between(last_, grey);
      if (moves) repeated_.insert(repeated_.end(), equal_.begin(), equal_.end());
      equal_.clear();
      moves_ = moves;
    }
  }
  grey.copyTo(last_);
}

void FootageWatch::count_combs(const cv::Mat& grey) {
  constexpr int kReach = 3, kEvery = 3;  // one line in three is enough
  const auto stride = static_cast<std::ptrdiff_t>(grey.step);
  for (int y = kReach; y + kReach < grey.rows; y += kEvery) {
    const uchar *now = grey.ptr(y), *before = last_.ptr(y);
    for (int x = kReach; x + kReach < grey.cols; ++x) {
      if (std::abs(now[x] - before[x]) < kStep) continue;
      ++moving_;
      combs_[0].add(comb(now + x, stride), y);
      combs_[1].add(comb(now + x, 1), x);
    }
  }
}

bool FootageWatch::interlaced() const {
  // Raised: slow motion of few edges passes. Lowered: moving cloth with stripes of two pixels is
  // taken for combs.
  constexpr double kShare = 0.01;  // of the pixels in motion
  constexpr long kRatio = 20, kFewest = 100;
  const long lines = combs_[0].count(), columns = combs_[1].count();
  return lines > kFewest && lines > kRatio * columns &&
         static_cast<double>(lines) > kShare * static_cast<double>(moving_);
}

std::string FootageWatch::combing() const {
  return fmt::format("of {} pixels in motion {} lie in combs of lines, and {} in combs of columns",
                     moving_, combs_[0].count(), combs_[1].count());
}

Findings FootageWatch::findings(const std::string& where) const {
  Findings findings;
  if (!repeated_.empty())
    findings.push_back(
        {.check = "pictures",
         .state = FindingState::warning,
         .found = fmt::format("{} of {} pictures repeat the one before: frames {}",
                              repeated_.size(), pictures_, list_numbers(repeated_)),
         .where = where,
         .expected = "a new picture in each frame",
         .remedy = "use the file as the camera wrote it; a converter that changes the rate copies "
                   "pictures"});
  if (!dark_.empty())
    findings.push_back(
        {.check = "pictures",
         .state = FindingState::warning,
         .found = fmt::format("{} of {} pictures are nearly black, with levels up "
                              "to {} of 255: frames {}",
                              dark_.size(), pictures_, brightest_, list_numbers(dark_)),
         .where = where,
         .expected = "pictures that span the range of grey levels",
         .remedy = "more light, or a longer exposure as far as motion allows"});
  return findings;
}

}  // namespace clothfit
