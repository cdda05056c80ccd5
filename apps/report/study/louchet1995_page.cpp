#include "apps/report/study/louchet1995_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/page/html.h"
#include "apps/report/study/louchet1995_figures.h"
#include "apps/report/study/louchet1995_tables.h"
#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

/// Puts cells that a clock measured into elements of their own.
std::string with_measured_cells(std::string html) {
  const std::string mark = ">measured: ";
  for (size_t at = html.find(mark); at != std::string::npos; at = html.find(mark, at)) {
    const size_t end = html.find('<', at);
    const std::string text = html.substr(at + mark.size(), end - at - mark.size());
    const std::string marked = "><span class=\"measured\">" + text + "</span>";
    html.replace(at, end - at, marked);
    at += marked.size();
  }
  return html;
}

std::string setting_section(const Louchet1995Study& study) {
  const PaperExperiment& experiment = study.experiment;
  const ListingMatch& match = study.full_match;
  std::string content = paragraph(
      "The paper states the cloth (17 x 17 equal masses held at two corners, natural lengths, "
      "K = 4, tau = 0.5), the scheme and the search. It does not state masses, time step, "
      "duration, damping, how the cloth is let go, or which of two readings of its strain limit "
      "is meant. It prints the costs of 20 individuals: those choose among settings here.");
  content += paragraph(fmt::format(
      "Taken for all that follows: {} kg a vertex, steps of {} s for {} s, damping {} 1/s, let go "
      "{}, with the limit's rates {}. Its full cost, in m² as the paper's formula has it, is the "
      "printed one times {} with a spread of {} in the logarithm over the 20 individuals: {} "
      "away without a free factor. Its small cost is {} times the printed one. The listing was "
      "printed from the full cost, it seems.",
      experiment.vertex_mass_kg, experiment.time_step_s, experiment.duration_s,
      experiment.damping_per_s, experiment.release == PaperRelease::level ? "level" : "upright",
      experiment.limit == StrainLimitMode::rates_first ? "computed first" : "computed in turn",
      significant(match.factor, 3), significant(match.spread, 2), significant(match.distance(), 2),
      significant(study.small_match.factor, 2)));
  content += html_table(
      nearest_settings_table(study),
      "The nearest settings: of each reading and cost three grid points and what CMA-ES made of "
      "the best. Distance: root mean square of log(our cost / printed cost). Factor and spread: "
      "the mean of that ratio, and the residual about it. Overshoot: largest deformation rate at "
      "the end over tau; settings above 3 are left out. Off: how far the printed good and bad "
      "individuals run from the original, in l01; the paper says about 0.05 and slightly less "
      "than half.");
  content += paragraph(
      "The listing alone does not fix the setting: several come about as near. The one taken is "
      "the "
      "nearest point of the whole grid; what follows holds for it.");
  return content;
}

std::string landscape_section(const Louchet1995Study& study) {
  std::string content = paragraph(
      "The paper's figures 3 and 4 show both costs over K and tau, natural lengths at their "
      "reference. It finds the small cost accurate without noise and very sensitive to tau.");
  for (const double elongation : {0.1, 0.5})
    content += figure(
        landscapes_svg(study, elongation),
        fmt::format("Figure {} again: K = 4, tau = {}. The ring is the reference, the dot the "
                    "lowest place of the grid; there the cost is 0 (white). Each map has its own "
                    "colours; the full cost is summed over {} of the transitions.",
                    elongation < 0.3 ? 3 : 4, elongation, study.landscapes.front().transitions));
  return content + html_table(landscape_table(study), "");
}

std::string listing_section(const Louchet1995Study& study) {
  return paragraph(fmt::format(
             "The paper prints the ten best of 100 individuals after 49 generations, in a good "
             "and in a bad situation. Ours: the strategy to the letter, on the full cost over {} "
             "of its transitions (times {} to compare); the seeds with the lowest and with the "
             "highest best cost of {}.",
             study.full_cost_transitions,
             significant(static_cast<double>(study.original.last()) / study.full_cost_transitions,
                         3),
             study.full_cost.size())) +
         html_table(listing_table(study, false), "The good situation.") +
         html_table(listing_table(study, true), "The bad situation.");
}

