#include "apps/report/study/undeclared_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "apps/report/page/colour_map.h"
#include "apps/report/page/html.h"
#include "apps/report/study/undeclared_tables.h"

namespace clothfit {
namespace {

/// Shades counts by their share of the row: blue where that counts as right, orange where not.
std::string confusion_html(const Confusion& confusion) {
  if (confusion.hidden.empty()) return "";
  std::string html = "<div class=\"wide\"><table class=\"matrix\"><thead><tr><td></td>";
  for (const std::string& named : confusion.named)
    html += fmt::format("<th scope=\"col\">{}</th>", escape_xml(named));
  html += "</tr></thead>\n<tbody>\n";
  for (size_t row = 0; row < confusion.hidden.size(); ++row) {
    html += fmt::format("<tr><th scope=\"row\">{}</th>", escape_xml(confusion.hidden[row]));
    const std::vector<int>& counts = confusion.count[row];
    const double all = std::max(1, std::accumulate(counts.begin(), counts.end(), 0));
    for (size_t column = 0; column < counts.size(); ++column) {
      const int count = counts[column], right = confusion.right[row][column];
      html += count == 0 ? std::string("<td></td>")
                         : fmt::format("<td class=\"number\" style=\"background: {}\">{}</td>",
                                       diverging((count - 2 * right) / all), count);
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string opening(const UndeclaredOptions& options) {
  const bool of_pixels = options.diagnosis.fit.observations == ObservationKind::tracks2d;
  const std::string truth = fmt::format(
      "The truth is simulated on {0} x {0} vertices by the {1} scheme and fitted on "
      "{2} x {2}, seen {3}, over {4} of {5} frames; the others judge.",
      options.scene.truth_mesh, to_string(options.scene.integrator),
      options.diagnosis.fit.mesh_columns,
      of_pixels ? fmt::format("by {} camera(s) with a noise of {} px", options.scene.cameras,
                              options.scene.noise_px)
                : fmt::format("in space with a noise of {} mm", 1e3 * options.scene.noise_m),
      options.scene.held_out_from, options.scene.frames);
  switch (options.hide) {
    case UndeclaredOptions::Hide::nothing:
      return "Recordings that hide nothing: every effect accepted is a false alarm. " + truth;
    case UndeclaredOptions::Hide::pairs:
      return "Recordings that hide two effects at once. " + truth;
    case UndeclaredOptions::Hide::withheld:
      return "Recordings that hide an effect which the diagnosis does not know. " + truth;
    case UndeclaredOptions::Hide::one:
      break;
  }
  return "Recordings that hide an effect which they do not declare. " + truth;
}

}  // namespace

std::string undeclared_page_html(const UndeclaredOptions& options, const UndeclaredResult& result,
                                 const std::string& command) {
  std::string body = fmt::format(
      "<h1>Undeclared effects</h1>\n<p class=\"meta\"><code>{}</code></p>\n", escape_xml(command));
  body += paragraph(opening(options));
  if (options.hide != UndeclaredOptions::Hide::nothing)
    body += paragraph(fmt::format(
        "Amplitudes are drawn log-uniformly from {} to {} standard deviations, by the Fisher "
        "information of the fitted frames with all that the fit has free projected out. Right is "
        "the hidden effect, and any whose derivatives reproduce its own with a multiple "
        "correlation "
        "above 0.9: fixed from the truth before the diagnosis. Class: how many effects are right.",
        options.draw.least, options.draw.most));
  body += section("What was named",
                  html_table(short_undeclared_effects_table(result),
                             "Rates with Clopper and Pearson's 95 % bounds; errors are rms over "
                             "coordinates of held-out frames, means of ratios."));
  body += section("What it was taken for",
                  confusion_html(confusion_of(result)) +
                      paragraph("Rows: what was hidden. Columns: the effect accepted first. Blue "
                                "counts as right, orange does not."));
  body += section("Every trial", html_table(short_undeclared_trials_table(result), ""));
  return html_page("Undeclared effects", body);
}

}  // namespace clothfit
