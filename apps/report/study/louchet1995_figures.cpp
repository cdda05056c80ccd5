#include "apps/report/study/louchet1995_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/report/page/heat_map.h"
#include "apps/report/page/svg.h"
#include "apps/report/page/wireframe.h"
#include "apps/report/study/louchet1995_tables.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

const std::array<LineStyle, 5> kStyles{{{"#1f4e79", ""},
                                        {"#c8553d", "6 3"},
                                        {"#3a7d44", "2 3"},
                                        {"#8a5a9e", "8 3 2 3"},
                                        {"#b58900", "1 3"}}};

/// The curves of the searches are cut off here. The limits are the race of the small populations,
/// and a cost below which only rounding can improve.
constexpr double kMostAsked = 12500;
constexpr double kLowestShown = 1e-8;

constexpr std::array kShortNames{"l01", "l23", "l45", "K", "tau"};

Wireframe cloth_of(const Louchet1995Study& study, const RecordedStates& states, int state,
                   const std::string& title, const std::string& note) {
  const int side = study.experiment.vertices_per_side;
  return {.title = title,
          .note = note,
          .columns = side,
          .rows = side,
          .position_m = states.position_m[static_cast<size_t>(state)]};
}

}  // namespace

std::string hanging_cloth_svg(const Louchet1995Study& study) {
  Wireframes figure{.title = "The cloth of the experiment",
                    .description = "The reference cloth at the start, half way and at the end.",
                    .columns = 3};
  for (const int state : {0, study.original.last() / 2, study.original.last()})
    figure.cloths.push_back(
        cloth_of(study, study.original, state,
                 fmt::format("{:.2f} s", study.original.time_s[static_cast<size_t>(state)]), ""));
  return wireframes(figure);
}

std::string landscapes_svg(const Louchet1995Study& study, double reference_elongation) {
  HeatMaps figure{.title = "Cost landscapes",
                  .description = "Both costs over stiffness and critical elongation.",
                  .x_label = "K (N/m)",
                  .y_label = "tau",
                  .value_label = "cost (m²)",
                  .log_x = true};
  for (const CostLandscape& map : study.landscapes) {
    if (map.reference_elongation != reference_elongation) continue;
    // At the reference itself the cost is 0 and has no logarithm.
    const auto [i, j] = map.lowest();
    HeatMap panel{.title = fmt::format("{} cost", to_string(map.cost)),
                  .x = map.stiffness_n_per_m,
                  .y = map.elongation,
                  .value = map.value_m2};
    const double k = study.experiment.reference.stiffness_n_per_m;
    panel.marks.push_back({.x = k, .y = reference_elongation, .label = "reference"});
    panel.marks.push_back({.x = map.stiffness_n_per_m[static_cast<size_t>(i)],
                           .y = map.elongation[static_cast<size_t>(j)],
                           .filled = true,
                           .label = "lowest"});
    figure.maps.push_back(panel);
  }
  return heat_maps(figure);
}

std::string reconstructions_svg(const Louchet1995Study& study) {
  Wireframes figure{.title = "Original and reconstructions",
                    .description =
                        "Rows: instants. Left: the original; middle and right: the "
                        "reconstructions from the printed good and bad individuals.",
                    .columns = 3};
  const int last = study.original.last();
  for (const int state : {last / 2, last * 3 / 4, last}) {
    const double time_s = study.original.time_s[static_cast<size_t>(state)];
    figure.cloths.push_back(
        cloth_of(study, study.original, state, fmt::format("original, {:.2f} s", time_s), ""));
    for (size_t n = 0; n < 2; ++n) {
      const Reconstruction& one = study.reconstructions[n];
      const Eigen::Matrix3Xd difference = one.states.position_m[static_cast<size_t>(state)] -
                                          study.original.position_m[static_cast<size_t>(state)];
      const double rms_m =
          std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
      figure.cloths.push_back(cloth_of(study, one.states, state, one.name,
                                       fmt::format("off by {:.0f} mm (rms)", 1000 * rms_m)));
    }
  }
  return wireframes(figure);
}

