#include "vision/detect/tag_evidence.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "vision/detect/tag_fit.h"

namespace clothfit {
namespace {

/// Sums over the pixels of a cell that give the amplitude of its change.
struct CellSums {
  double information = 0;  ///< of an amplitude of 1, in squared standard deviations
  double moment = 0;
};

/// Returns the shares of a cell's own grey level from its middle to its edge along one axis.
std::array<float, CellGrid::kSteps + 2> own_shares(double half_cell, double spread) {
  std::array<float, CellGrid::kSteps + 2> shares{};
  const double scale = M_SQRT1_2 / spread;
  for (size_t k = 0; k < shares.size(); ++k) {
    const double from_middle = static_cast<double>(k) / CellGrid::kSteps * half_cell;
    shares[k] = static_cast<float>(0.5 * (std::erf((from_middle + half_cell) * scale) -
                                          std::erf((from_middle - half_cell) * scale)));
  }
  return shares;
}

/// Returns the mean robust weight along the edge at a corner that is seen worse. Three steep pixels
/// with the mean over the tag come on top, since a small tag has few of its own there.
double edges_seen(const TagFit& fit, const CellRows& rows, size_t corner) {
  constexpr double kOnTop = 3;
  const double mean = fit.robust().mean();
  const Eigen::ArrayXf* const slopes[] = {&fit.rows().by_x, &fit.rows().by_y};
  double least = 1;
  for (size_t edge = 0; edge < 2; ++edge) {
    const double slope = rows.slope[corner][edge];
    if (!(slope > 0)) return 0;
    const double more = kOnTop * slopes[edge]->head(fit.samples().count).abs().maxCoeff();
    least = std::min(least, (rows.seen[corner][edge] + more * mean) / (slope + more));
  }
  return least;
}

/// Whether a cell is as printed, as far as the picture tells it.
enum class Likeness { untold, like, unlike };

/// Returns the share that is as printed of the cells told around a corner: those that touch it, and
/// the border's next ones along both edges.
double like_print_around(size_t corner, const TagPattern& pattern,
                         const std::vector<Likeness>& likeness) {
  const int across = pattern.total_cells, before = (across - pattern.border_cells) / 2;
  // Cells are counted from the corner, inwards; negative ones are the white outside.
  const auto cell = [&](int column, int row) {
    const int from = before + column, down = before + row;
    const Eigen::Vector2d sign = border_corners()[corner];
    return static_cast<size_t>((sign.y() < 0 ? down : across - 1 - down) * across +
                               (sign.x() < 0 ? from : across - 1 - from));
  };
  int like = 0, unlike = 0;
  for (const auto& [column, row] :
       {std::pair(-1, -1), {-1, 0}, {0, -1}, {0, 0}, {1, 0}, {0, 1}, {-1, 1}, {1, -1}}) {
    const size_t k = cell(column, row);
    like += likeness[k] == Likeness::like;
    unlike += likeness[k] == Likeness::unlike;
  }
  return like > 0 ? static_cast<double>(like) / (like + unlike) : 0;
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
  const double cell = pattern.cell();
  const Eigen::Matrix2d tag_by_pixel = pixel_by_tag.inverse();
  const PictureBlur blur(fit.unknowns().segment<3>(TagUnknowns::kBlur));
  const Eigen::Vector2d spread =
      (tag_by_pixel * blur.covariance_px2() * tag_by_pixel.transpose()).diagonal().cwiseSqrt();
  std::vector<float> turned;
  for (const float white : pattern.white) turned.push_back(white > 0.5F ? -1.0F : 1.0F);
  const CellRows rows = cell_rows(fit.model(),
                                  {.across = across,
                                   .first = static_cast<float>(-0.5 * cell * across),
                                   .per_unit = static_cast<float>(1 / cell),
                                   .turned = turned.data(),
                                   .share_x = own_shares(0.5 * cell, spread.x()),
                                   .share_y = own_shares(0.5 * cell, spread.y())},
                                  fit.samples(), fit.rows());

  const int reached = std::min(across, pattern.border_cells + 2);
  TagEvidence evidence{.printed_cells = reached * reached, .verdict = {}};
  for (size_t c = 0; c < 4; ++c) evidence.corner_seen[c] = edges_seen(fit, rows, c);
  std::vector<CellSums> cells(static_cast<size_t>(across * across));
  for (Eigen::Index i = 0; i < fit.samples().count; ++i) {
    const int k = rows.cell[static_cast<size_t>(i)];
    if (k < 0) continue;
    cells[static_cast<size_t>(k)].information += static_cast<double>(rows.information[i]);
    cells[static_cast<size_t>(k)].moment += static_cast<double>(rows.moment[i]);
  }
  std::vector<Likeness> likeness;
  for (const CellSums& sums : cells) {
    constexpr double kTold = 9;  // three standard deviations between right and wrong
    evidence.verdict.push_back(0);
    likeness.push_back(Likeness::untold);
    if (sums.information < kTold) continue;
    ++evidence.cells;
    const double amplitude = sums.moment / sums.information;
    const double slack = 0.25 + 1 / std::sqrt(sums.information);
    const bool right = std::abs(amplitude) < slack;
    const bool wrong = !right && std::abs(amplitude - 1) < slack;
    evidence.right_cells += right;
    evidence.wrong_cells += wrong;
    evidence.verdict.back() = static_cast<signed char>(right - wrong);
    // Two sigmas: of small cells one in ten is off by more than one.
    const bool like = std::abs(amplitude) < 0.25 + 2 / std::sqrt(sums.information);
    likeness.back() = like ? Likeness::like : Likeness::unlike;
  }
  for (size_t c = 0; c < 4; ++c)
    evidence.corner_seen[c] =
        std::min(evidence.corner_seen[c], like_print_around(c, pattern, likeness));
  return evidence;
}

}  // namespace clothfit
