#include "apps/report/study/foreign_tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"
#include "data/program_version.h"

namespace clothfit {
namespace {

std::string list(const std::vector<std::string>& texts, const char* between = ", ") {
  return fmt::format("{}", fmt::join(texts, between));
}

std::string or_dash(const std::string& text) {
  return text.empty() ? "-" : text;
}

std::string hidden_text(const ForeignRow& row) {
  std::vector<std::string> titles;
  if (row.truth)
    for (const HiddenTruth& hidden : row.truth->hidden) titles.push_back(hidden.title());
  if (row.truth && row.truth->kind() == TruthKind::foreign_law) titles.emplace_back("foreign law");
  return list(titles);
}

/// Writes "wind (pressure) [gravity_tilt, frame_acceleration], nonuniform_mass (hem)".
std::string named_text(const ForeignRow& row) {
  std::vector<std::string> texts;
  for (const NamedEffect& named : row.diagnosis.named)
    texts.push_back(named.title + (named.alike.empty() ? "" : " [" + list(named.alike) + "]"));
  return list(texts);
}

std::string reached_text(const ForeignRow& row) {
  if (!row.diagnosis.reached()) return "no diagnosis";
  return to_string(row.diagnosis.verdict) + (row.diagnosis.complete ? "" : " (incomplete)");
}

/// Says what is wrong with a row, in a phrase.
std::string fault_text(const ForeignRow& row) {
  if (!row.judged()) return row.diagnosis.reason;
  const Judgement judgement = row.judgement();
  std::vector<std::string> faults;
  if (!judgement.missed.empty()) faults.push_back("missed: " + list(judgement.missed));
  if (!judgement.not_there.empty()) faults.push_back("not there: " + list(judgement.not_there));
  if (judgement.wrong_verdict) faults.emplace_back("wrong verdict");
  return list(faults, "; ");
}

/// Counts the rows of one kind, and lists their faults with the recordings' names.
std::vector<std::string> summary_row(const std::string& kind, const std::vector<ForeignRow>& rows,
                                     const std::function<bool(const ForeignRow& row)>& counts) {
  int all = 0, right = 0;
  std::vector<std::string> missed, not_there;
  for (const ForeignRow& row : rows) {
    if (!counts(row)) continue;
    ++all;
    right += row.right();
    if (!row.judged()) continue;
    const Judgement judgement = row.judgement();
    for (const std::string& one : judgement.missed)
      missed.push_back(fmt::format("{} ({})", one, row.recording));
    for (const std::string& one : judgement.not_there)
      not_there.push_back(fmt::format("{} ({})", one, row.recording));
  }
  return {kind, std::to_string(right), std::to_string(all), or_dash(list(missed)),
          or_dash(list(not_there))};
}

}  // namespace

Table foreign_table(const std::vector<ForeignRow>& rows) {
  Table table{{"recording", "kind", "hidden", "verdict", "named", "right", "wrong", "unit",
               "held_out_rms", "noise", "floor", "error_over_floor", "seconds"},
              {}};
  for (const ForeignRow& row : rows) {
    const bool metres = row.diagnosis.unit == "m";
    table.rows.push_back(
        {row.recording, row.truth ? to_string(row.truth->kind()) : "", hidden_text(row),
         reached_text(row), named_text(row), row.right() ? "yes" : "no", fault_text(row),
         row.diagnosis.unit, exact_text(row.diagnosis.held_out_rms),
         exact_text(row.diagnosis.noise),
         row.judged() ? exact_text(metres ? row.truth->floor_m : row.truth->floor_px) : "",
         exact_text(row.error_over_floor()), exact_text(row.diagnosis.seconds)});
  }
  return table;
}

Table short_foreign_table(const std::vector<ForeignRow>& rows) {
  Table table{{"recording", "hidden", "verdict", "named [alike]", "right", "error/floor", "s",
               "what is wrong"},
              {}};
  for (const ForeignRow& row : rows)
    table.rows.push_back({row.recording, or_dash(hidden_text(row)), reached_text(row),
                          or_dash(named_text(row)), row.right() ? "yes" : "no",
                          significant(row.error_over_floor(), 3),
                          significant(row.diagnosis.seconds, 3), fault_text(row)});
  return table;
}

Table foreign_summary(const std::vector<ForeignRow>& rows) {
  Table table{{"kind", "right", "of", "missed", "not there"}, {}};
  for (const TruthKind kind :
       {TruthKind::hidden_effects, TruthKind::nothing_hidden, TruthKind::foreign_law})
    table.rows.push_back(summary_row(to_string(kind), rows, [&](const ForeignRow& row) {
      return row.truth && row.truth->kind() == kind;
    }));
  table.rows.push_back(summary_row("all", rows, [](const ForeignRow&) { return true; }));
  return table;
}

std::string longest_text(const std::vector<ForeignRow>& rows) {
  const auto longest = std::ranges::max_element(
      rows, {}, [](const ForeignRow& row) { return row.diagnosis.seconds; });
  if (longest == rows.end()) return "";
  return fmt::format("Longest: {}, {} s", longest->recording,
                     significant(longest->diagnosis.seconds, 3));
}

std::string foreign_page_html(const std::vector<ForeignRow>& rows, const std::string& command) {
  std::string body = fmt::format(
      "<h1>Diagnoses of another program's recordings</h1>\n<p class=\"meta\">clothfit {}</p>\n",
      escape_xml(program_version()));
  body += html_table(foreign_summary(rows),
                     "Right diagnoses by the kind of truth; what was missed, and what was named "
                     "and is not there.");
  body += paragraph(longest_text(rows));
  body += "<div class=\"wide\">\n" +
          html_table(short_foreign_table(rows),
                     "Named effects in the order of acceptance, with those that the recording "
                     "cannot tell from each in brackets. Error/floor: the held-out error of the "
                     "model found over the root of noise squared plus step-size floor squared.") +
          "</div>\n";
  body += fmt::format("<h2>Do it again</h2>\n<pre>{}</pre>\n", escape_xml(command));
  return html_page("clothfit: diagnoses of another program's recordings", body);
}

}  // namespace clothfit
