#include "apps/report/diagnosis/diagnosis_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <vector>

#include "apps/report/diagnosis/diagnosis_law.h"
#include "apps/report/diagnosis/diagnosis_tables.h"
#include "apps/report/fit/fit_figures.h"
#include "apps/report/fit/notices.h"
#include "apps/report/page/html.h"
#include "apps/terminal/number_text.h"
#include "data/program_version.h"
#include "fit/problem/effect_words.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Returns the first recording's name, and how many more were fitted.
std::string names_text(const Diagnosis& diagnosis) {
  const auto fitted =
      std::ranges::count(diagnosis.recordings, false, &DiagnosedRecording::held_out);
  return diagnosis.base().result.recording +
         (fitted > 1 ? fmt::format(" and {} more", fitted - 1) : "");
}

/// Writes a mode's name as people do.
std::string plain(std::string title) {
  std::ranges::replace(title, '_', ' ');
  return title;
}

std::string effects_text(const Diagnosis& diagnosis) {
  std::string text;
  if (diagnosis.seen_elsewhere) text = "constants by which its markers are seen elsewhere";
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    text += (text.empty() ? "" : ", then ") + accepted.trial.hypothesis.title();
  return text;
}

std::string verdict_text(const Diagnosis& diagnosis) {
  const bool several = diagnosis.recordings.size() > 1;
  switch (diagnosis.verdict) {
    case DiagnosisVerdict::adequate:
      return fmt::format("The model explains {}: nothing is missing that {} could show.",
                         several ? "these recordings" : "this recording", several ? "they" : "it");
    case DiagnosisVerdict::explained:
      return "The model lacked " + effects_text(diagnosis) +
             ". With that, the residual looks like noise.";
    case DiagnosisVerdict::partly_explained:
      return "The model lacked " + effects_text(diagnosis) +
             (diagnosis.complete
                  ? ". The residual still has a pattern that no effect which was tried explains."
                  : ". The residual still has a pattern, and not all effects were tried.");
    case DiagnosisVerdict::unexplained:
      return diagnosis.complete ? "Something is missing, and no tested effect explains it."
                                : "Something is missing, and not all effects were tried.";
    case DiagnosisVerdict::not_reached:
      return "The diagnosis did not come to an end.";
  }
  return "";
}

/// Root mean square over recordings of one kind of observation, each number as often as it was
/// observed.
struct Mean {
  std::string kind, unit;
  double before = 0, after = 0, noise = 0;  ///< sums of squares
  int count = 0;
  double rms(double sum) const { return std::sqrt(sum / std::max(1, count)); }
};

/// Errors before and after, of what says most: whole recordings held out say more than frames, and
/// frames more than fitted ones.
struct MeanErrors {
  std::vector<Mean> means;
  std::string where;  ///< of what: "frames that no decision has seen"
};

MeanErrors mean_errors(const Diagnosis& diagnosis) {
  const std::vector<ErrorsBeforeAfter> all = errors_before_after(diagnosis);
  const bool whole = std::ranges::any_of(
      all, [](const ErrorsBeforeAfter& one) { return one.recording->held_out; });
  const bool frames = std::ranges::any_of(
      all, [](const ErrorsBeforeAfter& one) { return one.before->held_out.count > 0; });
  MeanErrors errors{.means = {},
                    .where = whole    ? "recordings that were kept out of every fit"
                             : frames ? "frames that were kept out of the fit"
                                      : "the fitted frames"};
  for (const auto& [recording, before, after] : all) {
    if (whole && !recording->held_out) continue;
    const ErrorSummary& one = frames ? before->held_out : before->fitted;
    const ErrorSummary& other = frames ? after->held_out : after->fitted;
    auto mean = std::ranges::find(errors.means, before->kind, &Mean::kind);
    if (mean == errors.means.end())
      mean = errors.means.insert(errors.means.end(), {.kind = before->kind, .unit = before->unit});
    mean->before += one.count * one.rms * one.rms;
    mean->after += other.count * other.rms * other.rms;
    mean->noise += one.count * before->noise * before->noise;
    mean->count += one.count;
  }
  return errors;
}

