#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/markers.h"
#include "vision/texture/patch_warp.h"
#include "vision/texture/texture_patch.h"

namespace clothfit {

/// Where a marker lies in the first picture.
struct FirstPlace {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< per coordinate; 0 where the pixel itself defines the marker
};

/// The markers of a textured sheet on the cloth and in the first picture.
class TextureLayout {
 public:
  /// `places` has one entry per marker. Width and height are the cloth's.
  TextureLayout(const std::vector<Marker>& markers, std::vector<FirstPlace> places, double width_m,
                double height_m);

  size_t size() const { return places_.size(); }
  const FirstPlace& place(size_t marker) const { return places_[marker]; }
  /// Returns the nearest markers on the cloth, up to eight, the nearest first.
  const std::vector<int>& neighbours(size_t marker) const { return neighbours_[marker]; }
  /// Returns the way from one marker to another in the first picture.
  Eigen::Vector2d way_px(size_t from, size_t to) const {
    return places_[to].pixel_px - places_[from].pixel_px;
  }
  double distance_m(size_t one, size_t other) const;
  /// Returns the mean distance in the first picture to the four nearest; 0 without others.
  double spacing_px(size_t marker) const;
  /// Returns the mean distance on the cloth to the four nearest over all markers.
  double spacing_m() const { return spacing_m_; }
  /// Says which places around a marker show the cloth, `margin_px` from its edge or further in.
  OnCloth on_cloth(size_t marker, double margin_px) const;

 private:
  std::optional<Eigen::Matrix2d> px_by_m(size_t marker) const;

  std::vector<Eigen::Vector2d> on_sheet_m_;
  std::vector<FirstPlace> places_;
  std::vector<std::vector<int>> neighbours_;
  Eigen::Vector2d size_m_;
  double spacing_m_ = 0;
};

/// A warp that a marker's neighbours expect of it.
struct ExpectedWarp {
  PatchWarp warp;
  double spread_px = 0;  ///< how far the neighbours' opinions lie apart
  int neighbours = 0;
};

/// The warps of a picture by marker; nothing where a marker is not placed.
using PlacedWarps = std::vector<std::optional<PatchWarp>>;

/// Returns what the placed neighbours of a marker expect of it, each by continuing its own warp.
/// Nothing without any.
std::optional<ExpectedWarp> expected_warp(const TextureLayout& layout, const PlacedWarps& placed,
                                          size_t marker);

/// Returns the markers that contradict most of their placed neighbours, the worst first and those
/// that follow judged without it. Two agree where the way between them, by the mean of their warps,
/// leads from one place to the other within a tenth of its length and 1.5 px.
std::vector<int> contradicting_markers(const TextureLayout& layout, const PlacedWarps& placed);

}  // namespace clothfit
