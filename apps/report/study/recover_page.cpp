#include "apps/report/study/recover_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/report/page/html.h"
#include "apps/report/page/svg.h"
#include "apps/report/study/recover_tables.h"

namespace clothfit {
namespace {

/// Draws sorted errors over the fit's own sigmas against those of normal ones. Honest sigmas lie on
/// the diagonal.
std::string pulls_svg(const RecoverResult& result) {
  LinePlot plot{.title = "Errors over their sigma",
                .description =
                    "Sorted errors of each parameter, in units of the noise sigma that "
                    "the fit stated, against the quantiles of the normal distribution.",
                .x_label = "normal quantile",
                .y_label = "(estimate − truth) / sigma",
                .series = {},
                .band = std::nullopt,
                .level = std::nullopt};
  const char* const colours[] = {"#1b6ca8", "#d1495b", "#2a9d57", "#8a5fb0",
                                 "#c98a1b", "#3a3a3a", "#6aa5a9", "#b0607f"};
  const char* const dashes[] = {"", "6 3", "2 3", "8 3 2 3", "4 2", "1 3", "10 4", "3 5"};
  size_t number = 0;
  for (const RecoverySummary& parameter : result.parameters) {
    std::vector<double> pulls;
    for (const RecoverTrial& trial : result.trials)
      for (const RecoveredParameter& p : trial.parameters)
        if (p.name == parameter.name && !p.undetermined)
          pulls.push_back((p.estimate - p.truth) / p.noise_sigma);
    if (pulls.size() < 3) continue;
    std::ranges::sort(pulls);
    Series series{.label = parameter.name,
                  .x = {},
                  .y = {},
                  .style = {.colour = colours[number % 8], .dashes = dashes[number % 8]}};
    ++number;
    for (size_t n = 0; n < pulls.size(); ++n) {
      // Normal quantile of (n + 1/2) / count, by Newton's method on erf.
      const double share = (static_cast<double>(n) + 0.5) / static_cast<double>(pulls.size());
      double z = 0;
      for (int k = 0; k < 50; ++k) {
        const double density = std::exp(-0.5 * z * z) / std::sqrt(2 * M_PI);
        z -= std::clamp((0.5 * std::erfc(-z / M_SQRT2) - share) / density, -0.5, 0.5);
      }
      series.x.push_back(z);
      series.y.push_back(pulls[n]);
    }
    plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return "";
  plot.series.push_back(
      {.label = "honest", .x = {-3, 3}, .y = {-3, 3}, .style = {.colour = "#999"}});
  return line_plot(plot);
}

/// Shows the tracker's result on the pictures, and one of them.
std::string tracker_html(const TrackerErrors& tracker, const std::string& picture_png) {
  std::string body =
      html_table(tracker_table(tracker),
                 "The tracker against the truth, over all trials: root mean squares of a "
                 "coordinate's error and of the sigma stated for it, and chi-squared per number, "
                 "which is 1 where sigma is right. Above 1, intervals that believe the sigma are "
                 "too narrow.");
  const Table rejections = tracker_rejections(tracker);
  if (!rejections.rows.empty())
    body += html_table(rejections, "Corners of tags that were read but rejected, by reason.");
  if (!picture_png.empty())
    body += fmt::format(
        "<figure>\n<img src=\"{}\" alt=\"A cloth with printed tags\" style=\"max-width: 100%\">\n"
        "<figcaption>The first camera's picture in the middle of the first "
        "trial.</figcaption>\n</figure>\n",
        data_uri("image/png", picture_png));
  return body;
}

}  // namespace

std::string recover_page_html(const RecoverOptions& options, const RecoverResult& result,
                              const std::string& command, const std::string& picture_png) {
  std::string body = fmt::format(
      "<h1>Simulate and recover</h1>\n<p class=\"meta\"><code>{}</code></p>\n"
      "<p>{} recordings of a cloth whose every number is known, each released another way, each "
      "fitted as if nothing were known. The bound is Cramér and Rao's: no unbiased estimate from "
      "such a recording scatters less.</p>\n",
      escape_xml(command), options.trials);
  body +=
      html_table(recovery_counts(result),
                 "Counts. A fit counts as beyond 10 bounds when any of its parameters lies that "
                 "far from the truth.");
  body +=
      html_table(recovery_table(result),
                 "Errors relative to the truth. The 95 % interval is the estimate ± 1.96 "
                 "sigma of independent noise; the robust 90 % interval bears residuals that "
                 "depend on each other within blocks of the cloth; the stated one is fit.json's.");
  if (result.tracker) body += tracker_html(*result.tracker, picture_png);
  const std::string pulls = pulls_svg(result);
  if (!pulls.empty())
    body += fmt::format(
        "<figure>\n{}<figcaption>Steeper than the diagonal: the fits think "
        "themselves surer than they are.</figcaption>\n</figure>\n",
        pulls);
  return html_page("Simulate and recover", body);
}

}  // namespace clothfit
