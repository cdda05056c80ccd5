#include "vision/texture/texture_tracker.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/video/tracking.hpp>

#include "data/input_error.h"
#include "data/median.h"
#include "data/parallel.h"
#include "vision/texture/residual_correlation.h"

namespace clothfit {
namespace {

constexpr double kUsualNoise_levels = 1.5;
constexpr int kCoarseStep_px = 2;

cv::Point2f to_point(const Eigen::Vector2d& place) {
  return {static_cast<float>(place.x()), static_cast<float>(place.y())};
}

}  // namespace

/// The state between pictures.
class TextureTracker::Follower {
 public:
  Follower(const TextureLayout& layout, const cv::Mat& first, const TextureTrackOptions& options);
  TextureFrame first() const;
  TextureFrame next(const cv::Mat& grey);

 private:
  /// A marker's patches of the first picture, fine and coarse.
  struct Template {
    TexturePatch fine, coarse;
    double attainable_px = 0;  ///< sigma that usual noise leaves
    bool plain = false;        ///< too little texture
  };
  struct History {
    std::optional<PatchWarp> last;             ///< where it was found last
    std::optional<Eigen::Vector2d> before_px;  ///< its place one picture earlier
    bool in_last_picture = false;
  };
  /// The picture's own working set.
  struct Working {
    SmoothPicture fine, coarse;
    std::vector<std::optional<PatchFit>> fits;  ///< accepted ones by marker
    PlacedWarps placed;                         ///< their warps
    std::vector<PatchFit> attempts;             ///< the last refused fit by marker
    explicit Working(size_t size) : fits(size), placed(size), attempts(size) {}
    void place(size_t marker, PatchFit fit) {
      placed[marker] = fit.warp;
      fits[marker] = std::move(fit);
    }
    void remove(size_t marker) {
      placed[marker].reset();
      fits[marker].reset();
    }
  };

  Template make_template(size_t marker) const;
  std::vector<PatchWarp> starts_by_flow(const cv::Mat& grey) const;
  void follow(const std::vector<PatchWarp>& starts, Working& working) const;
  void seek_lost(Working& working) const;
  int seek_once(Working& working) const;
  void leave_out_contradicting(Working& working) const;
  void leave_out_cut(Working& working) const;
  bool acceptable(const PatchFit& fit) const;
  PatchFit align_from_afar(const Working& working, size_t marker, const PatchWarp& start) const;
  const char* why_missing(const Working& working, size_t marker) const;
  TextureFrame report(const Working& working) const;
  void remember(const cv::Mat& grey, const Working& working);

  size_t size() const { return layout_.size(); }

  TextureTrackOptions options_;
  TextureLayout layout_;
  SmoothPicture first_fine_, first_coarse_;
  std::vector<Template> templates_;
  std::vector<History> history_;
  cv::Mat last_picture_;
};

TextureTracker::Follower::Follower(const TextureLayout& layout, const cv::Mat& first,
                                   const TextureTrackOptions& options)
    : options_(options),
      layout_(layout),
      first_fine_(first, options.fine_blur_px),
      first_coarse_(first, options.coarse_blur_px),
      templates_(size()),
      history_(size()),
      last_picture_(first.clone()) {
  options.validate();
  for_each_index(size(), [&](size_t m) { templates_[m] = make_template(m); });
  for (size_t m = 0; m < size(); ++m) {
    if (templates_[m].plain) continue;
    history_[m].last.emplace();
    history_[m].last->place_px = layout_.place(m).pixel_px;
    history_[m].in_last_picture = true;
  }
}

/// Takes the smallest patch, from the distance to the next markers on, whose texture suffices.
TextureTracker::Follower::Template TextureTracker::Follower::make_template(size_t marker) const {
  constexpr double kGood_px = 0.04, kPlain_px = 0.3;  // attainable sigma
  constexpr double kGrowth = 1.25;
  const Eigen::Vector2d& place = layout_.place(marker).pixel_px;
  // Smoothing draws levels from beyond the edge within some px of it.
  const auto margin = [](double blur_px) { return 1 + 2 * blur_px; };
  Template result;
  double radius = std::clamp(options_.radius_share * layout_.spacing_px(marker),
                             options_.least_radius_px, options_.most_radius_px);
  while (true) {
    result.fine = make_texture_patch(first_fine_, place, radius, 1,
                                     layout_.on_cloth(marker, margin(options_.fine_blur_px)));
    result.attainable_px = attainable_sigma_px(result.fine, first_fine_, kUsualNoise_levels);
    result.plain = !(result.attainable_px < kPlain_px);
    if (result.attainable_px < kGood_px || radius >= options_.most_radius_px) break;
    radius = std::min(kGrowth * radius, options_.most_radius_px);
  }
  constexpr double kWider = 1.4;
  result.coarse = make_texture_patch(first_coarse_, place, kWider * radius, kCoarseStep_px,
                                     layout_.on_cloth(marker, margin(options_.coarse_blur_px)));
  return result;
}

/// Returns where optical flow from the picture before leads each marker that it shows.
std::vector<PatchWarp> TextureTracker::Follower::starts_by_flow(const cv::Mat& grey) const {
  std::vector<PatchWarp> starts(size());
  std::vector<cv::Point2f> from, to;
  std::vector<size_t> markers;
  for (size_t m = 0; m < size(); ++m) {
    const History& history = history_[m];
    if (!history.last) continue;
    starts[m] = *history.last;
    if (!history.in_last_picture) continue;
    Eigen::Vector2d guess = history.last->place_px;
    if (history.before_px) guess += history.last->place_px - *history.before_px;
    from.push_back(to_point(history.last->place_px));
    to.push_back(to_point(guess));
    markers.push_back(m);
  }
  if (from.empty()) return starts;
  std::vector<std::uint8_t> found;
  std::vector<float> error;
  constexpr int kWindow_px = 17, kLevels = 3, kIterations = 30;
  cv::calcOpticalFlowPyrLK(
      last_picture_, grey, from, to, found, error, cv::Size(kWindow_px, kWindow_px), kLevels,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations, 0.02),
      cv::OPTFLOW_USE_INITIAL_FLOW);
  for (size_t k = 0; k < markers.size(); ++k)
    if (found[k]) starts[markers[k]].place_px = Eigen::Vector2d(double{to[k].x}, double{to[k].y});
  return starts;
}

