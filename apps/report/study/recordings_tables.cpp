#include "apps/report/study/recordings_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"
#include "data/median.h"
#include "data/program_version.h"

namespace clothfit {
namespace {

struct ErrorColumn {
  const char* name;   ///< in the CSV
  const char* title;  ///< for people
  double StudyRow::*error;
};
constexpr ErrorColumn kErrors[] = {
    {"fitted_rms", "fitted", &StudyRow::fitted_rms},
    {"held_out_rms", "held out", &StudyRow::held_out_rms},
    {"whole_rms", "whole", &StudyRow::whole_rms},
    {"first_frame_rms", "stays as in frame 0", &StudyRow::first_frame_rms},
    {"last_velocity_rms", "moves on", &StudyRow::last_velocity_rms},
    {"rigid_rms", "moves rigidly", &StudyRow::rigid_rms},
    {"whole_rigid_rms", "rigidly, whole", &StudyRow::whole_rigid_rms},
    {"noise", "noise", &StudyRow::noise},
    {"weighted_rms", "weighted", &StudyRow::weighted_rms},
    {"weighted_rigid_rms", "rigidly, weighted", &StudyRow::weighted_rigid_rms},
    {"published_rms", "published, weighted", &StudyRow::published_rms},
    {"centred_held_out_rms", "held out, centred", &StudyRow::centred_held_out_rms},
    {"centred_rigid_rms", "rigidly, centred", &StudyRow::centred_rigid_rms},
    {"centred_weighted_rms", "weighted, centred", &StudyRow::centred_weighted_rms},
};

std::string shown(double error, const std::string& unit) {
  return significant(shown_unit(unit).factor * error, 3);
}

}  // namespace

Table study_table(const std::vector<StudyRow>& rows) {
  Table table{{"recording", "folder", "model", "kind", "unit"}, {}};
  for (const ErrorColumn& column : kErrors) table.header.push_back(column.name);
  for (const char* name : {"stop", "reason", "seconds"}) table.header.push_back(name);
  for (const StudyRow& row : rows) {
    std::vector<std::string> cells{row.recording, row.folder, row.model, row.kind, row.unit};
    for (const ErrorColumn& column : kErrors)
      cells.push_back(row.fitted ? exact_text(row.*column.error) : "");
    cells.insert(cells.end(), {row.stop, row.reason, exact_text(row.seconds)});
    table.rows.push_back(std::move(cells));
  }
  return table;
}

Table short_study_table(const std::vector<StudyRow>& rows) {
  std::vector<ErrorColumn> columns;
  for (const ErrorColumn& column : kErrors)
    if (std::ranges::any_of(rows, [&](const StudyRow& row) {
          return row.fitted && std::isfinite(row.*column.error);
        }))
      columns.push_back(column);
  Table table{{"recording", "model", "unit"}, {}};
  for (const ErrorColumn& column : columns) table.header.push_back(column.title);
  table.header.insert(table.header.end(), {"stop", "s"});
  for (const StudyRow& row : rows) {
    std::vector<std::string> cells{row.recording, row.model,
                                   row.fitted ? shown_unit(row.unit).name : ""};
    for (const ErrorColumn& column : columns)
      cells.push_back(row.fitted ? shown(row.*column.error, row.unit) : "");
    cells.insert(cells.end(), {row.fitted ? row.stop : row.reason, significant(row.seconds, 3)});
    table.rows.push_back(std::move(cells));
  }
  return table;
}

Table study_summary(const std::vector<StudyRow>& rows) {
  std::vector<std::pair<std::string, std::string>> groups;  // model and unit, as they come
  for (const StudyRow& row : rows)
    if (const std::pair group{row.model, row.unit};
        row.fitted && std::ranges::find(groups, group) == groups.end())
      groups.push_back(group);
  Table table{{"model", "unit", "fits", "fitted", "held out", "whole", "moves rigidly",
               "better than rigidly"},
              {}};
  for (const auto& [model, unit] : groups) {
    std::vector<const StudyRow*> group;
    for (const StudyRow& row : rows)
      if (row.fitted && row.model == model && row.unit == unit) group.push_back(&row);
    const auto middle = [&](double StudyRow::*error) {
      std::vector<double> errors;
      for (const StudyRow* row : group)
        if (std::isfinite(row->*error)) errors.push_back(row->*error);
      return errors.empty() ? std::string("-") : shown(median(errors), unit);
    };
    const auto better = std::ranges::count_if(group, [](const StudyRow* row) {
      return std::isfinite(row->rigid_rms) && row->held_out_rms < row->rigid_rms;
    });
    table.rows.push_back({model, shown_unit(unit).name, std::to_string(group.size()),
                          middle(&StudyRow::fitted_rms), middle(&StudyRow::held_out_rms),
                          middle(&StudyRow::whole_rms), middle(&StudyRow::rigid_rms),
                          std::to_string(better)});
  }
  return table;
}

Table study_contest(const std::vector<StudyRow>& rows) {
  Table table{{"model", "below rigidly", "below published", "below the lower of both", "target"},
              {}};
  std::vector<std::string> models;  // as they come
  for (const StudyRow& row : rows)
    if (row.fitted && std::isfinite(row.weighted_rms) &&
        std::ranges::find(models, row.model) == models.end())
      models.push_back(row.model);
  for (const std::string& model : models) {
    int all = 0, stated = 0, below_rigid = 0, below_published = 0, below_both = 0;
    for (const StudyRow& row : rows) {
      if (row.model != model || !std::isfinite(row.weighted_rms)) continue;
      ++all;
      below_rigid += row.weighted_rms < row.weighted_rigid_rms;
      if (!std::isfinite(row.published_rms)) continue;
      ++stated;
      below_published += row.weighted_rms < row.published_rms;
      below_both += row.weighted_rms < std::min(row.published_rms, row.weighted_rigid_rms);
    }
    const auto share = [](int count, int of) {
      return of > 0 ? fmt::format("{} of {}", count, of) : std::string("-");
    };
    table.rows.push_back({model, share(below_rigid, all), share(below_published, stated),
                          share(below_both, stated),
                          stated > 0 ? fmt::format("{} of {}", (stated + 1) / 2, stated) : "-"});
  }
  return table;
}

std::string study_page_html(const std::vector<StudyRow>& rows, const std::string& command) {
  std::string body =
      fmt::format("<h1>Study of recordings</h1>\n<p class=\"meta\">clothfit {}</p>\n",
                  escape_xml(program_version()));
  body += html_table(study_summary(rows),
                     "Medians over the recordings: root mean square of the distance between "
                     "predicted and observed markers. The last column counts recordings whose "
                     "held-out frames the model predicts better than moving rigidly with the held "
                     "points does.");
  if (const Table contest = study_contest(rows); !contest.rows.empty())
    body += html_table(contest,
                       "Recordings whose weighted error over all frames is below that of moving "
                       "rigidly with the held points, below the published one, and below the "
                       "lower of both.");
  body += "<div class=\"wide\">\n" +
          html_table(short_study_table(rows),
                     "Root mean square of the distance: on fitted frames; on held-out ones; over "
                     "the whole recording as one free run; of guesses that need no model, on the "
                     "held-out frames; noise is that of the observations.") +
          "</div>\n";
  body += fmt::format("<h2>Do it again</h2>\n<pre>{}</pre>\n", escape_xml(command));
  return html_page("clothfit: study of recordings", body);
}

}  // namespace clothfit
