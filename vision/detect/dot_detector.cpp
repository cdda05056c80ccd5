#include "vision/detect/dot_detector.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <tuple>

#include "data/input_error.h"
#include "data/median.h"

namespace clothfit {
namespace {

/// A local extremum over place and scale.
struct Spot {
  float strength = 0;  ///< root of the normalised determinant, grey levels
  int u = 0, v = 0;    ///< in the picture
  double radius_px = 0;
};

/// Returns the determinant of the Hessian times sigma^4 where both curvatures are upwards (dark
/// spots), 0 elsewhere.
cv::Mat dark_determinant(const cv::Mat& smooth, float sigma) {
  cv::Mat determinant = cv::Mat::zeros(smooth.size(), CV_32FC1);
  const float scale = sigma * sigma;
  for (int v = 1; v + 1 < smooth.rows; ++v) {
    const float* above = smooth.ptr<float>(v - 1);
    const float* row = smooth.ptr<float>(v);
    const float* below = smooth.ptr<float>(v + 1);
    float* out = determinant.ptr<float>(v);
    for (int u = 1; u + 1 < smooth.cols; ++u) {
      const float xx = row[u - 1] - 2 * row[u] + row[u + 1];
      const float yy = above[u] - 2 * row[u] + below[u];
      const float xy = 0.25F * (above[u - 1] - above[u + 1] - below[u - 1] + below[u + 1]);
      const float value = xx * yy - xy * xy;
      out[u] = xx > 0 && value > 0 ? scale * std::sqrt(value) : 0;
    }
  }
  return determinant;
}

void collect_maxima(const cv::Mat& strength, float least, int step, double radius_px,
                    std::vector<Spot>& spots) {
  for (int v = 1; v + 1 < strength.rows; ++v) {
    const float* above = strength.ptr<float>(v - 1);
    const float* row = strength.ptr<float>(v);
    const float* below = strength.ptr<float>(v + 1);
    for (int u = 1; u + 1 < strength.cols; ++u) {
      const float x = row[u];
      if (x < least) continue;
      if (x <= row[u - 1] || x < row[u + 1] || x <= above[u - 1] || x <= above[u] ||
          x <= above[u + 1] || x < below[u - 1] || x < below[u] || x < below[u + 1])
        continue;
      spots.push_back({.strength = x, .u = u * step, .v = v * step, .radius_px = radius_px});
    }
  }
}

/// Finds spots at scales half an octave apart; each octave halves the picture.
std::vector<Spot> find_spots(const cv::Mat& dark, const DotDetectorOptions& options) {
  constexpr float kLeast = 4;          // grey levels; noise of 8 levels reaches 3
  constexpr float kFinest = 1.2F;      // px
  constexpr double kRadius = M_SQRT2;  // a disc of radius sqrt(2) sigma answers most
  std::vector<Spot> spots;
  cv::Mat base;
  dark.convertTo(base, CV_32F);
  for (int step = 1;; step *= 2) {
    for (const float sigma : {kFinest, kFinest * static_cast<float>(M_SQRT2)}) {
      const double radius_px = kRadius * static_cast<double>(sigma) * step;
      if (radius_px > options.largest_radius_px) return spots;
      cv::Mat smooth;
      cv::GaussianBlur(base, smooth, {}, static_cast<double>(sigma), 0, cv::BORDER_REPLICATE);
      collect_maxima(dark_determinant(smooth, sigma), kLeast, step, radius_px, spots);
    }
    if (std::min(base.rows, base.cols) < 16) return spots;
    // Smoothed so that halving aliases nothing.
    cv::GaussianBlur(base, base, {}, 1.0, 0, cv::BORDER_REPLICATE);
    cv::resize(base, base, {base.cols / 2, base.rows / 2}, 0, 0, cv::INTER_NEAREST);
  }
}

/// Measures spots by the connected area around them that is darker than half way.
class SpotMeasure {
 public:
  explicit SpotMeasure(const cv::Mat& dark)
      : dark_(dark), owner_(cv::Mat::zeros(dark.size(), CV_32SC1)) {}

  /// Nothing where a stronger spot has the place, or the area runs beyond a dot's size.
  std::optional<DotOutline> measure(const Spot& spot);

 private:
  bool claim(const cv::Point& at, float level);
  float paper_level(const Spot& spot) const;
  float dark_level(const Spot& spot) const;

