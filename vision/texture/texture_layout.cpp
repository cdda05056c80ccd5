#include "vision/texture/texture_layout.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "data/median.h"

namespace clothfit {
namespace {

constexpr size_t kMostNeighbours = 8;
constexpr size_t kNearest = 4;  // those that say how far apart markers are

/// Counts placed neighbours of a marker, and those that it agrees with.
struct Agreement {
  int placed = 0, agreeing = 0;
  double share() const { return placed > 0 ? static_cast<double>(agreeing) / placed : 1; }
};

bool agree(const TextureLayout& layout, const PlacedWarps& placed, size_t one, size_t other) {
  const Eigen::Vector2d way_px = layout.way_px(one, other);
  const Eigen::Vector2d expected_px = 0.5 * (placed[one]->linear + placed[other]->linear) * way_px;
  const Eigen::Vector2d seen_px = placed[other]->place_px - placed[one]->place_px;
  constexpr double kShare = 0.1, kLeast_px = 1.5;
  return (seen_px - expected_px).norm() < kLeast_px + kShare * way_px.norm();
}

Agreement agreement_of(const TextureLayout& layout, const PlacedWarps& placed, size_t marker) {
  Agreement agreement;
  for (const int other : layout.neighbours(marker)) {
    if (!placed[static_cast<size_t>(other)]) continue;
    ++agreement.placed;
    agreement.agreeing += agree(layout, placed, marker, static_cast<size_t>(other)) ? 1 : 0;
  }
  return agreement;
}

Eigen::Vector2d median_place(const std::vector<Eigen::Vector2d>& places) {
  std::vector<double> u, v;
  for (const Eigen::Vector2d& place : places) {
    u.push_back(place.x());
    v.push_back(place.y());
  }
  return {median(std::move(u)), median(std::move(v))};
}

}  // namespace

TextureLayout::TextureLayout(const std::vector<Marker>& markers, std::vector<FirstPlace> places,
                             double width_m, double height_m)
    : places_(std::move(places)), neighbours_(markers.size()), size_m_(width_m, height_m) {
  assert(places_.size() == markers.size());
  for (const Marker& marker : markers) on_sheet_m_.emplace_back(marker.s_m, marker.t_m);
  double sum_m = 0;
  int count = 0;
  for (size_t m = 0; m < markers.size(); ++m) {
    std::vector<std::pair<double, int>> others;
    for (size_t other = 0; other < markers.size(); ++other)
      if (other != m) others.emplace_back(distance_m(m, other), static_cast<int>(other));
    const size_t most = std::min(kMostNeighbours, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(most),
                      others.end());
    for (size_t k = 0; k < most; ++k) {
      neighbours_[m].push_back(others[k].second);
      if (k >= kNearest) continue;
      sum_m += others[k].first;
      ++count;
    }
  }
  spacing_m_ = count > 0 ? sum_m / count : 0;
}

double TextureLayout::distance_m(size_t one, size_t other) const {
  return (on_sheet_m_[one] - on_sheet_m_[other]).norm();
}

double TextureLayout::spacing_px(size_t marker) const {
  const std::vector<int>& near = neighbours_[marker];
  const size_t count = std::min(kNearest, near.size());
  double sum = 0;
  for (size_t k = 0; k < count; ++k) sum += way_px(marker, static_cast<size_t>(near[k])).norm();
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

std::optional<Eigen::Matrix2d> TextureLayout::px_by_m(size_t marker) const {
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero(), mixed = Eigen::Matrix2d::Zero();
  for (const int other : neighbours_[marker]) {
    const Eigen::Vector2d way_m = on_sheet_m_[static_cast<size_t>(other)] - on_sheet_m_[marker];
    squares += way_m * way_m.transpose();
    mixed += way_px(marker, static_cast<size_t>(other)) * way_m.transpose();
  }
  const double size = squares.trace();
  if (!(squares.determinant() > 1e-4 * size * size)) return std::nullopt;
  const Eigen::Matrix2d result = mixed * squares.inverse();
  if (!(std::abs(result.determinant()) > 1e-6 * result.squaredNorm())) return std::nullopt;
  return result;
}

OnCloth TextureLayout::on_cloth(size_t marker, double margin_px) const {
  const std::optional<Eigen::Matrix2d> forward = px_by_m(marker);
  if (!forward) return [](const Eigen::Vector2d&) { return true; };
  const Eigen::Matrix2d m_by_px = forward->inverse();
  const Eigen::Vector2d margin_m = margin_px * m_by_px.rowwise().norm();
  const Eigen::Vector2d low_m = margin_m - on_sheet_m_[marker];
  const Eigen::Vector2d high_m = size_m_ - margin_m - on_sheet_m_[marker];
  return [=](const Eigen::Vector2d& from_marker_px) {
    const Eigen::Vector2d way_m = m_by_px * from_marker_px;
    return (way_m.array() >= low_m.array()).all() && (way_m.array() <= high_m.array()).all();
  };
}

std::optional<ExpectedWarp> expected_warp(const TextureLayout& layout, const PlacedWarps& placed,
                                          size_t marker) {
  std::vector<Eigen::Vector2d> places;
  std::vector<int> voters;
  for (const int other : layout.neighbours(marker)) {
    const std::optional<PatchWarp>& warp = placed[static_cast<size_t>(other)];
    if (!warp) continue;
    places.push_back(warp->at(layout.way_px(static_cast<size_t>(other), marker)));
    voters.push_back(other);
  }
  if (places.empty()) return std::nullopt;
  const Eigen::Vector2d middle = median_place(places);
  std::vector<double> apart;
  for (const Eigen::Vector2d& place : places) apart.push_back((place - middle).norm());
  const double spread = median(apart);
  constexpr double kLeast_px = 1, kOutlier = 2.5;
  ExpectedWarp expected{.warp = {}, .spread_px = spread, .neighbours = 0};
  expected.warp.linear.setZero();
  double sum = 0;
  for (size_t k = 0; k < places.size(); ++k) {
    if (apart[k] > std::max(kLeast_px, kOutlier * spread)) continue;
    const Eigen::Vector2d way = layout.way_px(static_cast<size_t>(voters[k]), marker);
    const PatchWarp& warp = *placed[static_cast<size_t>(voters[k])];
    const double weight = 1 / (1 + way.squaredNorm());
    sum += weight;
    expected.warp.place_px += weight * places[k];
    expected.warp.linear += weight * warp.jacobian(way);
    expected.warp.second += weight * warp.second;
    ++expected.neighbours;
  }
  expected.warp.place_px /= sum;
  expected.warp.linear /= sum;
  expected.warp.second /= sum;
  return expected;
}

std::vector<int> contradicting_markers(const TextureLayout& layout, const PlacedWarps& placed) {
  PlacedWarps left = placed;
  std::vector<int> result;
  while (true) {
    int worst = -1;
    constexpr double kLeastShare = 0.5;
    double least = kLeastShare;
    for (size_t m = 0; m < left.size(); ++m) {
      if (!left[m]) continue;
      const Agreement agreement = agreement_of(layout, left, m);
      constexpr int kFewest = 2;
      if (agreement.placed < kFewest || agreement.share() >= least) continue;
      least = agreement.share();
      worst = static_cast<int>(m);
    }
    if (worst < 0) return result;
    left[static_cast<size_t>(worst)].reset();
    result.push_back(worst);
  }
}

}  // namespace clothfit
