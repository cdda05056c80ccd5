#include "apps/report/page/wireframe.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "apps/report/page/svg_parts.h"

namespace clothfit {
namespace {

/// Returns rows to the right, down the page, and towards the viewer.
Eigen::Matrix3d page_from_world(const Viewpoint& from) {
  const double ca = std::cos(from.azimuth_rad), sa = std::sin(from.azimuth_rad);
  const double ce = std::cos(from.elevation_rad), se = std::sin(from.elevation_rad);
  const Eigen::Vector3d towards_viewer(sa * ce, -ca * ce, se);
  const Eigen::Vector3d right(ca, sa, 0);
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), -towards_viewer.cross(right).transpose(),
      towards_viewer.transpose();
  return rotation;
}

struct Face {
  std::array<Eigen::Index, 4> corner;
  double depth = 0;
};

/// Returns quadrilaterals between neighbouring threads, the farthest first.
std::vector<Face> faces_from_far(const Wireframe& cloth, const Eigen::Matrix3Xd& on_page) {
  std::vector<Face> faces;
  for (int row = 0; row + 1 < cloth.rows; ++row)
    for (int column = 0; column + 1 < cloth.columns; ++column) {
      const Eigen::Index v = static_cast<Eigen::Index>(row) * cloth.columns + column;
      Face face{{v, v + 1, v + 1 + cloth.columns, v + cloth.columns}};
      for (const Eigen::Index corner : face.corner) face.depth += on_page(2, corner);
      faces.push_back(face);
    }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const Face& a, const Face& b) { return a.depth < b.depth; });
  return faces;
}

}  // namespace

std::string wireframes(const Wireframes& figure) {
  constexpr double kWidth = 800, kTitleRoom = 24, kNoteRoom = 22, kMargin = 8;
  const Eigen::Matrix3d rotation = page_from_world(figure.viewpoint);
  std::vector<Eigen::Matrix3Xd> on_page;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(INFINITY), high = -low;
  for (const Wireframe& cloth : figure.cloths) {
    on_page.push_back(rotation * cloth.position_m);
    low = low.cwiseMin(on_page.back().topRows<2>().rowwise().minCoeff());
    high = high.cwiseMax(on_page.back().topRows<2>().rowwise().maxCoeff());
  }
  const double panel_width = kWidth / figure.columns;
  const double extent_m = std::max(1e-9, high[0] - low[0]);
  const double scale =
      std::min((panel_width - 2 * kMargin) / extent_m, 320 / std::max(1e-9, high[1] - low[1]));
  const double panel_height = scale * (high[1] - low[1]) + kTitleRoom + kNoteRoom;

  std::string body;
  for (size_t n = 0; n < figure.cloths.size(); ++n) {
    const Wireframe& cloth = figure.cloths[n];
    const auto column = static_cast<double>(n % static_cast<size_t>(figure.columns));
    const auto row = static_cast<double>(n / static_cast<size_t>(figure.columns));
    const double middle = panel_width * (column + 0.5);
    const double top = panel_height * row;
    body += text_at(middle, top + 15, cloth.title, "middle");
    body += "<g fill=\"#fff\" stroke=\"#1f4e79\" stroke-width=\".7\" stroke-linejoin=\"round\">\n";
    for (const Face& face : faces_from_far(cloth, on_page[n])) {
      std::string path;
      for (const Eigen::Index corner : face.corner)
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L",
                            middle + scale * (on_page[n](0, corner) - 0.5 * (low[0] + high[0])),
                            top + kTitleRoom + scale * (on_page[n](1, corner) - low[1]));
      body += "<path d=\"" + path + "Z\"/>\n";
    }
    body += "</g>\n" + text_at(middle, top + panel_height - 8, cloth.note, "middle", kSoft);
  }
  const double rows = std::ceil(static_cast<double>(figure.cloths.size()) / figure.columns);
  return open_svg(kWidth, panel_height * rows, figure.title, figure.description) + body +
         "</svg>\n";
}

}  // namespace clothfit