  const cv::Mat& dark_;
  cv::Mat owner_;  ///< number of the spot that a pixel belongs to, 0: none
  int count_ = 0;
  std::vector<cv::Point> area_;  ///< of the spot being measured
};

/// Three quarters of the surroundings are darker: other dots and the dot's own ends lie there.
float SpotMeasure::paper_level(const Spot& spot) const {
  constexpr int kPlaces = 24;
  std::array<std::uint8_t, kPlaces> levels{};
  const double ring_px = 1.9 * spot.radius_px + 1.5;
  for (size_t k = 0; k < kPlaces; ++k) {
    const double angle = 2 * M_PI * static_cast<double>(k) / kPlaces;
    const int u = std::clamp(spot.u + static_cast<int>(std::lround(ring_px * std::cos(angle))), 0,
                             dark_.cols - 1);
    const int v = std::clamp(spot.v + static_cast<int>(std::lround(ring_px * std::sin(angle))), 0,
                             dark_.rows - 1);
    levels[k] = dark_.at<std::uint8_t>(v, u);
  }
  std::sort(levels.begin(), levels.end());
  return levels[kPlaces * 3 / 4];
}

float SpotMeasure::dark_level(const Spot& spot) const {
  float sum = 0;
  int count = 0;
  for (int v = std::max(spot.v - 1, 0); v <= std::min(spot.v + 1, dark_.rows - 1); ++v)
    for (int u = std::max(spot.u - 1, 0); u <= std::min(spot.u + 1, dark_.cols - 1); ++u) {
      sum += dark_.at<std::uint8_t>(v, u);
      ++count;
    }
  return sum / static_cast<float>(count);
}

/// Adds a pixel to the area if it is dark. Returns false where it is another spot's.
bool SpotMeasure::claim(const cv::Point& at, float level) {
  if (at.x < 0 || at.y < 0 || at.x >= dark_.cols || at.y >= dark_.rows) return true;
  int& owner = owner_.at<int>(at);
  if (owner == count_ || dark_.at<std::uint8_t>(at) > level) return true;
  if (owner != 0) return false;
  owner = count_;
  area_.push_back(at);
  return true;
}

std::optional<DotOutline> SpotMeasure::measure(const Spot& spot) {
  const float level = 0.5F * (paper_level(spot) + dark_level(spot));
  const double most_pixels = 40 * spot.radius_px * spot.radius_px + 40;
  ++count_;
  area_.clear();
  bool alone = claim({spot.u, spot.v}, level);
  double su = 0, sv = 0, suu = 0, suv = 0, svv = 0;
  for (size_t i = 0; alone && i < area_.size(); ++i) {
    const cv::Point at = area_[i];
    const double du = at.x - spot.u, dv = at.y - spot.v;
    su += du;
    sv += dv;
    suu += du * du;
    suv += du * dv;
    svv += dv * dv;
    alone = static_cast<double>(area_.size()) <= most_pixels && claim({at.x + 1, at.y}, level) &&
            claim({at.x - 1, at.y}, level) && claim({at.x, at.y + 1}, level) &&
            claim({at.x, at.y - 1}, level);
  }
  if (!alone || area_.empty()) {
    for (const cv::Point& at : area_) owner_.at<int>(at) = 0;
    return std::nullopt;
  }
  const auto n = static_cast<double>(area_.size());
  const double mu = su / n, mv = sv / n;
  DotOutline outline;
  outline.centre_px = {spot.u + mu, spot.v + mv};
  // An ellipse's second moments are a quarter of A A^T; a pixel's own are 1/12.
  outline.shape_px2 << suu / n - mu * mu, suv / n - mu * mv, suv / n - mu * mv, svv / n - mv * mv;
  outline.shape_px2 = 4 * (outline.shape_px2 + Eigen::Matrix2d::Identity() / 12);
  return outline;
}

/// Says why a fit that settled is doubted.
DotDoubt doubt_of(const Dot& dot, const cv::Mat& grey, const DotDetectorOptions& options) {
  const Eigen::Vector2d half = dot.outline.shape_px2.diagonal().cwiseSqrt();
  const Eigen::Vector2d low = dot.outline.centre_px - half, high = dot.outline.centre_px + half;
  if (low.minCoeff() < 0.5 || high.x() > grey.cols - 1.5 || high.y() > grey.rows - 1.5)
    return DotDoubt::border;
  const double contrast = options.bright ? -dot.contrast : dot.contrast;
  const double step_levels = std::abs(dot.contrast * dot.paper_levels);
  if (contrast < options.least_contrast || step_levels < options.least_signal * dot.noise_levels)
    return DotDoubt::faint;
  constexpr double kBlack = 1.1;  // share of light taken away; more is no dot
  const Eigen::Vector2d radii = dot.outline.radii_px();
  if ((!options.bright && contrast > kBlack) || radii[0] < 0.5 * options.smallest_radius_px ||
      radii[1] > 2 * options.largest_radius_px || radii[1] > options.largest_axis_ratio * radii[0])
    return DotDoubt::not_a_disc;
  constexpr double kWideBlur = 1.2;  // of the longer radius
  if (dot.blur_px > kWideBlur * radii[1]) return DotDoubt::blurred;
  const double noise = dot.noise_levels / step_levels;
  if (dot.explained < options.least_explained ||
      dot.misfit * dot.misfit - noise * noise > options.largest_misfit * options.largest_misfit)
    return DotDoubt::not_a_disc;
  return DotDoubt::none;
}

}  // namespace

void DotDetectorOptions::validate() const {
  const auto check = [](bool good, const char* name, double value, const char* range) {
    if (!good) throw InputError(name, fmt::format("{}", value), range);
  };
  check(smallest_radius_px > 0, "smallest_radius_px", smallest_radius_px, "pixels, > 0");
  check(largest_radius_px >= smallest_radius_px, "largest_radius_px", largest_radius_px,
        "pixels, no less than smallest_radius_px");
  check(least_contrast > 0 && least_contrast < 1, "least_contrast", least_contrast,
        "a share, 0 to 1");
  check(least_signal > 0, "least_signal", least_signal, "standard deviations, > 0");
  check(least_explained >= 0 && least_explained <= 1, "least_explained", least_explained,
        "a share, 0 to 1");
  check(largest_misfit > 0, "largest_misfit", largest_misfit, "a share, > 0");
}

std::vector<DotOutline> find_dot_candidates(const cv::Mat& grey,
                                            const DotDetectorOptions& options) {
  assert(grey.type() == CV_8UC1 && !grey.empty());
  const cv::Mat dark = options.bright ? cv::Mat(255 - grey) : grey;
  std::vector<Spot> spots = find_spots(dark, options);
  std::sort(spots.begin(), spots.end(), [](const Spot& a, const Spot& b) {
    return std::tuple(-a.strength, a.v, a.u, a.radius_px) <
           std::tuple(-b.strength, b.v, b.u, b.radius_px);
  });
  SpotMeasure measure(dark);
  std::vector<DotOutline> outlines;
  for (const Spot& spot : spots) {
    const std::optional<DotOutline> outline = measure.measure(spot);
    if (!outline) continue;
    const Eigen::Vector2d radii = outline->radii_px();
    if (radii[0] >= options.smallest_radius_px * 0.7 && radii[1] <= options.largest_radius_px)
      outlines.push_back(*outline);
  }
  return outlines;
}

Dot fit_dot(const cv::Mat& grey, const DotStart& start, const DotDetectorOptions& options) {
  Dot dot = refine_dot(grey, start);
  if (dot.doubt == DotDoubt::none) dot.doubt = doubt_of(dot, grey, options);
  return dot;
}

double covariance_factor(const std::vector<const Dot*>& dots) {
  constexpr size_t kFewest = 10;
  if (dots.size() < kFewest) return 1;
  // Of chi-square / 2 with 2 degrees of freedom, less the share that light and blur take up.
  constexpr double kMedian = 0.693 * 0.73;
  constexpr double kLeast = 0.25;  // noise is never so much less than its estimate
  double factor = kLeast;
  for (const size_t waves : {size_t{0}, size_t{1}}) {
    std::vector<double> chi2;
    for (const Dot* dot : dots) chi2.push_back(dot->waves_chi2[waves]);
    factor = std::max(factor, median(std::move(chi2)) / kMedian);
  }
  return factor;
}

std::vector<Dot> find_dots(const cv::Mat& grey, const DotDetectorOptions& options) {
  options.validate();
  std::vector<Dot> dots;
  for (const DotOutline& outline : find_dot_candidates(grey, options))
    dots.push_back(fit_dot(grey, {.outline = outline}, options));
  std::vector<const Dot*> good;
  for (const Dot& dot : dots)
    if (dot.good()) good.push_back(&dot);
  const double factor = covariance_factor(good);
  for (Dot& dot : dots) dot.covariance_px2 *= factor;
  std::sort(dots.begin(), dots.end(), [](const Dot& a, const Dot& b) {
    return std::tuple(a.outline.centre_px.y(), a.outline.centre_px.x()) <
           std::tuple(b.outline.centre_px.y(), b.outline.centre_px.x());
  });
  return dots;
}

}  // namespace clothfit
