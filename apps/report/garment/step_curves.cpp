#include "apps/report/garment/step_curves.h"

#include <array>
#include <optional>
#include <utility>

#include "apps/report/page/svg.h"

namespace clothfit {
namespace {

LinePlot plot_of(StepQuantity quantity) {
  LinePlot plot;
  switch (quantity) {
    case StepQuantity::spring_error:
      plot.title = "Average spring error";
      plot.y_label = "average spring error (cm)";
      break;
    case StepQuantity::energy:
      plot.title = "Energy";
      plot.y_label = "energy above that at rest (J)";
      plot.log_y = true;
      break;
    case StepQuantity::force:
      plot.title = "Residual force";
      plot.y_label = "residual force / weight";
      plot.log_y = true;
      break;
  }
  plot.description = plot.title + " against time, a curve for each way to rest.";
  return plot;
}

double value_of(StepQuantity quantity, const GarmentStep& step, const GarmentStep& last) {
  switch (quantity) {
    case StepQuantity::spring_error:
      return 100 * step.spring_error_m;
    case StepQuantity::energy:
      return step.energy_j - last.energy_j;
    case StepQuantity::force:
      break;
  }
  return step.imbalance;
}

}  // namespace

std::string step_curves(const std::vector<StepCurve>& curves, StepQuantity quantity,
                        const std::string& since) {
  constexpr std::array kColours{"#1b6ca8", "#d1495b", "#2a9d57", "#8a5fb0", "#c98a1b"};
  constexpr std::array kDashes{"", "6 3", "2 3", "8 3 2 3", "4 2"};
  if (curves.empty()) return "";
  LinePlot plot = plot_of(quantity);
  plot.x_label = "seconds since " + since;
  for (const StepCurve& curve : curves) {
    const size_t look = plot.series.size() % kColours.size();
    Series series{.label = curve.label,
                  .x = {},
                  .y = {},
                  .style = {.colour = kColours[look], .dashes = kDashes[look]}};
    for (const GarmentStep& step : *curve.steps) {
      series.x.push_back(step.seconds);
      series.y.push_back(value_of(quantity, step, curve.steps->back()));
    }
    plot.series.push_back(std::move(series));
  }
  return line_plot(plot);
}

}  // namespace clothfit