std::string distances_svg(const Louchet1995Study& study) {
  LinePlot plot{.title = "Distance of the reconstructions from the original",
                .description = "Root mean square distance of vertices over the motion.",
                .x_label = "time (s)",
                .y_label = "rms distance (mm)",
                .log_y = true};
  for (size_t n = 0; n < study.reconstructions.size(); ++n) {
    const Reconstruction& one = study.reconstructions[n];
    Series series{.label = one.name, .x = {}, .y = {}, .style = kStyles[n % kStyles.size()]};
    for (size_t state = 0; state < study.original.time_s.size(); ++state) {
      const Eigen::Matrix3Xd difference =
          one.states.position_m[state] - study.original.position_m[state];
      const double rms_m =
          std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
      if (rms_m < 1e-5) continue;
      series.x.push_back(study.original.time_s[state]);
      series.y.push_back(1000 * rms_m);
    }
    plot.series.push_back(series);
  }
  return line_plot(plot);
}

std::string cost_distribution_svg(const Louchet1995Study& study) {
  LinePlot plot{.title = "Final costs over the seeds",
                .description = "Costs sorted; how many seeds end below a cost.",
                .x_label = "share of the seeds (%)",
                .y_label = "cost (m²)",
                .log_y = true};
  const auto add = [&](const std::string& label, const auto& trials, const auto& pick) {
    Series series{
        .label = label, .x = {}, .y = {}, .style = kStyles[plot.series.size() % kStyles.size()]};
    for (const auto& trial : trials) series.y.push_back(pick(trial).cost);
    std::sort(series.y.begin(), series.y.end());
    for (size_t n = 0; n < series.y.size(); ++n)
      series.x.push_back(100.0 * static_cast<double>(n + 1) / static_cast<double>(series.y.size()));
    plot.series.push_back(series);
  };
  const auto listed = [](const auto& trial) -> const Individual& {
    return trial.recovery.listed.front();
  };
  const auto last = [](const auto& trial) -> const Individual& { return trial.recovery.strategy; };
  add("small, 49 generations", study.five.trials, listed);
  add("small, at the end", study.five.trials, last);
  add("18 parameters, at the end", study.eighteen.trials, last);
  return line_plot(plot);
}

std::string races_svg(const Louchet1995Study& study) {
  LinePlot plot{.title = "How the searches fall",
                .description =
                    "Median over the seeds of the best cost, relative to a random "
                    "individual's.",
                .x_label = "costs asked for",
                .y_label = "relative cost",
                .log_y = true};
  for (const RaceResults& results : study.races) {
    Series series{.label = to_string(results.racer),
                  .x = {},
                  .y = {},
                  .style = kStyles[plot.series.size() % kStyles.size()]};
    size_t points = SIZE_MAX;
    for (const Race& race : results.races) points = std::min(points, race.evaluations.size());
    for (size_t k = 0; k < points; ++k) {
      std::vector<double> at_once, asked;
      for (const Race& race : results.races) {
        at_once.push_back(race.relative_cost[k]);
        asked.push_back(static_cast<double>(race.evaluations[k]));
      }
      if (quantile(asked, 0.5) > kMostAsked || quantile(at_once, 0.5) < kLowestShown) break;
      series.x.push_back(quantile(asked, 0.5));
      series.y.push_back(quantile(at_once, 0.5));
    }
    plot.series.push_back(series);
  }
  return line_plot(plot);
}

std::string places_svg(const Louchet1995Study& study) {
  LinePlot plot{.title = "What one transition tells, along the motion",
                .description = "Relative sigma of each parameter from a single transition.",
                .x_label = "time of the transition (s)",
                .y_label = "relative sigma (%)",
                .log_y = true};
  for (size_t p = 0; p < kShortNames.size(); ++p) {
    Series series{.label = kShortNames[p], .x = {}, .y = {}, .style = kStyles[p]};
    for (const PlaceInMotion& place : study.places) {
      series.x.push_back(place.time_s);
      series.y.push_back(100 * place.relative_sigma[static_cast<Eigen::Index>(p)]);
    }
    plot.series.push_back(series);
  }
  return line_plot(plot);
}

}  // namespace clothfit
