#include "apps/report/fit/fit_figures.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "apps/report/fit/fit_tables.h"
#include "apps/report/page/html.h"
#include "apps/report/page/svg.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

/// A range of values this many times as wide as its lowest value is drawn on a log axis.
constexpr double kLogFrom = 30;

bool wants_log_axis(const std::vector<Series>& series) {
  double low = std::numeric_limits<double>::infinity();
  double high = 0;
  for (const Series& one : series) {
    for (const double y : one.y) {
      if (!std::isfinite(y) || y <= 0) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  return high > kLogFrom * low;
}

struct MeanSquare {
  double sum = 0;
  int count = 0;
  void add(const Eigen::VectorXd& residual) {
    sum += residual.squaredNorm();
    count += static_cast<int>(residual.size());
  }
  double rms() const { return std::sqrt(sum / count); }
};

/// The errors of each marker over the fitted and over the held-out frames.
struct MarkerErrors {
  std::map<int, MeanSquare> fitted, held_out;
};

MarkerErrors marker_errors(const FitReport::Residuals& residuals) {
  MarkerErrors errors;
  for (const FitReport::Residuals::Row& row : residuals.rows)
    (row.held_out ? errors.held_out : errors.fitted)[row.marker].add(row.predicted - row.observed);
  return errors;
}

/// Returns the first held-out frame of the residuals; nothing when none is.
std::optional<int> first_held_out(const FitReport::Residuals& residuals) {
  std::optional<int> first;
  for (const FitReport::Residuals::Row& row : residuals.rows)
    if (row.held_out) first = std::min(first.value_or(row.frame), row.frame);
  return first;
}

/// Two axes to look along, as an onlooker sees the points. One is up against gravity, the other
/// across where the points spread most.
struct View {
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

View choose_view(const std::vector<const FitReport::Residuals::Row*>& rows,
                 const Eigen::Vector3d& gravity) {
  View view;
  if (gravity.norm() > 0) view.up = -gravity.normalized();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto* row : rows) mean += row->observed.head<3>();
  mean /= static_cast<double>(rows.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto* row : rows) {
    const Eigen::Vector3d from_mean = row->observed.head<3>() - mean;
    const Eigen::Vector3d level = from_mean - from_mean.dot(view.up) * view.up;
    scatter += level * level.transpose();
  }
  view.across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  // An eigenvector's sign means nothing: it is made to point to +x, or +y.
  const double sign = std::abs(view.across.x()) > 1e-6 ? view.across.x() : view.across.y();
  if (sign < 0) view.across = -view.across;
  return view;
}

/// Chooses the magnification that makes the median residual some 9 px long on the page. It is 1, 2
/// or 5 times a power of ten, at least 1.
double choose_magnification(const std::vector<PointPair>& points, double page_px_per_unit) {
  std::vector<double> length;
  for (const PointPair& point : points) {
    const double size =
        std::hypot(point.predicted_x - point.observed_x, point.predicted_y - point.observed_y);
    if (std::isfinite(size)) length.push_back(size);
  }
  if (length.empty()) return 1;
  std::nth_element(length.begin(), length.begin() + static_cast<std::ptrdiff_t>(length.size() / 2),
                   length.end());
  const double median_px = length[length.size() / 2] * page_px_per_unit;
  if (!(median_px > 0)) return 1;
  const double wanted = std::clamp(9 / median_px, 1.0, 1000.0);
  double best = 1;
  for (double power = 1; power <= 1000; power *= 10) {
    for (const double factor : {1.0, 2.0, 5.0})
      if (power * factor <= wanted) best = power * factor;
  }
  return best;
}

}  // namespace

std::string residual_over_time_svg(const FitReport::Residuals& residuals,
                                   const ObservationErrors& errors, const Recording& recording) {
  const ShownUnit unit = shown_unit(residuals.unit);
  const auto series = [&](const std::string& label, const std::vector<double>& by_frame,
                          const LineStyle& style) {
    Series result;
    result.label = label;
    result.style = style;
    for (size_t frame = 0; frame < by_frame.size(); ++frame) {
      result.x.push_back(recording.frame_time_s(static_cast<int>(frame)));
      result.y.push_back(by_frame[frame] * unit.factor);
    }
    return result;
  };
  LinePlot plot;
  plot.title = "Residual over time, " + kind_title(residuals.kind, residuals.unit);
  plot.description = fmt::format(
      "rms residual per frame: {} {} over the fitted frames, {} {} over the held-out ones.",
      significant(errors.fitted.rms * unit.factor, 3), unit.name,
      significant(errors.held_out.rms * unit.factor, 3), unit.name);
  plot.x_label = "time (s)";
  plot.y_label = fmt::format("rms per coordinate ({})", unit.name);
  plot.series = {
      series("model", residuals.rms_by_frame, {"#1f4e79", "", 2.4}),
      series("stays as in frame 0", residuals.first_frame_by_frame, {"#b35806", "7 4", 1.5}),
      series("moves on with its last velocity", residuals.last_velocity_by_frame,
             {"#7b5aa6", "2 3", 1.7}),
      series("moves rigidly with its held points", residuals.rigid_by_frame,
             {"#1b7837", "9 3 2 3", 1.5})};
  std::erase_if(plot.series, [](const Series& one) {
    return std::none_of(one.y.begin(), one.y.end(), [](double y) { return std::isfinite(y); });
  });
  plot.log_y = wants_log_axis(plot.series);
  if (const std::optional<int> first = first_held_out(residuals)) {
    plot.band = Band{recording.frame_time_s(*first), std::numeric_limits<double>::infinity(),
                     "held out: no fit saw these frames"};
  }
  if (errors.noise > 0) plot.level = Level{errors.noise * unit.factor, "noise"};
  return line_plot(plot);
}

double largest_marker_rms(const FitReport::Residuals& residuals) {
  const MarkerErrors errors = marker_errors(residuals);
  double largest = 0;
  for (const auto* by_marker : {&errors.fitted, &errors.held_out})
    for (const auto& [marker, mean_square] : *by_marker)
      largest = std::max(largest, mean_square.rms());
  return largest * shown_unit(residuals.unit).factor;
}

std::string residual_map_svg(const FitReport::Residuals& residuals, const Recording& recording,
                             double largest) {
  const ShownUnit unit = shown_unit(residuals.unit);
  const auto [fitted, held_out] = marker_errors(residuals);
  ClothMaps maps;
  maps.largest = largest;
  maps.title = "Residual over the cloth, " + kind_title(residuals.kind, residuals.unit);
  maps.width_m = recording.cloth.width_m;
  maps.height_m = recording.cloth.height_m;
  maps.value_label = fmt::format("rms ({})", unit.name);
  const auto add = [&](const std::string& title, const std::map<int, MeanSquare>& by_marker) {
    if (by_marker.empty()) return;
    ClothMap map;
    map.title = title;
    const ClothValue* worst = nullptr;
    for (const auto& [index, mean_square] : by_marker) {
      const Marker& marker = recording.markers.markers[static_cast<size_t>(index)];
      const double rms = mean_square.rms() * unit.factor;
      map.values.push_back({marker.s_m, marker.t_m, rms,
                            fmt::format("{}: {} {}", marker.name, significant(rms, 3), unit.name)});
    }
    for (const ClothValue& value : map.values)
      if (worst == nullptr || value.value > worst->value) worst = &value;
    maps.description +=
        fmt::format("{}: largest at s = {} m, t = {} m ({}). ", title, significant(worst->s, 3),
                    significant(worst->t, 3), worst->label);
    maps.maps.push_back(std::move(map));
  };
  add("fitted frames", fitted);
  add("held-out frames", held_out);
  return maps.maps.empty() ? "" : cloth_maps(maps);
}

std::string observed_and_predicted_svg(const FitReport::Residuals& residuals,
                                       const Recording& recording,
                                       const std::vector<BackgroundPicture>& pictures) {
  const int frame = overlay_frame(residuals);
  std::vector<const FitReport::Residuals::Row*> rows;
  for (const FitReport::Residuals::Row& row : residuals.rows)
    if (row.frame == frame) rows.push_back(&row);
  if (rows.empty()) return "";

  PointOverlay overlay;
  overlay.title =
      fmt::format("Observed and predicted markers in frame {}, {}", frame, residuals.kind);
  overlay.description = fmt::format("{} markers, {}.", rows.size(),
                                    rows.front()->held_out ? "held out from the fit" : "fitted");
  const bool spatial = rows.front()->observed.size() == 3;
  const View view = spatial ? choose_view(rows, recording.gravity_m_per_s2) : View{};
  const auto on_page = [&](const Eigen::VectorXd& point) -> Eigen::Vector2d {
    if (!spatial) return point.head<2>();
    const Eigen::Vector3d place = point.head<3>();
    return {place.dot(view.across), -place.dot(view.up)};
  };
  for (const auto* row : rows) {
    const Eigen::Vector2d observed = on_page(row->observed);
    const Eigen::Vector2d predicted = on_page(row->predicted);
    const Marker& marker = recording.markers.markers[static_cast<size_t>(row->marker)];
    const ShownUnit unit = shown_unit(residuals.unit);
    overlay.points.push_back(
        {observed.x(), observed.y(), predicted.x(), predicted.y(),
         fmt::format("{}: {} {}", marker.name,
                     significant((row->predicted - row->observed).norm() * unit.factor, 3),
                     unit.name)});
  }

  const auto picture =
      std::find_if(pictures.begin(), pictures.end(), [&](const BackgroundPicture& one) {
        return one.kind == residuals.kind && one.frame == frame;
      });
  Eigen::AlignedBox2d box;
  for (const PointPair& point : overlay.points)
    box.extend(Eigen::Vector2d(point.observed_x, point.observed_y));
  const double margin = 0.08 * box.diagonal().norm() + 1e-9;
  // A hanging strip would fill pages. The box is four wide to three high at most, the points in its
  // middle.
  const double widen = std::max(0.0, 2 * box.sizes().y() / 3 - box.sizes().x() / 2);
  const Eigen::Vector2d border(margin + widen, margin);
  box = Eigen::AlignedBox2d(box.min() - border, box.max() + border);
  if (picture != pictures.end()) {
    // OpenCV's pixel (0, 0) is a pixel's centre; the picture begins half a pixel before it.
    overlay.picture_left = overlay.picture_top = -0.5;
    overlay.picture_width = picture->width;
    overlay.picture_height = picture->height;
    overlay.picture_uri = data_uri("image/jpeg", picture->jpeg);
    const Eigen::Vector2d first(-0.5, -0.5);
    box = box.intersection(
        Eigen::AlignedBox2d(first, first + Eigen::Vector2d(picture->width, picture->height)));
  }
  overlay.left = box.min().x();
  overlay.top = box.min().y();
  overlay.width = box.sizes().x();
  overlay.height = box.sizes().y();
  overlay.magnification = choose_magnification(overlay.points, 800 / overlay.width);
  return point_overlay(overlay);
}

std::string search_cost_svg(const std::vector<double>& cost) {
  if (cost.size() < 2) return "";
  Series best;
  best.label = "best individual";
  best.style = {"#1f4e79", "", 2};
  for (size_t generation = 0; generation < cost.size(); ++generation) {
    best.x.push_back(static_cast<double>(generation));
    best.y.push_back(cost[generation]);
  }
  LinePlot plot;
  plot.title = "Cost of the best individual over the generations of the search";
  plot.description = fmt::format("From {} in the first generation to {} in the last.",
                                 significant(cost.front(), 3), significant(cost.back(), 3));
  plot.x_label = "generation";
  plot.y_label = "best cost";
  plot.series = {std::move(best)};
  plot.log_y = wants_log_axis(plot.series);
  return line_plot(plot);
}

}  // namespace clothfit