std::string success_section(const Louchet1995Study& study) {
  const size_t count = study.five.trials.size();
  const auto trapped =
      std::count_if(study.five.trials.begin(), study.five.trials.end(),
                    [](const RecoveryTrial& trial) { return trial.recovery.refinements > 1; });
  const auto searched_again =
      std::count_if(study.five.trials.begin(), study.five.trials.end(),
                    [](const RecoveryTrial& trial) { return trial.recovery.searches > 1; });
  std::string content = paragraph(
      "The paper sees convergence after 50 to 100 generations in most cases, sometimes a local "
      "minimum, and advises to refine with a local method afterwards.");
  content += html_table(success_table(study), "");
  content += figure(cost_distribution_svg(study),
                    "Best costs of the strategy alone on the small cost, sorted over the seeds.");
  content += paragraph(fmt::format(
      "Followed by Levenberg-Marquardt with exact derivatives on the same small cost: {} of {} "
      "seeds recover all five parameters within 1e-6 (worst {}). The best individual alone led "
      "into a local minimum for {} of the {} seeds, and another of the population had to start; "
      "{} seeds needed the strategy once more.",
      recovered_five(study, 1e-6), count,
      significant(std::max_element(study.five.trials.begin(), study.five.trials.end(),
                                   [](const RecoveryTrial& a, const RecoveryTrial& b) {
                                     return a.error < b.error;
                                   })
                      ->error,
                  2),
      trapped, count, searched_again));
  std::string undetermined;
  int determined = 0;
  for (Eigen::Index p = 0; p < study.eighteen.truth.size(); ++p) {
    if (study.eighteen.determined(p)) {
      ++determined;
      continue;
    }
    undetermined +=
        (undetermined.empty() ? "" : ", ") + study.eighteen.names[static_cast<size_t>(p)];
  }
  content += paragraph(fmt::format(
      "All 18 parameters: {} of {} seeds bring every determined one within 1e-4. Measured with 1 "
      "mm of noise at 60 Hz, the motion determines {} of the 18 to better than 10 %; "
      "undetermined: {}.",
      recovered_eighteen(study, 1e-4), study.eighteen.trials.size(), determined,
      undetermined.empty() ? "none" : undetermined));
  return content +
         html_table(eighteen_table(study),
                    "The 18 parameters. Sigma: Fisher information at the truth of all vertices' "
                    "positions at 60 Hz with 1 mm of noise; errors: without noise.");
}

double median_generations(const Louchet1995Study& study, Racer racer, size_t mark, bool asked) {
  for (const RaceResults& results : study.races) {
    if (results.racer != racer) continue;
    std::vector<double> values;
    for (const Race& race : results.races)
      values.push_back(race.generations[mark] < 0 ? INFINITY
                       : asked                    ? static_cast<double>(race.costs_asked[mark])
                                                  : race.generations[mark]);
    return quantile(values, 0.5);
  }
  return INFINITY;
}

std::string or_never(double value) {
  return std::isfinite(value) ? fmt::format("{:.0f}", value) : "not within the race";
}

