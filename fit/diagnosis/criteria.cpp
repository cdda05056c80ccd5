#include "fit/diagnosis/criteria.h"

namespace clothfit {
namespace {

/// A convention of the field; no data were looked at.
constexpr const char* kConvention = "convention";
/// Set when its step was written, and not varied since.
constexpr const char* kDesign = "set with its step, not varied since";
/// Trials of `recover --undeclared`, which have judged nothing since (docs/log.md).
constexpr const char* kTrials = "trials of recover --undeclared, seeds 1 to 21";
/// Recordings for which its step was written. It was set once and not varied on them.
constexpr const char* kBundled = "set with its step, written for swing_breeze and tags_airdrag";
constexpr const char* kRobot = "set with its step, written for the IRI sessions s0623 and s0705";

}  // namespace

std::vector<CriterionDescription> describe(const DiagnosisCriteria& c) {
  return {
      {"structure_score", c.structure_score,
       "standard deviations from which smooth structure in the residual is sure",
       "weak effects end as adequate", kConvention},
      {"structure_share", c.structure_share,
       "share of the noise's square from which sure structure counts",
       "effects below a seventh of the noise are passed over", kDesign},
      {"excess_chi_square", c.excess_chi_square,
       "chi-square per degree of freedom beyond 1 that an adequate model may leave",
       "rough structure is taken for noise", kTrials},
      {"smooth_discretisation", c.smooth_discretisation,
       "share of the discretisation's square that smooth structure may have",
       "structure that looks like mesh and time step is passed over", "tags_onecam"},
      {"left_discretisation", c.left_discretisation,
       "share of the discretisation's square that chi-square may exceed 1 by",
       "structure that looks like mesh and time step is passed over", "tags_onecam"},

      {"first_work", c.first_work, "share of a fit's work that the base fit is given",
       "time, where the model lacks something large", kBundled},
      {"finer_mesh_gain", c.finer_mesh_gain,
       "chi-square per residual by which a mesh of twice the cells must leave less to be analysed",
       "effects are mistaken on a mesh that cannot follow the cloth", kTrials},
      {"believable_error", c.believable_error,
       "standard deviations of a direction of the discretisation beyond which it is dropped",
       "a large hidden effect passes for an error of the mesh", kTrials},
      {"grossly_misfitting", c.grossly_misfitting,
       "chi-square per residual beyond which a coarser mesh chooses and no direction is asked for",
       "time, where the model lacks something large", kBundled},
      {"far_off", c.far_off, "chi-square per residual beyond which the basin may be the wrong one",
       "a hypothesis is credited with the basin that it led to", kRobot},
      {"biased", c.biased, "chi-square per residual beyond which scores over all frames are biased",
       "large effects are mistaken for what the springs made of them", kDesign},

      {"visible", c.visible,
       "chi-square per residual from which a horizon shows that something is missing",
       "scores come from longer horizons, which are more biased", kDesign},
      {"visible_sigmas", c.visible_sigmas,
       "the same in standard deviations of chi-square, for models that leave little",
       "scores come from longer horizons, which are more biased", kTrials},
      {"explained_at_once", c.explained_at_once,
       "share of the sure excess that one hypothesis must be predicted to take over all frames",
       "time: shorter horizons are looked at more often", kTrials},
      {"shape_refined_above", c.shape_refined_above,
       "share of the best decrease from which shapes between the grid's are scored",
       "narrow shapes are missed", kTrials},
      {"least_decrease", c.least_decrease,
       "decrease of chi-square from which one amplitude is fitted: five sigma",
       "weak effects are not tried", kConvention},
      {"least_decrease_per_amplitude", c.least_decrease_per_amplitude,
       "more of it for each further amplitude, as unlikely",
       "weak effects of several amplitudes are not tried", kConvention},
      {"more_than_predicted", c.more_than_predicted,
       "times its prediction that a fit over all frames may gain", "time", kDesign},

      {"kept_promise", c.kept_promise,
       "share of the predicted decrease below which growing horizons are tried", "time", kDesign},
      {"hardly_above_noise", c.hardly_above_noise,
       "chi-square per residual below which they are not", "a better optimum is passed over",
       kDesign},
      {"cautious_start", c.cautious_start,
       "share of the predicted amplitude at which a race begins",
       "the start overshoots where the prediction is too large", kDesign},
      {"exact_fit_of_best", c.exact_fit_of_best,
       "share of the best decrease from which a hypothesis is fitted exactly",
       "a hypothesis that keeps its promise late is judged unrefined", kTrials},
      {"race_far_behind", c.race_far_behind,
       "times the best one's excess from which a hypothesis falls out of a race", "time", kDesign},
      {"race_worth", c.race_worth,
       "share of what is worth a name that the first horizon of a race must bring",
       "effects that show late are not fitted", kDesign},
      {"race_of_noise", c.race_of_noise, "share of the noise that counts as the best one's excess",
       "time", kDesign},
      {"coarse_worth", c.coarse_worth,
       "share of what is worth a name that a hypothesis must bring on the coarse mesh",
       "effects that the coarse mesh shows badly are not fitted", kDesign},
      {"coarse_near_best", c.coarse_near_best,
       "times the best one's excess on the coarse mesh, up to which it is fitted on the analysed",
       "time", kDesign},
      {"coarse_far_behind", c.coarse_far_behind,
       "times the best one's excess on the analysed mesh, up to which others are fitted there too",
       "time", kBundled},
      {"own_errors_of_best", c.own_errors_of_best,
       "share of the best decrease from which a fit gets error directions of its own",
       "hypotheses are compared with the errors of another model", kDesign},
      {"shape_fit_of_best", c.shape_fit_of_best,
       "share of the best decrease within which shapes are fitted too", "time", kDesign},

      {"good_part", c.good_part, "share of the excess that is too much to be passed over",
       "several causes that need each other are given up", kRobot},
      {"from_scratch_of_best", c.from_scratch_of_best,
       "share of the best prediction from which a hypothesis is identified from scratch",
       "a cause that shows in another basin only is missed", kRobot},
      {"other_basin", c.other_basin,
       "share of a hypothesis' gain that the model without it must find to be in another basin",
       "a hypothesis is credited with the basin that it led to", kRobot},

      {"predicted_share", c.predicted_share,
       "share of the predicted decrease that a fit must bring",
       "effects whose prediction was too large are refused", kDesign},
      {"clear_of_neutral", c.clear_of_neutral,
       "clustered standard deviations between an amplitude and neutral", "weak effects are refused",
       kConvention},
      {"free_forces_gain", c.free_forces_gain,
       "share of what free forces leave that a hypothesis must take beside them",
       "one of several causes is taken for a force without a law", kTrials},
      {"time_blocks", c.time_blocks, "number of stretches of frames that are left out in turn",
       "time; blocks become shorter than the cloth remembers", kConvention},
      {"whole_recordings", c.whole_recordings,
       "number of recordings from which whole ones are left out in turn",
       "hypotheses of one recording are accepted for all", kDesign},

      {"noise_known", c.noise_known, "chi-square per residual that no name is worth",
       "effects of 7 to 9 sigma are refused", kTrials},
      {"of_excess", c.of_excess, "share of the sure excess that is worth a name",
       "one of several weak causes is refused", kTrials},
      {"of_all", c.of_all, "share of chi-square that is worth a name where much is missing",
       "one of several strong causes is refused", kTrials},
      {"of_noise", c.of_noise, "share of the noise that is worth a name where much is missing",
       "one of several causes is refused", "tags_onecam"},
      {"form_known", c.form_known, "relative error of the form of an accepted effect",
       "a weak cause beside a strong one is refused", kTrials},

      {"beam_far_behind", c.beam_far_behind,
       "share of the best entry's gain below which an entry is not extended",
       "a cause that needs another one first is missed", kTrials},
      {"told_apart", c.told_apart, "chi-square within which two effects are not told apart",
       "more effects are named beside the right one", kConvention},

      {"term_worth_a_fit", c.term_worth_a_fit,
       "share of the best prediction from which a term of a law is fitted",
       "the right term is not fitted where two are alike", kDesign},
      {"term_gain", c.term_gain, "share of the excess on blocks left out that a term must take",
       "weak terms are missed", kDesign},
      {"term_gain_of_noise", c.term_gain_of_noise,
       "share of the noise on blocks left out that a term must take", "weak terms are missed",
       kDesign},

      {"planted_above_limit", c.planted_above_limit,
       "times its detection limit at which an effect is planted to confirm it",
       "limits are confirmed too easily", kDesign},
  };
}

}  // namespace clothfit