/// Says how good predictions are, in quantities of people.
std::string errors_text(const Diagnosis& diagnosis) {
  const MeanErrors errors = mean_errors(diagnosis);
  std::string text;
  for (const Mean& mean : errors.means) {
    const ShownUnit unit = shown_unit(mean.unit);
    const auto shown = [&](double sum) { return significant(mean.rms(sum) * unit.factor, 3); };
    const std::string of = errors.means.size() > 1
                               ? fmt::format("In {}, the", kind_title(mean.kind, mean.unit))
                               : "The";
    text += text.empty() ? "" : " ";
    text +=
        diagnosis.changed()
            ? fmt::format(
                  "{} prediction of {} is off by {} {} without, and by {} {} with what "
                  "was found; the measurement itself scatters by {} {}.",
                  of, errors.where, shown(mean.before), unit.name, shown(mean.after), unit.name,
                  shown(mean.noise), unit.name)
            : fmt::format(
                  "{} prediction of {} is off by {} {}; the measurement itself scatters "
                  "by {} {}.",
                  of, errors.where, shown(mean.before), unit.name, shown(mean.noise), unit.name);
  }
  return text;
}

size_t effects_asked(const Diagnosis& diagnosis) {
  std::set<std::string> names;
  for (const Score& score : diagnosis.scores) names.insert(score.hypothesis.effect);
  return names.size();
}

/// Says what else could be the cause.
std::string alike_text(const Diagnosis& diagnosis) {
  std::set<std::string> alike;
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    for (const Hypothesis& other : accepted.alike)
      if (other.effect != accepted.trial.hypothesis.effect) alike.insert(plain(other.title()));
  const size_t asked = effects_asked(diagnosis);
  if (asked == 0) return "";
  const char* tried = diagnosis.complete ? "tried" : "compared, not all of them fitted,";
  if (alike.empty())
    return fmt::format("None of the others of {} effects that were {} comes near.", asked, tried);
  return fmt::format("Of {} effects that were {} only {} {} near.", asked, tried,
                     fmt::join(alike, ", "), alike.size() == 1 ? "comes" : "come");
}

/// Says what a person may do next: a remedy, a recording that tells more, or the next command.
std::vector<std::string> next_steps(const Diagnosis& diagnosis) {
  std::vector<std::string> steps;
  constexpr double kTold = 5;
  for (size_t n = 0; n < diagnosis.accepted.size(); ++n) {
    if (const std::string remedy = remedy_text(diagnosis.accepted[n].trial.hypothesis);
        !remedy.empty())
      steps.push_back(remedy);
    for (const Separation& separation : diagnosis.separation_of(n)) {
      if (separation.recordings.empty()) continue;
      const SeparatingRecording& best = separation.recordings.front();
      steps.push_back(
          best.sigmas >= kTold
              ? fmt::format(
                    "Record the cloth {}, to tell it from {} ({:.0f} sigma apart then, {:.1f} "
                    "now).",
                    best.what, plain(separation.from.title()), best.sigmas, separation.now)
              : fmt::format("No recording that was tried tells it from {}.",
                            plain(separation.from.title())));
    }
  }
  switch (diagnosis.verdict) {
    case DiagnosisVerdict::adequate:
      steps.push_back("Use the model: model.yaml and fit.json beside this page hold it.");
      break;
    case DiagnosisVerdict::explained:
      steps.push_back(
          "Use the model with it: model.yaml and fit.json beside this page hold it. Or remove the "
          "cause and record once more.");
      break;
    case DiagnosisVerdict::partly_explained:
      steps.push_back(diagnosis.complete
                          ? "The error that is left still has a pattern: something smaller is "
                            "missing too. Record the same cloth again, released in another way, "
                            "and diagnose both recordings together."
                          : "Give the search more time (--budget): not all effects were tried.");
      break;
    case DiagnosisVerdict::unexplained:
      steps.push_back(diagnosis.complete
                          ? "The maps below show where and when it is off. Record the same cloth "
                            "again, released in another way, and diagnose both recordings together."
                          : "Give the search more time (--budget): not all effects were tried.");
      break;
    case DiagnosisVerdict::not_reached:
      break;
  }
  return steps;
}

Notice notice_of(DiagnosisVerdict verdict) {
  switch (verdict) {
    case DiagnosisVerdict::adequate:
    case DiagnosisVerdict::explained:
      return Notice::good;
    case DiagnosisVerdict::partly_explained:
      return Notice::care;
    case DiagnosisVerdict::unexplained:
      return Notice::lacks;
    case DiagnosisVerdict::not_reached:
      return Notice::bad;
  }
  return Notice::care;
}

