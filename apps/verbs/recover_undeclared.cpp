#include "apps/verbs/recover_undeclared.h"

#include <fmt/format.h>

#include "apps/report/study/undeclared_page.h"
#include "apps/report/study/undeclared_tables.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/resumable_run.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/text_file.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Returns the library's modes, or those asked for. An effect stands for all its modes in the
/// library, else for its own; a mode stands for itself.
std::vector<HiddenMode> modes_asked_for(const std::vector<std::string>& asked,
                                        ObservationKind observations) {
  const std::vector<HiddenMode> library = hidden_modes(observations);
  if (asked.empty()) return library;
  std::vector<HiddenMode> result;
  for (const std::string& text : asked) {
    const size_t colon = text.find(':');
    const std::string effect = text.substr(0, colon);
    const std::string mode = colon == std::string::npos ? "" : text.substr(colon + 1);
    const EffectDescription described = describe_effect(effect);
    std::vector<HiddenMode> own;
    for (const HiddenMode& known : library)
      if (known.effect == effect && mode.empty()) own.push_back(known);
    std::string names;
    for (const EffectMode& known : described.modes) {
      names += (names.empty() ? "" : ", ") + known.name;
      if (own.empty() && (mode.empty() || known.name == mode)) own.push_back({effect, known.name});
      if (own.size() == 1 && !mode.empty()) break;
    }
    if (described.modes.empty() && own.empty() && mode.empty()) own.push_back({effect, ""});
    if (own.empty())
      throw InputError("--hidden", fmt::format("{} has no mode '{}'", effect, mode),
                       names.empty() ? "no mode: it has but one" : "one of " + names);
    result.insert(result.end(), own.begin(), own.end());
  }
  return result;
}

UndeclaredOptions options_of(const UndeclaredFlags& flags, const UndeclaredRun& run) {
  UndeclaredOptions options{.scene = run.scene, .diagnosis = {.fit = run.fit}};
  options.diagnosis.beam_width = flags.lines;
  options.diagnosis.refits = flags.refits;
  options.scene.held_out_from =
      flags.fitted > 0 ? flags.fitted : 1 + 3 * (run.scene.frames - 1) / 4;
  if (flags.same_model)
    options.scene.truth_mesh = run.fit.mesh_columns;
  else if (flags.integrator == "runge-kutta")
    options.scene.integrator = TruthIntegrator::runge_kutta;
  using Hide = UndeclaredOptions::Hide;
  options.hide = flags.clean      ? Hide::nothing
                 : flags.pairs    ? Hide::pairs
                 : flags.withhold ? Hide::withheld
                                  : Hide::one;
  if (!flags.clean) options.modes = modes_asked_for(flags.hidden, run.fit.observations);
  options.draw = {.least = flags.least_sigmas, .most = flags.most_sigmas};
  options.most_mimicked = flags.most_mimicked;
  options.trials = run.trials;
  options.seed = run.seed;
  options.threads = run.threads;
  return options;
}

}  // namespace

void add_undeclared_options(Verb verb, UndeclaredFlags& flags) {
  const Option undeclared = verb.add_flag("--undeclared", flags.undeclared,
                                          "Hide effects that the recordings do not declare, and "
                                          "diagnose them; --trials is of each mode");
  const auto add_flag = [&](const char* name, bool& value, const char* what) {
    return verb.add_flag(name, value, what).needs(undeclared);
  };
  const auto add = [&](const char* name, auto& value, const char* what) {
    return verb.add_option(name, &value, what).needs(undeclared).shows_default();
  };
  const Option hidden =
      verb.add_option("--hidden", &flags.hidden,
                      "Effect to hide, or one of its modes as EFFECT:MODE (default: the library)")
          .needs(undeclared)
          .type_name("EFFECT");
  const Option clean = add_flag("--clean", flags.clean, "Hide nothing: count false alarms");
  const Option pairs = add_flag("--pairs", flags.pairs, "Hide two effects at once");
  const Option withhold = add_flag("--withhold", flags.withhold,
                                   "Leave the hidden effect out of what the diagnosis knows");
  add("--mimicked", flags.most_mimicked,
      "Squared multiple correlation with all other effects, below which one is withheld");
  clean.excludes(hidden).excludes(pairs).excludes(withhold);
  pairs.excludes(withhold);
  const Option same =
      add_flag("--same-model", flags.same_model, "A truth of the fit's own mesh and integrator");
  add("--integrator", flags.integrator, "How the truth is simulated")
      .one_of({"euler", "runge-kutta"})
      .excludes(same);
  add("--fitted", flags.fitted, "Frames that are fitted; 0 for three quarters");
  add("--least-sigmas", flags.least_sigmas, "Smallest amplitude, in its standard deviations");
  add("--most-sigmas", flags.most_sigmas, "Largest amplitude");
  add("--lines", flags.lines, "As in clothfit diagnose");
  add("--refits", flags.refits, "As in clothfit diagnose");
}

int run_undeclared(const UndeclaredFlags& flags, const UndeclaredRun& asked) {
  UndeclaredOptions options = options_of(flags, asked);
  options.diagnosis.fit.is_cancelled = options.scene.is_cancelled = terminated;
  options.validate();
  ResumableRun run(asked.out, "recover", asked.journal);
  Journal journal(run.journal(), options.key(),
                  asked.resume ? JournalStart::resume : JournalStart::fresh);
  UndeclaredResult result;
  {
    ProgressLine line;
    result = recover_undeclared(options, &journal, watch(line));
  }
  if (result.stop == ExecuteStop::cancelled)
    run.cancel(fmt::format("{} of {} trials", journal.finished().size(), options.count()));
  const Table confusion = confusion_table(result);
  write_csv_table(undeclared_trials_table(result), run.folder() / "trials.csv");
  write_csv_table(undeclared_effects_table(result), run.folder() / "effects.csv");
  write_csv_table(confusion, run.folder() / "confusion.csv");
  write_text(undeclared_page_html(options, result, asked.command), run.folder() / "report.html");
  run.publish();
  for (const Table& table :
       {short_undeclared_trials_table(result), confusion, short_undeclared_effects_table(result)})
    say("{}\n", text_table(table));
  run.print_report_path();
  return kExitGood;
}

}  // namespace clothfit
