#pragma once

#include <vector>

#include "data/sewing_pattern.h"

namespace clothfit {

/// A rectangle of `width_m` x `height_m`: edges 0 below, 1 right, 2 above, 3 left. It stands in
/// front of the origin, its lower edge at z = 0, its outside towards -y, at a distance.
inline Panel rectangle(double width_m, double height_m, double distance_m) {
  Panel panel;
  panel.name = "rectangle";
  panel.corner_m.resize(2, 4);
  panel.corner_m << -0.5 * width_m, 0.5 * width_m, 0.5 * width_m, -0.5 * width_m,  //
      0, 0, height_m, height_m;
  panel.edges.resize(4);
  panel.placement.translate(Eigen::Vector3d(0, -distance_m, 0));
  panel.placement.rotate(Eigen::AngleAxisd(0.5 * 3.14159265358979323846, Eigen::Vector3d::UnitX()));
  return panel;
}

inline Pattern pattern_of(std::vector<Panel> panels) {
  Pattern pattern;
  pattern.name = "test";
  pattern.panels = std::move(panels);
  pattern.fabrics = {"cloth"};
  return pattern;
}

inline Seam seam(int panel, int edge, int other_panel, int other_edge) {
  Seam seam;
  seam.sides = {SeamSide{panel, {edge}}, SeamSide{other_panel, {other_edge}}};
  return seam;
}

/// Two rectangles, before and behind the z axis, sewn at both sides into a tube of girth 2 width.
inline Pattern tube(double width_m, double height_m, double distance_m) {
  Panel front = rectangle(width_m, height_m, distance_m), back = front;
  front.name = "front";
  back.name = "back";
  back.placement = Eigen::AngleAxisd(3.14159265358979323846, Eigen::Vector3d::UnitZ()) *
                   Eigen::Isometry3d(front.placement);
  Pattern pattern = pattern_of({front, back});
  pattern.seams = {seam(0, 1, 1, 3), seam(0, 3, 1, 1)};
  return pattern;
}

}  // namespace clothfit