bool TextureTracker::Follower::acceptable(const PatchFit& fit) const {
  constexpr double kLeastKept = 0.5, kLeastGain = 0.2, kMostGain = 5;
  return fit.converged() && fit.explained > options_.least_explained && fit.kept > kLeastKept &&
         fit.kept_in_middle > kLeastKept && fit.gain > kLeastGain && fit.gain < kMostGain;
}

PatchFit TextureTracker::Follower::align_from_afar(const Working& working, size_t marker,
                                                   const PatchWarp& start) const {
  AlignOptions coarse = options_.align;
  coarse.step_px = 0.05;
  const PatchFit near = align_patch(working.coarse, templates_[marker].coarse, start, coarse);
  if (!near.converged()) return near;
  return align_patch(working.fine, templates_[marker].fine, near.warp, options_.align);
}

void TextureTracker::Follower::follow(const std::vector<PatchWarp>& starts,
                                      Working& working) const {
  for_each_index(size(), [&](size_t m) {
    if (!history_[m].in_last_picture) return;
    PatchFit fit = align_patch(working.fine, templates_[m].fine, starts[m], options_.align);
    if (!acceptable(fit)) fit = align_from_afar(working, m, starts[m]);
    if (acceptable(fit))
      working.place(m, std::move(fit));
    else
      working.attempts[m] = std::move(fit);
  });
  leave_out_contradicting(working);
}

void TextureTracker::Follower::leave_out_contradicting(Working& working) const {
  for (const int marker : contradicting_markers(layout_, working.placed))
    working.remove(static_cast<size_t>(marker));
}

