#include "fit/diagnosis/analysis.h"

#include <algorithm>
#include <limits>

#include "fit/cost/huber.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {
namespace {

std::vector<ShapeCandidates> hypotheses_of(const Analysis& analysis) {
  const FitProblem& problem = *analysis.base.problems.front();
  const double duration_s = problem.frame_time_s[static_cast<size_t>(problem.first_held_out - 1)] -
                            problem.frame_time_s.front();
  std::vector<ShapeCandidates> hypotheses =
      hypotheses_to_test(analysis.setup.inputs.front(), analysis.options, duration_s);
  const std::vector<std::string>& without = analysis.diagnosis.without;
  std::erase_if(hypotheses, [&](const ShapeCandidates& shapes) {
    return std::ranges::find(without, shapes.front().effect) != without.end();
  });
  return hypotheses;
}

std::vector<Hypothesis> contacts_of(const Analysis& analysis) {
  std::vector<Hypothesis> contacts =
      contacts_to_test(analysis.setup.inputs.front(), analysis.options);
  const std::vector<std::string>& without = analysis.diagnosis.without;
  std::erase_if(contacts, [&](const Hypothesis& contact) {
    return std::ranges::find(without, contact.effect) != without.end();
  });
  return contacts;
}

}  // namespace

double huber_threshold(const FittedModel& model, Loss loss) {
  return loss == Loss::huber ? kHuberScales * robust_scale(model.residual())
                             : std::numeric_limits<double>::infinity();
}

void search_for_effects(Analysis& analysis, const ProgressCallback& progress, PhaseClock* clock) {
  const DiagnoseOptions& asked = analysis.diagnosis;
  analysis.search = {.hypotheses = hypotheses_of(analysis),
                     .contacts = contacts_of(analysis),
                     .beam_width = asked.beam_width,
                     .refits = asked.refits,
                     .most_effects = static_cast<size_t>(asked.most_effects),
                     .threshold = huber_threshold(analysis.base, analysis.options.loss),
                     .clock = clock};
  analysis.found = search_hypotheses(analysis.setup, analysis.base, analysis.search, progress);
  analysis.search.clock = nullptr;  // searches of twins are a phase of their own
  if (!analysis.found.base.usable()) return;
  analysis.base = analysis.found.base;
  analysis.search.threshold = analysis.found.threshold;
}

}  // namespace clothfit
