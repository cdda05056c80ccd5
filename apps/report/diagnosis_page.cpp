#include "apps/report/diagnosis_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/report/diagnosis_law.h"
#include "apps/report/diagnosis_tables.h"
#include "apps/report/fit_figures.h"
#include "apps/report/html.h"
#include "apps/report/number_text.h"
#include "apps/version.h"

namespace clothfit {
namespace {

std::string effects_text(const Diagnosis& diagnosis) {
  std::string text;
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    text += (text.empty() ? "" : ", then ") + accepted.trial.term.title();
  return text;
}

std::string verdict_text(const Diagnosis& diagnosis) {
  switch (diagnosis.verdict) {
    case DiagnosisVerdict::adequate:
      return "The model explains this recording: nothing is missing that it could show.";
    case DiagnosisVerdict::explained:
      return "The model lacked " + effects_text(diagnosis) +
             ". With that, what is left looks like noise.";
    case DiagnosisVerdict::partly_explained:
      return "The model lacked " + effects_text(diagnosis) +
             ". With that, structure still remains that no tested effect explains.";
    case DiagnosisVerdict::unexplained:
      return "Something is missing, and no tested effect explains it.";
  }
  return "";
}

const ObservationErrors* errors_of(const FitReport& report, const std::string& kind) {
  const auto found = std::ranges::find(report.result.errors, kind, &ObservationErrors::kind);
  return found != report.result.errors.end() ? &*found : nullptr;
}

std::string before_after_text(const Diagnosis& diagnosis) {
  std::string text;
  for (const ObservationErrors& before : diagnosis.base.result.errors) {
    const ObservationErrors* after = errors_of(diagnosis.found, before.kind);
    if (after == nullptr) continue;
    const ShownUnit unit = shown_unit(before.unit);
    const bool judged = before.held_out.count > 0;
    const double one = judged ? before.held_out.rms : before.fitted.rms;
    const double other = judged ? after->held_out.rms : after->fitted.rms;
    text += fmt::format("{}{}: {} {} before, {} after, noise {}", text.empty() ? "" : "; ",
                        kind_title(before.kind, before.unit), significant(one * unit.factor, 3),
                        judged ? "on frames that no decision has seen" : "on the fitted frames",
                        significant(other * unit.factor, 3),
                        significant(before.noise * unit.factor, 3));
  }
  return text + ".";
}

std::string what_was_missing(const Diagnosis& diagnosis) {
  std::string content;
  for (const AcceptedEffect& accepted : diagnosis.accepted) {
    const LawTrial& trial = accepted.trial;
    content += fmt::format("<h3>{}</h3>\n", escape_xml(trial.term.title()));
    content += paragraph(describe_effect(trial.term.effect).summary + ".");
    content += fmt::format("<p class=\"found\"><strong>{}</strong></p>\n",
                           escape_xml(found_text(trial.term, diagnosis.found.result)));
    content += paragraph(fmt::format(
        "Chi-square falls by {}, of {} that the derivatives foresaw. Blocks of time that were left "
        "out in turn are predicted with a chi-square of {} per number, {} without it, {} with the "
        "best correction that needs no physics. Its amplitude stands {:.0f} sigma clear of doing "
        "nothing, with errors that may depend on each other over the cloth.",
        significant(trial.fall, 3), significant(trial.foreseen_fall, 3),
        significant(trial.cross_validated, 4), significant(trial.without_it, 4),
        significant(trial.best_trivial, 4), trial.clear_of_neutral));
    if (!accepted.alike.empty()) {
      std::string names;
      for (const Term& term : accepted.alike) names += (names.empty() ? "" : ", ") + term.title();
      content += paragraph("This recording cannot tell it from: " + names + ".");
    }
  }
  return content;
}

/// Two figures beside each other.
std::string side_by_side(const std::string& before, const std::string& after) {
  return "<div class=\"pair\">" + figure(before, "Before.") + figure(after, "After.") + "</div>\n";
}

std::string maps(const Diagnosis& diagnosis, const Recording& recording) {
  std::string content;
  const bool changed = !diagnosis.accepted.empty();
  for (const FitReport::Residuals& before : diagnosis.base.residuals) {
    const auto after =
        std::ranges::find(diagnosis.found.residuals, before.kind, &FitReport::Residuals::kind);
    const ObservationErrors* errors = errors_of(diagnosis.base, before.kind);
    const ObservationErrors* errors_after = errors_of(diagnosis.found, before.kind);
    if (after == diagnosis.found.residuals.end() || !errors || !errors_after) continue;
    content += fmt::format("<h3>{}</h3>\n", escape_xml(kind_title(before.kind, before.unit)));
    if (!changed) {
      content += figure(residual_over_time_svg(before, *errors, recording), "In each frame.");
      content += figure(residual_map_svg(before, recording), "Of each marker over the cloth.");
      continue;
    }
    content += side_by_side(residual_over_time_svg(before, *errors, recording),
                            residual_over_time_svg(*after, *errors_after, recording));
    content +=
        side_by_side(residual_map_svg(before, recording), residual_map_svg(*after, recording));
  }
  return content;
}

std::string wide(const std::string& html) {
  return "<div class=\"wide\">" + html + "</div>\n";
}

std::string words() {
  return "<dl>\n"
         "<dt>chi-square</dt><dd>The sum of squared residuals in units of the measured noise. One "
         "per number is what noise alone leaves.</dd>\n"
         "<dt>explains</dt><dd>The share of all that is above the noise which a law would take "
         "away, by the derivatives of the model where the law does nothing yet, everything else "
         "free to move along; a mean over short horizons.</dd>\n"
         "<dt>left out</dt><dd>Cross-validation: the fitted frames are cut into blocks of time, "
         "and each is predicted by a fit of the others.</dd>\n"
         "<dt>mended without physics</dt><dd>The best of: a constant offset for every marker; the "
         "last residual, held. An effect that does not beat them has learnt nothing.</dd>\n"
         "<dt>would have been seen from</dt><dd>Five standard deviations. A smaller amplitude may "
         "be there, and this recording does not show it.</dd>\n"
         "<dt>held out</dt><dd>Frames that no fit and no decision has seen; both models are "
         "compared with them once.</dd>\n"
         "</dl>\n";
}

}  // namespace

std::string diagnosis_sentence(const Diagnosis& diagnosis) {
  return verdict_text(diagnosis);
}

std::string diagnosis_page_html(const Diagnosis& diagnosis, const Recording& recording,
                                const std::string& command) {
  std::string body = fmt::format(
      "<h1>Diagnosis of “{}”</h1>\n<p class=\"meta\">clothfit {} · {} s</p>\n"
      "<div class=\"verdict\"><strong>{}</strong>\n<p>{}</p></div>\n",
      escape_xml(diagnosis.base.result.recording), escape_xml(program_version()),
      significant(diagnosis.seconds, 3), escape_xml(verdict_text(diagnosis)),
      escape_xml(before_after_text(diagnosis)));
  body += section("What was missing", what_was_missing(diagnosis));
  body += section("Errors before and after",
                  wide(html_table(before_after_table(diagnosis),
                                  "Root mean square of one coordinate's residual. The last three "
                                  "columns are guesses that need no model.")));
  body += section("Where and when it is off", maps(diagnosis, recording));
  body +=
      section("Which force is missing", residual_force_html(diagnosis.residual_force, recording));
  body += section("Does what is left look like noise?",
                  html_table(adequacy_table(diagnosis),
                             "Residuals after everything that was fitted has been taken out."));
  body += section(
      "Which laws were asked",
      wide(html_table(short_candidate_table(diagnosis),
                      fmt::format("The most telling of {} laws, scored where the model as declared "
                                  "first misses something: over its first {} frames.",
                                  diagnosis.scores.size(), diagnosis.score_frames))));
  const Table trials = trial_table(diagnosis);
  if (!trials.rows.empty())
    body += section("Which were fitted",
                    wide(html_table(trials, "Round by round: those that the score put first.")));
  body += section("A law for what remains", proposed_law_html(diagnosis));
  body += section(
      "What would have been seen",
      wide(html_table(limit_table(diagnosis),
                      "In the last model: amplitudes that would stand five sigma clear. Limits are "
                      "linear, from the derivatives; the estimate is the score's, not a fit's.")));
  body += section("What the words mean", words());
  body += section("Do it again", fmt::format("<pre>{}</pre>\n<p>Numbers stand in diagnosis.json, "
                                             "candidates.csv, trials.csv and limits.csv beside "
                                             "this page; the model with what was accepted in "
                                             "fit.json and model.yaml.</p>\n",
                                             escape_xml(command)));
  return html_page("clothfit: diagnosis of " + diagnosis.base.result.recording, body);
}

}  // namespace clothfit