/// Leaves out patches that something covers in part: the rest fits, and its edge bends the warp.
/// They keep less weight, or their residuals are larger, than is usual in the picture, or they lie
/// aside of where their neighbours lead by more than others do.
void TextureTracker::Follower::leave_out_cut(Working& working) const {
  std::vector<double> kept, residual, share, aside;
  std::vector<double> aside_px(size(), 0);
  const auto contrast = [&](size_t m) {
    return working.fits[m]->gain * double{templates_[m].fine.contrast_levels};
  };
  for (size_t m = 0; m < size(); ++m) {
    if (!working.fits[m]) continue;
    kept.push_back(working.fits[m]->kept);
    residual.push_back(working.fits[m]->residual_levels);
    share.push_back(working.fits[m]->residual_levels / contrast(m));
    const std::optional<ExpectedWarp> expected = expected_warp(layout_, working.placed, m);
    constexpr int kFewestNeighbours = 3;
    constexpr size_t kMany = 6;  // neighbours on the cloth, of which few are seen
    if (!expected || expected->neighbours < kFewestNeighbours) {
      if (layout_.neighbours(m).size() >= kMany) aside_px[m] = HUGE_VAL;  // nothing confirms it
      continue;
    }
    const double apart_px = (expected->warp.place_px - working.fits[m]->warp.place_px).norm();
    aside.push_back(apart_px);
    if (apart_px > options_.cut_spread * expected->spread_px) aside_px[m] = apart_px;
  }
  constexpr size_t kFewest = 8;  // that say what is usual
  if (aside.size() < kFewest) return;
  const double least_kept = options_.cut_kept * median(std::move(kept));
  const double usual_residual = median(std::move(residual)), usual_share = median(std::move(share));
  const double most_aside_px = std::max(1.0, options_.cut_aside * median(std::move(aside)));
  // Noise is alike in all patches, what the model lacks grows with their contrast.
  const auto too_large = [&](size_t m) {
    return working.fits[m]->residual_levels >
           options_.cut_residual * std::hypot(usual_residual, usual_share * contrast(m));
  };
  for (size_t m = 0; m < size(); ++m)
    if (working.fits[m] &&
        (working.fits[m]->kept < least_kept || too_large(m) || aside_px[m] > most_aside_px))
      working.remove(m);
}

/// Seeks the markers that are not placed where their neighbours expect them, or, where none is
/// placed, where they were last. Returns how many it found.
int TextureTracker::Follower::seek_once(Working& working) const {
  std::vector<std::optional<PatchFit>> found(size());
  for_each_index(size(), [&](size_t m) {
    if (working.fits[m] || templates_[m].plain) return;
    const std::optional<ExpectedWarp> expected = expected_warp(layout_, working.placed, m);
    if (!expected && !history_[m].last) return;
    const PatchWarp& start = expected ? expected->warp : *history_[m].last;
    PatchFit fit = align_from_afar(working, m, start);
    constexpr double kLeast_px = 3, kMost_px = 6, kSpreads = 3;
    const double aside_px = (fit.warp.place_px - start.place_px).norm();
    const bool near =
        !expected || aside_px < std::clamp(kSpreads * expected->spread_px, kLeast_px, kMost_px);
    if (acceptable(fit) && near)
      found[m] = std::move(fit);
    else
      working.attempts[m] = std::move(fit);
  });
  int count = 0;
  for (size_t m = 0; m < size(); ++m) {
    if (!found[m]) continue;
    working.place(m, std::move(*found[m]));
    ++count;
  }
  return count;
}

void TextureTracker::Follower::seek_lost(Working& working) const {
  constexpr int kMostRounds = 6;  // each reaches a marker further into what was lost
  for (int round = 0; round < kMostRounds; ++round)
    if (seek_once(working) == 0) break;
  leave_out_contradicting(working);
}

const char* TextureTracker::Follower::why_missing(const Working& working, size_t marker) const {
  if (templates_[marker].plain) return texture_missing::kPlain;
  const std::optional<ExpectedWarp> expected = expected_warp(layout_, working.placed, marker);
  if (!expected) return texture_missing::kUnplaced;
  const PatchWarp& warp = expected->warp;
  constexpr double kShare = 0.35, kEdgeOn = 0.12;
  const double border_px = kShare * templates_[marker].fine.radius_px;
  const Eigen::Vector2d& at = warp.place_px;
  if (at.x() < border_px || at.y() < border_px || at.x() > working.fine.columns() - 1 - border_px ||
      at.y() > working.fine.rows() - 1 - border_px)
    return texture_missing::kOutside;
  constexpr double kDark_levels = 12, kDarker = 0.3;  // than in the first picture
  const Eigen::Vector2f there = at.cast<float>();
  if (working.coarse.covers(there)) {
    const double level = double{working.coarse.at(there).level};
    if (level < std::min(kDark_levels, kDarker * double{templates_[marker].coarse.mean_level}))
      return texture_missing::kDark;
  }
  if (warp.linear.determinant() < kEdgeOn) return texture_missing::kHidden;
  for (size_t other = 0; other < size(); ++other) {
    if (other == marker || !working.placed[other]) continue;
    // Cloth that is known to be elsewhere appears in its place.
    const double apart_px = (working.placed[other]->place_px - at).norm();
    if (apart_px < 0.5 * layout_.spacing_px(marker) * std::sqrt(warp.linear.determinant()) &&
        layout_.distance_m(marker, other) > 2.5 * layout_.spacing_m())
      return texture_missing::kHidden;
  }
  const PatchFit& attempt = working.attempts[marker];
  if (attempt.end == AlignEnd::outside) return texture_missing::kOutside;
  if (attempt.end == AlignEnd::collapsed) return texture_missing::kHidden;
  const PatchFit coarse =
      align_patch(working.coarse, templates_[marker].coarse, warp, options_.align);
  return acceptable(coarse) ? texture_missing::kBlurred : texture_missing::kCovered;
}