std::string claims_section(const Louchet1995Study& study) {
  constexpr size_t kMark = 2;
  std::string content = paragraph(
      "The paper expects (of [L94]) that the generations needed do not depend on the number of "
      "parameters, and that the cost of calculation is about proportional to it.");
  content += paragraph(fmt::format(
      "Median generations until a relative cost of {}: with 5 parameters {}; with 18 {}; with 18 "
      "and as many individuals for each parameter as 5 have, {}. Costs asked for: {}; {}; {}. "
      "CMA-ES: {} with 5, {} with 18.",
      significant(kRaceMarks[kMark], 1),
      or_never(median_generations(study, Racer::strategy_5, kMark, false)),
      or_never(median_generations(study, Racer::strategy_18, kMark, false)),
      or_never(median_generations(study, Racer::strategy_18_large, kMark, false)),
      or_never(median_generations(study, Racer::strategy_5, kMark, true)),
      or_never(median_generations(study, Racer::strategy_18, kMark, true)),
      or_never(median_generations(study, Racer::strategy_18_large, kMark, true)),
      or_never(median_generations(study, Racer::cma_5, kMark, true)),
      or_never(median_generations(study, Racer::cma_18, kMark, true))));
  content += figure(
      races_svg(study),
      "Median best cost, relative to the median of 100 random individuals; cut off below 1e-8.");
  content += html_table(race_table(study),
                        "Medians (quartiles) over the seeds; one that was not reached counts as "
                        "endless.");
  content += paragraph(
      "The paper: the small cost should do with any position of the cloth, except the first, in "
      "which all springs have their natural length.");
  content += figure(places_svg(study),
                    "Relative sigma from one transition whose states are measured with 1 mm of "
                    "noise. Where a line is missing, nothing bounds the parameter.");
  return content + html_table(place_table(study),
                              "Recovered: all five parameters within 1e-6, from this transition "
                              "alone (strategy and refinement, two runs at most).");
}

std::string motion_section(const Louchet1995Study& study) {
  const Reconstruction& good = study.reconstructions[0];
  const Reconstruction& bad = study.reconstructions[1];
  const double length_m = study.experiment.reference.natural_length_01_m;
  std::string content = figure(hanging_cloth_svg(study),
                               "Figure 2 again: the reference cloth (K = 4, tau = 0.5), seen from "
                               "slightly above.");
  content += paragraph(fmt::format(
      "Of its good case the paper says that the error is about one twentieth of the springs' "
      "natural length, of the bad one slightly less than half. The printed individuals, "
      "run freely from the start, are off by {} and {} natural lengths here; these words took no "
      "part in the scan.",
      significant(good.rms_m / length_m, 2), significant(bad.rms_m / length_m, 2)));
  content += figure(
      reconstructions_svg(study),
      fmt::format("Figure 5 again. Left: original; middle: printed good (K = {}, full cost {} m²); "
                  "right: printed bad (K = {}, full cost {} m²).",
                  significant(good.set.stiffness_n_per_m, 4), significant(good.cost_m2, 2),
                  significant(bad.set.stiffness_n_per_m, 4), significant(bad.cost_m2, 2)));
  content += figure(distances_svg(study), "Distance of the reconstructions from the original.");
  return content + html_table(reconstruction_table(study),
                              "Root mean square distance of vertices over the whole motion. Ours: "
                              "the strategy alone after 49 generations, on the full cost.");
}

}  // namespace

std::string louchet1995_page_html(const Louchet1995Study& study, const Louchet1995Options& options,
                                  const std::string& command, const std::string& version) {
  std::string body = fmt::format(
      "<h1>Evolutionary identification of cloth animation models, 1995, again</h1>\n"
      "<p class=\"meta\">clothfit {} · {} seeds from {}, comparisons over {}{}</p>\n",
      escape_xml(version), options.seeds, options.seed, options.compared_seeds(),
      options.quick ? " · QUICK: coarse grids and short searches, not the experiment itself" : "");
  body += section("Targets", with_measured_cells(html_table(target_table(study), "")));
  body += section("The setting", setting_section(study));
  body += section("Cost landscapes", landscape_section(study));
  body += section("The listing", listing_section(study));
  body += section("How often it succeeds", success_section(study));
  body += section("What the paper expects", claims_section(study));
  body += section("The motion", motion_section(study));
  body += section(
      "Do it again",
      fmt::format("<pre>{}</pre>\n<p>The same options give the same bytes for any number of "
                  "threads, interrupted or not, but for the seconds: those stand in timing.csv "
                  "and in elements of class “measured” of this page alone. Every figure and "
                  "table has its CSV file beside it.</p>\n",
                  escape_xml(command)));
  return html_page("clothfit: the experiment of 1995", body);
}

}  // namespace clothfit
