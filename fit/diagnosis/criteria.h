#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// Every threshold of a diagnosis. criteria.cpp says what each decides, what raising it costs, and
/// where it was chosen. diagnosis.json repeats that; docs/theory/diagnosis.md has the stages.
struct DiagnosisCriteria {
  // Adequacy (adequacy.h)
  double structure_score = 5;
  double structure_share = 0.02;
  double excess_chi_square = 0.2;
  double smooth_discretisation = 0.01;
  double left_discretisation = 0.1;

  // The base model and the mesh (base_fit.h, discretisation.h)
  double first_work = 0.2;
  double finer_mesh_gain = 0.05;
  double believable_error = 3;
  double grossly_misfitting = 30;
  double grossly_misfitting_in_motion = 6;
  double far_off = 3;
  double biased = 3;

  // The shortlist (shortlist.h)
  double visible = 1.2;
  double visible_sigmas = 4;
  double explained_at_once = 0.5;
  double shape_refined_above = 0.25;
  double scored_again_of_best = 0.25;
  double push_sigmas = 6;
  double fewest_pushed = 3;
  double least_decrease = 25;
  double least_decrease_per_amplitude = 3.6;
  double more_than_predicted = 1.25;

  // Fits of the shortlist (refit.h, expand.h)
  double kept_promise = 0.8;
  double hardly_above_noise = 1.1;
  double cautious_start = 0.5;
  double exact_fit_of_best = 0.5;
  double race_far_behind = 10;
  double race_worth = 0.1;
  double contact_alone = 0.8;
  double race_of_noise = 0.1;
  double coarse_error = 0.5;
  double coarse_worth = 0.5;
  double coarse_near_best = 1.25;
  double mapping_lost = 2;
  double coarse_far_behind = 2;
  double own_errors_of_best = 0.5;
  double shape_fit_of_best = 0.2;

  // Basins (basin.h)
  double good_part = 0.25;
  double from_scratch_of_best = 0.5;
  double other_basin = 0.25;

  // A trial (trial.h)
  double predicted_share = 0.5;
  double clear_of_neutral = 5;
  double trace = 0.05;
  double trace_of_accepted = 0.02;
  double free_forces_gain = 0.1;
  double time_blocks = 5;
  double whole_recordings = 3;

  // Worth a name (worth.h)
  double noise_known = 0.003;
  double of_excess = 1.0 / 3;
  double of_all = 0.05;
  double of_noise = 0.25;
  double form_known = 0.05;

  // The beam (beam.h, expand.h)
  double beam_far_behind = 0.5;
  double told_apart = 25;

  // One hypothesis in place of another (rival.h)
  double changes_alike = 0.5;

  // The proposed law (proposed_law.h)
  double term_worth_a_fit = 0.8;
  double term_gain = 0.1;
  double term_gain_of_noise = 0.02;

  // Limits (limits.h)
  double planted_above_limit = 1.6;
};

/// The criteria of this program.
inline constexpr DiagnosisCriteria kCriteria;

/// One threshold in words.
struct CriterionDescription {
  std::string name;  ///< of the member of DiagnosisCriteria
  double value = 0;
  std::string decides;  ///< with the unit of `value`
  std::string raising;  ///< what a higher value costs
  std::string chosen;   ///< on which data
};

/// Describes all of them, in the order of the members.
std::vector<CriterionDescription> describe(const DiagnosisCriteria& criteria);

}  // namespace clothfit
