#include "vision/look/dots_shown.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/median.h"
#include "vision/detect/dot_detector.h"
#include "vision/ingest/open_images.h"
#include "vision/track/dot_lattice.h"

namespace clothfit {
namespace {

/// Finds the dots of a picture that lie on one lattice; nothing where too few do.
std::optional<SeenLattice> lattice_at_blur(const cv::Mat& grey, double blur_px) {
  constexpr int kFewest = 16;  // dots; fewer spots of a texture may lie evenly
  // Share of the lattice that its dots fill. Lowered: texture is taken for dots.
  constexpr double kFilled = 0.5;
  // A scan of a sheet has the largest dots: a share of the picture's longer side.
  constexpr double kLargest = 0.03;
  DotDetectorOptions options;
  options.largest_radius_px =
      std::max(options.largest_radius_px, kLargest * std::max(grey.rows, grey.cols));
  cv::Mat smooth = grey;
  if (blur_px > 0) cv::GaussianBlur(grey, smooth, {}, blur_px);
  std::vector<Dot> good;
  std::vector<double> misfits;
  for (const Dot& dot : find_dots(smooth, options))
    if (dot.good()) {
      good.push_back(dot);
      misfits.push_back(dot.misfit);
    }
  // Fields of boards and corners of tag grids lie on lattices too, and are no discs: 0.16 and more.
  constexpr double kDiscs = 0.12;
  if (misfits.empty() || median(std::move(misfits)) > kDiscs) return std::nullopt;
  std::optional<SeenLattice> lattice = find_lattice(good);
  if (lattice && (lattice->count < kFewest ||
                  lattice->count < kFilled * static_cast<double>(lattice->dots.size())))
    lattice.reset();
  return lattice;
}

/// Finds the lattice of a picture. A drawn one is sharper than the model of a dot, which no lens
/// is.
std::optional<SeenLattice> lattice_of(const cv::Mat& grey) {
  constexpr double kLens_px = 1;
  std::optional<SeenLattice> lattice = lattice_at_blur(grey, 0);
  return lattice ? lattice : lattice_at_blur(grey, kLens_px);
}

/// Returns the pattern of a size that names a lattice which shows the whole sheet.
std::optional<DotPattern> pattern_of(const SeenLattice& lattice) {
  const int longer = std::max(lattice.columns, lattice.rows),
            shorter = std::min(lattice.columns, lattice.rows);
  if (shorter < kFewestPatternDots || longer > kMostPatternDots) return std::nullopt;
  for (const auto& [columns, rows] :
       {std::pair(lattice.columns, lattice.rows), std::pair(lattice.rows, lattice.columns)}) {
    DotPattern pattern = make_dot_pattern(columns, rows);
    if (places_in_pattern(lattice, DotPatternIndex(pattern))) return pattern;
  }
  return std::nullopt;
}

}  // namespace

DotsShown dots_shown(const std::filesystem::path& images) {
  // Raised: dots are found that few pictures show, and it takes longer.
  constexpr int kLooks = 6;
  const auto source = open_images(images);
  const int stride = std::max(1, source->count() / kLooks);
  DotsShown shown;
  cv::Mat grey;
  for (int n = 0; source->next(grey) && !shown.pattern; ++n) {
    if ((n % stride != stride / 2 && n > 0) || !source->damage().empty()) continue;
    const std::optional<SeenLattice> lattice = lattice_of(grey);
    if (!lattice) continue;
    shown.any = true;
    shown.pattern = pattern_of(*lattice);
  }
  return shown;
}

std::vector<SeenDot> find_seen_dots(const cv::Mat& grey, const std::optional<DotPattern>& pattern) {
  const std::optional<SeenLattice> lattice = lattice_of(grey);
  std::vector<SeenDot> dots;
  if (!lattice) return dots;
  std::optional<std::vector<std::pair<int, int>>> places;
  if (pattern) places = places_in_pattern(*lattice, DotPatternIndex(*pattern));
  for (size_t i = 0; i < lattice->dots.size(); ++i) {
    if (!lattice->dots[i]) continue;
    const Dot& dot = *lattice->dots[i];
    SeenDot seen{.pixel_px = dot.outline.centre_px,
                 .sigma_px = dot.sigma_px(),
                 .width_px = 2 * std::sqrt(dot.outline.area_px2() / M_PI)};
    if (places) {
      const auto [row, column] = (*places)[i];
      // A spot beside the sheet may lie where its lattice goes on.
      if (row < 0 || column < 0 || row >= pattern->rows || column >= pattern->columns) continue;
      seen.row = row;
      seen.column = column;
    }
    dots.push_back(seen);
  }
  std::ranges::stable_sort(dots, {},
                           [](const SeenDot& dot) { return std::pair(dot.row, dot.column); });
  return dots;
}

}  // namespace clothfit