/// What a reader with a minute needs: the cause in quantities of people, how it is known, what to
/// do next, and the cloth's numbers beside.
std::string answer_html(const Diagnosis& diagnosis) {
  std::string cause;
  for (const AcceptedEffect& accepted : diagnosis.accepted) {
    const Hypothesis& term = accepted.trial.hypothesis;
    const std::string words = words_of(term, diagnosis.found());
    const FitResult& result = diagnosis.found().result;
    cause += fmt::format("<p class=\"found\">{}: <strong>{}</strong>{}</p>\n",
                         escape_xml(plain(term.title())),
                         escape_xml(words.empty() ? found_text(term, result) : words),
                         escape_xml(words.empty() ? "" : certainty_text(term, result)));
  }
  if (diagnosis.seen_elsewhere)
    cause += fmt::format("<p class=\"found\">markers seen elsewhere: <strong>{}</strong></p>\n",
                         escape_xml(seen_elsewhere_text(*diagnosis.seen_elsewhere)));
  cause += fmt::format("<p><b>How it is known.</b> {}</p>\n",
                       escape_xml(errors_text(diagnosis) + " " + alike_text(diagnosis)));
  cause += "<p><b>What to do next.</b></p>\n<ul>\n";
  for (const std::string& step : next_steps(diagnosis))
    cause += fmt::format("<li>{}</li>\n", escape_xml(step));
  cause += "</ul>\n";
  if (!diagnosis.complete) cause += paragraph(incomplete_text(diagnosis));
  return fmt::format("<div class=\"answer\"><div>{}</div><div>{}</div></div>\n", cause,
                     html_table(brief_parameter_table(diagnosis.found().result), "The cloth"));
}

/// Lists recordings that would tell an accepted mode from others.
std::string what_to_record(std::span<const Separation> separations) {
  const Table table = separation_table(separations);
  if (table.rows.empty()) return "";
  return paragraph("What to record next: modes are told apart from about five sigma on.") +
         html_table(table,
                    "How far this mode, as it was found, is from what the other one can do in its "
                    "place, all else fitted again, in standard deviations of the noise: now, and "
                    "in recordings that could be made, each by itself, simulated with the model "
                    "found. The best that differ in kind; linear, from the derivatives.");
}

std::string what_was_missing(const Diagnosis& diagnosis) {
  std::string content;
  if (diagnosis.seen_elsewhere) {
    const SeenElsewhere& seen = *diagnosis.seen_elsewhere;
    content += "<h3>Markers seen elsewhere</h3>\n";
    content += paragraph(
        "Each marker is seen beside where the model has it by about a constant: it sits elsewhere "
        "on the cloth, the tracker misplaces it, or the cloth rests in folds that no parameter "
        "describes. Laws alone leave more, and the constants found in the fitted frames are added "
        "wherever else the cloth is predicted.");
    content += fmt::format("<p class=\"found\"><strong>{}</strong></p>\n",
                           escape_xml(seen_elsewhere_text(seen)));
    content += paragraph(fmt::format(
        "Blocks of time that were left out in turn are predicted with a chi-square of {} per "
        "number with constants from the others, {} without.",
        significant(seen.cross_validated, 4), significant(seen.without_it, 4)));
  }
  for (size_t n = 0; n < diagnosis.accepted.size(); ++n) {
    const AcceptedEffect& accepted = diagnosis.accepted[n];
    const Trial& trial = accepted.trial;
    content += fmt::format("<h3>{}</h3>\n", escape_xml(trial.hypothesis.title()));
    content += paragraph(describe_effect(trial.hypothesis.effect).summary + ".");
    const std::string values = found_text(trial.hypothesis, diagnosis.found().result);
    const std::string told = words_of(trial.hypothesis, diagnosis.found());
    content += fmt::format("<p class=\"found\"><strong>{}</strong></p>\n",
                           escape_xml(told.empty() ? values : told));
    if (!told.empty()) content += paragraph(values + ".");
    if (const std::string remedy = remedy_text(trial.hypothesis); !remedy.empty())
      content += paragraph(remedy);
    content += paragraph(fmt::format(
        "Chi-square falls by {}, of {} that the derivatives predicted. Blocks of time that were "
        "left "
        "out in turn are predicted with a chi-square of {} per number, {} without it, {} with the "
        "best correction that needs no physics. Its amplitude stands {:.0f} sigma clear of doing "
        "nothing, with errors that may depend on each other over the cloth.",
        significant(trial.decrease, 3), significant(trial.predicted_decrease, 3),
        significant(trial.cross_validated, 4), significant(trial.without_it, 4),
        significant(trial.best_trivial, 4), trial.clear_of_neutral));
    if (trial.clear_of_neutral < kCriteria.clear_of_neutral)
      content += paragraph(
          "That is less than five, the usual bar; all else that the model lacks counts as error "
          "here. The effect is accepted because it takes a good part of the residual, and nothing "
          "that was left out is predicted worse with it.");
    if (trial.on_credit)
      content += paragraph(
          "A constant for each marker, or the last residual held, did as well as this effect "
          "alone, and not as well as it and those below together.");
    if (!accepted.alike.empty()) {
      std::string names;
      for (const Hypothesis& term : accepted.alike)
        names += (names.empty() ? "" : ", ") + term.title();
      content += paragraph("This recording cannot tell it from: " + names + ".");
      content += what_to_record(diagnosis.separation_of(n));
    }
  }
  return content;
}