TextureFrame TextureTracker::Follower::report(const Working& working) const {
  ResidualCorrelation correlation;
  for (size_t m = 0; m < size(); ++m)
    if (working.fits[m]) correlation.add(templates_[m].fine, *working.fits[m]);
  std::vector<double> sigma(size());
  std::vector<const char*> reason(size(), nullptr);
  for_each_index(size(), [&](size_t m) {
    if (!working.fits[m]) {
      reason[m] = why_missing(working, m);
      return;
    }
    const PatchFit& fit = *working.fits[m];
    const double first_px = layout_.place(m).sigma_px * std::sqrt(fit.warp.linear.determinant());
    const double variance = 0.5 * correlation.place_covariance_px2(templates_[m].fine, fit).trace();
    sigma[m] = std::sqrt(variance + first_px * first_px);
  });
  TextureFrame frame;
  for (size_t m = 0; m < size(); ++m)
    if (working.fits[m])
      frame.rows.push_back({.marker = static_cast<int>(m),
                            .pixel_px = working.fits[m]->warp.place_px,
                            .sigma_px = sigma[m]});
    else
      frame.missing.emplace_back(static_cast<int>(m), reason[m]);
  return frame;
}

void TextureTracker::Follower::remember(const cv::Mat& grey, const Working& working) {
  last_picture_ = grey.clone();
  for (size_t m = 0; m < size(); ++m) {
    History& history = history_[m];
    history.before_px.reset();
    if (history.in_last_picture) history.before_px = history.last->place_px;
    history.in_last_picture = working.fits[m].has_value();
    if (working.fits[m]) history.last = working.fits[m]->warp;
  }
}

TextureFrame TextureTracker::Follower::first() const {
  TextureFrame frame;
  for (size_t m = 0; m < size(); ++m)
    if (templates_[m].plain)
      frame.missing.emplace_back(static_cast<int>(m), texture_missing::kPlain);
    else
      frame.rows.push_back(
          {.marker = static_cast<int>(m),
           .pixel_px = layout_.place(m).pixel_px,
           .sigma_px = std::max(layout_.place(m).sigma_px, templates_[m].attainable_px)});
  return frame;
}

TextureFrame TextureTracker::Follower::next(const cv::Mat& grey) {
  assert(grey.type() == CV_8UC1 && grey.size() == last_picture_.size());
  Working working(size());
  working.fine = SmoothPicture(grey, options_.fine_blur_px);
  working.coarse = SmoothPicture(grey, options_.coarse_blur_px);
  follow(starts_by_flow(grey), working);
  seek_lost(working);
  leave_out_cut(working);
  TextureFrame frame = report(working);
  remember(grey, working);
  return frame;
}

void TextureTrackOptions::validate() const {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0 && std::isfinite(value)))
      throw InputError(name, fmt::format("{}", value), "pixels, > 0");
  };
  positive("fine_blur_px", fine_blur_px);
  positive("coarse_blur_px", coarse_blur_px);
  positive("least_radius_px", least_radius_px);
  if (!(radius_share > 0)) throw InputError("radius_share", fmt::format("{}", radius_share), "> 0");
  if (!(most_radius_px >= least_radius_px))
    throw InputError("most_radius_px", fmt::format("{}", most_radius_px),
                     "no less than least_radius_px");
  if (!(least_explained > 0 && least_explained < 1))
    throw InputError("least_explained", fmt::format("{}", least_explained), "a share, 0 to 1");
}

TextureTracker::TextureTracker(const TextureLayout& layout, const cv::Mat& first,
                               const TextureTrackOptions& options)
    : follower_(std::make_unique<Follower>(layout, first, options)) {}
TextureTracker::~TextureTracker() = default;
TextureTracker::TextureTracker(TextureTracker&&) noexcept = default;
TextureTracker& TextureTracker::operator=(TextureTracker&&) noexcept = default;

TextureFrame TextureTracker::first() const {
  return follower_->first();
}

TextureFrame TextureTracker::next(const cv::Mat& grey) {
  return follower_->next(grey);
}

}  // namespace clothfit
