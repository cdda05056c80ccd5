#include "apps/report/study/vision_tables.h"

#include <fmt/format.h>

#include <functional>

#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"
#include "data/program_version.h"

namespace clothfit {
namespace {

using NumberText = std::function<std::string(double)>;

Table results_table(const std::vector<VisionResult>& results, const NumberText& text) {
  Table table{{"row", "set", "visible", "found", "median_px", "p95_px", "error_over_sigma",
               "robust", "hidden_reported", "false_tags", "seconds", "reason"},
              {}};
  for (const VisionResult& result : results) {
    const TagScore& score = result.score;
    table.rows.push_back({result.row, result.set, std::to_string(score.visible),
                          text(score.found_share()), text(score.error_quantile_px(0.5)),
                          text(score.error_quantile_px(0.95)), text(score.error_over_sigma_rms()),
                          text(score.error_over_sigma_robust()),
                          std::to_string(score.hidden_reported), std::to_string(score.false_tags),
                          text(result.seconds), result.reason});
  }
  return table;
}

Table numbers_table(const std::vector<ChainResult>& results, const NumberText& text) {
  Table table{{"row", "set", "number", "value", "sigma", "over_sigma", "unit", "verdict", "seconds",
               "reason"},
              {}};
  for (const ChainResult& result : results) {
    const auto add = [&](const ChainNumber& number) {
      table.rows.push_back({result.row, result.set, number.name, text(number.value),
                            text(number.sigma), text(number.over_sigma), number.unit,
                            result.verdict, text(result.seconds), result.reason});
    };
    for (const ChainNumber& number : result.numbers) add(number);
    if (result.numbers.empty()) add({});
  }
  return table;
}

}  // namespace

Table short_chain_table(const std::vector<ChainResult>& results) {
  return numbers_table(results, [](double value) { return significant(value, 4); });
}

Table chain_table(const std::vector<ChainResult>& results) {
  return numbers_table(results, exact_text);
}

Table short_vision_table(const std::vector<VisionResult>& results) {
  return results_table(results, [](double value) { return significant(value, 4); });
}

Table vision_table(const std::vector<VisionResult>& results) {
  return results_table(results, exact_text);
}

Table vision_target_table(const std::vector<VisionTarget>& targets) {
  Table table{{"target", "wanted", "measured", "unit", "", "note"}, {}};
  for (const VisionTarget& target : targets)
    table.rows.push_back({target.name, target.target, significant(target.value, 4), target.unit,
                          target.met ? "met" : "MISSED", target.note});
  return table;
}

std::string vision_page_html(const std::vector<VisionResult>& results,
                             const std::vector<ChainResult>& chains,
                             const std::vector<VisionTarget>& targets, const std::string& command) {
  std::string body =
      fmt::format("<h1>What is read of spoiled pictures</h1>\n<p class=\"meta\">clothfit {}</p>\n",
                  escape_xml(program_version()));
  body += html_table(vision_target_table(targets), "Targets, recordings together.");
  const auto add_wide = [&](const Table& table, const std::string& caption) {
    if (!table.rows.empty())
      body += "<div class=\"wide\">\n" + html_table(table, caption) + "</div>\n";
  };
  add_wide(short_vision_table(results),
           "Accepted corners against the truth. Errors are distances; error over sigma is per "
           "coordinate, robust from the median.");
  add_wide(short_chain_table(chains),
           "From pictures to a fit. Over sigma is the difference from the fit to stills, over the "
           "standard deviation of that difference.");
  body += fmt::format("<h2>Do it again</h2>\n<pre>{}</pre>\n", escape_xml(command));
  return html_page("clothfit: what is read of spoiled pictures", body);
}

}  // namespace clothfit
