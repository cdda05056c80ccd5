#include "vision/detect/tag_evidence.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

/// Sums over the pixels of a cell that give the amplitude of its change.
struct CellSums {
  double information = 0;  ///< of an amplitude of 1, in squared standard deviations
  double moment = 0;
};

/// Returns the share of a cell's own grey level at a place `from_middle` of it along one axis.
double own_share(double from_middle, double half_cell, double spread) {
  const double scale = M_SQRT1_2 / spread;
  return 0.5 * (std::erf((from_middle + half_cell) * scale) -
                std::erf((from_middle - half_cell) * scale));
}

/// Returns where the print of a sample lies, by the bending found.
Eigen::Vector2d place_on_print(const TagFit& fit, const TagSample& sample) {
  const TagUnknowns::Terms terms = TagUnknowns::polynomials(sample.x, sample.y);
  const auto bend = [&](int first) {
    return terms.dot(fit.unknowns().segment<TagUnknowns::kTerms>(first));
  };
  return {sample.x + bend(TagUnknowns::kBendX), sample.y + bend(TagUnknowns::kBendY)};
}

}  // namespace

bool speaks_for(const TagEvidence& evidence, const TagPattern& own, const TagPattern& rival) {
  constexpr int kLead = 4;  // cells; fewer let a pleat's tag pass for its neighbour
  if (evidence.verdict.size() != own.white.size()) return false;
  int lead = 0;
  for (size_t k = 0; k < own.white.size(); ++k)
    if (own.white[k] != rival.white[k]) lead += evidence.verdict[k];
  return lead >= kLead;
}

TagEvidence tag_evidence(const TagFit& fit, const TagPattern& pattern,
                         const Eigen::Matrix2d& pixel_by_tag) {
  const int across = pattern.total_cells;
  const double cell = pattern.cell(), first = -0.5 * cell * across;
  const Eigen::Matrix2d tag_by_pixel = pixel_by_tag.inverse();
  const PictureBlur blur(fit.unknowns().segment<3>(TagUnknowns::kBlur));
  const Eigen::Vector2d spread =
      (tag_by_pixel * blur.covariance_px2() * tag_by_pixel.transpose()).diagonal().cwiseSqrt();

  std::vector<CellSums> cells(static_cast<size_t>(across * across));
  std::array<int, 4> near{};
  const int reached = std::min(across, pattern.border_cells + 2);
  TagEvidence evidence{.printed_cells = reached * reached, .verdict = {}};
  for (size_t i = 0; i < fit.samples().size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector2d place = place_on_print(fit, fit.samples()[i]);
    for (size_t c = 0; c < 4; ++c) {
      const Eigen::Vector2d corner(c == 1 || c == 2 ? 1 : -1, c < 2 ? 1 : -1);
      const Eigen::Vector2d outwards = (place - corner).cwiseProduct(corner);
      if (outwards.minCoeff() < -1.5 * cell || outwards.maxCoeff() > 0.2 * cell) continue;
      evidence.corner_seen[c] += fit.robust()[row];
      ++near[c];
    }
    const int column = static_cast<int>(std::floor((place.x() - first) / cell));
    const int line = static_cast<int>(std::floor((place.y() - first) / cell));
    if (column < 0 || line < 0 || column >= across || line >= across) continue;
    const auto k = static_cast<size_t>(line * across + column);
    const double share =
        own_share(place.x() - first - (column + 0.5) * cell, 0.5 * cell, spread.x()) *
        own_share(place.y() - first - (line + 0.5) * cell, 0.5 * cell, spread.y());
    const double change = (pattern.white[k] > 0.5F ? -1 : 1) * fit.contrast() * share;
    const double weight = fit.weight()[row] / fit.robust()[row];  // of the pixel unharmed
    cells[k].information += weight * change * change;
    cells[k].moment += weight * change * fit.residual()[row];
  }
  for (size_t c = 0; c < 4; ++c)
    if (near[c] > 0) evidence.corner_seen[c] /= near[c];
  for (const CellSums& sums : cells) {
    constexpr double kTold = 9;  // three standard deviations between right and wrong
    evidence.verdict.push_back(0);
    if (sums.information < kTold) continue;
    ++evidence.cells;
    const double amplitude = sums.moment / sums.information;
    const double slack = 0.25 + 1 / std::sqrt(sums.information);
    const bool right = std::abs(amplitude) < slack;
    const bool wrong = !right && std::abs(amplitude - 1) < slack;
    evidence.right_cells += right;
    evidence.wrong_cells += wrong;
    evidence.verdict.back() = static_cast<signed char>(right - wrong);
  }
  return evidence;
}

}  // namespace clothfit