/// Places two figures beside each other.
std::string side_by_side(const std::string& what, const std::string& before,
                         const std::string& after) {
  return "<div class=\"pair\">" + figure(before, what + " before.") +
         figure(after, what + " after.") + "</div>\n";
}

std::string maps_of(const DiagnosedRecording& of, bool changed, const Recording& recording) {
  std::string content;
  for (size_t k = 0; k < of.before.residuals.size(); ++k) {
    const FitReport::Residuals& before = of.before.residuals[k];
    const auto after =
        std::ranges::find(of.after.residuals, before.kind, &FitReport::Residuals::kind);
    if (after == of.after.residuals.end()) continue;
    const ObservationErrors& errors = of.before.result.errors[k];
    const ObservationErrors& errors_after =
        of.after.result.errors[static_cast<size_t>(after - of.after.residuals.begin())];
    content += fmt::format("<h4>{}</h4>\n", escape_xml(kind_title(before.kind, before.unit)));
    if (!changed) {
      content += figure(residual_over_time_svg(before, errors, recording), "In each frame.");
      content += figure(residual_map_svg(before, recording), "Of each marker over the cloth.");
      continue;
    }
    content +=
        side_by_side("Error in each frame,", residual_over_time_svg(before, errors, recording),
                     residual_over_time_svg(*after, errors_after, recording));
    const double largest = std::max(largest_marker_rms(before), largest_marker_rms(*after));
    content += side_by_side("Error of each marker over the flat cloth,",
                            residual_map_svg(before, recording, largest),
                            residual_map_svg(*after, recording, largest));
  }
  return content;
}

/// Shows the maps: those of one recording open, those of several each behind its name.
std::string maps(const Diagnosis& diagnosis, std::span<const Recording> recordings) {
  const bool changed = diagnosis.changed();
  if (recordings.size() == 1)
    return maps_of(diagnosis.recordings.front(), changed, recordings.front());
  std::string content;
  for (size_t n = 0; n < recordings.size(); ++n)
    content += fmt::format("<details><summary>{}{}</summary>\n{}</details>\n",
                           escape_xml(recordings[n].name),
                           diagnosis.recordings[n].held_out ? " (held out)" : "",
                           maps_of(diagnosis.recordings[n], changed, recordings[n]));
  return content;
}

/// Reports searches of twins: of the accepted model, and of planted amplitudes.
std::string planted(const Diagnosis& diagnosis) {
  std::string content;
  if (diagnosis.reinjected && diagnosis.reinjected->ran)
    content += paragraph(
        diagnosis.reinjected->found.empty()
            ? "A twin of the recording, simulated with what was accepted and its own noise, was "
              "diagnosed in the same way: nothing more is found there, as it should be."
            : "A twin of the recording, simulated with what was accepted and its own noise, was "
              "diagnosed in the same way, and " +
                  diagnosis.reinjected->found.front().title() +
                  " is found there, which it does not have: trust no small effect here.");
  if (!diagnosis.plants.empty())
    content += html_table(plant_table(diagnosis),
                          "Planted on twins of the recording, at 1.6 times its limit, and searched "
                          "for: one amplitude of each effect, those first that are seen best.");
  return content;
}

std::string parameters(const Diagnosis& diagnosis) {
  Table rest;
  const Table estimated = estimated_parameter_table(diagnosis.found().result, rest);
  return html_table(estimated,
                    "Of the model with what was accepted. The errors count what it still lacks.") +
         (rest.rows.empty()
              ? ""
              : folded("How it was placed and measured, and what was given",
                       html_table(rest,
                                  "Where several recordings were fitted, what is each one's "
                                  "own is the first's.")));
}

std::string words() {
  return "<dl>\n"
         "<dt>chi-square</dt><dd>The sum of squared residuals in units of the measured noise. One "
         "per number is what noise alone leaves.</dd>\n"
         "<dt>explains</dt><dd>The share of all that is above the noise which a mode would take "
         "away, by the derivatives of the model where the mode does nothing yet, everything else "
         "free to move along; a mean over short horizons.</dd>\n"
         "<dt>left out</dt><dd>Cross-validation: the fitted frames are cut into blocks of time, "
         "and each is predicted by a fit of the others.</dd>\n"
         "<dt>corrected without physics</dt><dd>The best of: a constant offset for every marker; "
         "the "
         "last residual, held; forces that follow no law, the last ones held. An effect that does "
         "not beat the first two is refused, unless those accepted after it and it beat them "
         "together; one that does not beat such forces is refused unless it takes a tenth of what "
         "they leave beside them.</dd>\n"
         "<dt>would have been seen from</dt><dd>Five standard deviations, or as many as it takes "
         "to "
         "be worth a name. A smaller amplitude may be there, and this recording does not show "
         "it.</dd>\n"
         "<dt>sigma, 90 %</dt><dd>One standard deviation of a parameter, and the interval that "
         "would hold it in 90 of 100 such recordings.</dd>\n"
         "<dt>undetermined</dt><dd>These data allow any value in a wide range; the reason stands "
         "beside it, and the value is not a measurement.</dd>\n"
         "<dt>held out</dt><dd>Frames that no fit and no decision has seen; both models are "
         "compared with them once.</dd>\n"
         "</dl>\n";
}

}  // namespace

std::string diagnosis_sentence(const Diagnosis& diagnosis) {
  return verdict_text(diagnosis);
}

std::string incomplete_text(const Diagnosis& diagnosis) {
  if (diagnosis.scores.empty())
    return "Incomplete: the search ended before its first scores were complete.";
  return fmt::format(
      "Incomplete: the search ended after {} s. Of {} ways in which effects act, {} were compared "
      "by "
      "their derivatives alone and not fitted. How small an effect would be seen, what would tell "
      "effects apart and which formula the force follows was not asked.",
      significant(diagnosis.seconds, 3), diagnosis.scores.size(), not_tried(diagnosis).size());
}

std::string diagnosis_page_html(const Diagnosis& diagnosis, std::span<const Recording> recordings,
                                const std::string& command) {
  const Recording& recording = recordings.front();
  std::string body =
      fmt::format("<h1>Diagnosis of “{}”</h1>\n<p class=\"meta\">clothfit {} · {} s</p>\n",
                  escape_xml(names_text(diagnosis)), escape_xml(program_version()),
                  significant(diagnosis.seconds, 3));
  body += notice_box(notice_of(diagnosis.verdict), plain(verdict_text(diagnosis)),
                     answer_html(diagnosis));
  for (const DiagnosedRecording& one : diagnosis.recordings)
    body += warnings_box(one.after.result.warnings);
  body += section("Where and when it is off", maps(diagnosis, recordings));
  body += section("Errors before and after",
                  html_table(before_after_table(diagnosis),
                             "Root mean square of one coordinate's residual. The last three "
                             "columns are guesses that need no model."));
  body += section("Parameters", parameters(diagnosis));
  body += section("What was missing, in full",
                  folded("Why each was accepted, and what is alike", what_was_missing(diagnosis)));
  body += section("Which force is missing",
                  folded("The residual force, marker by marker",
                         residual_force_html(diagnosis.residual_force, recording)));
  body += section("Does the residual look like noise?",
                  folded("The tests, before and after",
                         html_table(adequacy_table(diagnosis),
                                    "Residuals after everything that was fitted has been taken "
                                    "out.")));
  body += section(
      "Which modes were asked",
      folded(fmt::format("The most telling of {} modes", diagnosis.scores.size()),
             html_table(short_candidate_table(diagnosis),
                        fmt::format("Scored where the model as declared first misses something: "
                                    "over its first {} frames.",
                                    diagnosis.score_frames))));
  const Table trials = trial_table(diagnosis);
  if (!trials.rows.empty())
    body += section("Which were fitted",
                    folded(fmt::format("{} fits, round by round", trials.rows.size()),
                           html_table(trials, "Those that the score put first.")));
  body += section("A law for what remains", proposed_law_html(diagnosis));
  const Table limits = limit_table(diagnosis);
  if (!limits.rows.empty())
    body += section(
        "What would have been seen",
        folded(fmt::format("Limits of {} amplitudes", limits.rows.size()),
               html_table(limits,
                          "In the last model: amplitudes that would stand five sigma clear and "
                          "take enough of the residual to be accepted. Limits are linear, from the "
                          "derivatives; the estimate is the score's, not a fit's.") +
                   planted(diagnosis)));
  body += section("What the words mean", words());
  body += section("Do it again", fmt::format("<pre>{}</pre>\n<p>Numbers stand in diagnosis.json, "
                                             "candidates.csv, trials.csv and limits.csv beside "
                                             "this page; the model with what was accepted in "
                                             "fit.json and model.yaml.</p>\n",
                                             escape_xml(command)));
  return html_page("clothfit: diagnosis of " + names_text(diagnosis), body);
}

}  // namespace clothfit
