#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fit/interface/fit_input.h"
#include "fit/interface/fit_options.h"
#include "fit/measurement_effects/applicability.h"
#include "fit/observe/observations.h"
#include "fit/problem/drive.h"
#include "fit/problem/drive_correction.h"
#include "fit/problem/parameter_space.h"
#include "fit/problem/start_state.h"
#include "model/cloth/cloth.h"
#include "model/fabric/spring_set.h"
#include "model/integrate/stop_check.h"
#include "model/topology/surface.h"

namespace clothfit {

class MeasurementEffect;

/// A recording made ready to be fitted on one mesh: all that stays the same while parameters
/// change.
struct FitProblem {
  Cloth cloth;
  double cloth_mass_kg = 0;  ///< weighed, or assumed
  bool mass_assumed = false;
  StartKind start = StartKind::at_rest;
  Eigen::Matrix3Xd placed_sheet_m;  ///< the flat sheet on the first frame's markers, 3 x vertices
  StartState start_state;           ///< for a start that is unknown
  Eigen::Vector3d gravity_m_per_s2;
  std::vector<double> frame_time_s;  ///< for frames 0 .. last observed
  int first_held_out = 0;            ///< = number of frames when nothing is held out
  std::vector<ObservationSet> observations;
  std::map<std::string, int> rejected;  ///< observations left out, by reason
  Eigen::Matrix2Xd marker_place_m;      ///< s, t of each marker, 2 x markers
  Surface::Weights vertex_weights;      ///< markers x vertices
  /// Weights of kSurfaceDerivatives at the markers, x_s, x_t, x_ss, x_st, x_tt, as above. They are
  /// there where an effect of the measurement asks for the surface beside the markers.
  std::vector<Surface::Weights> derivative_weights;
  std::vector<int> driving_markers;

  ParameterSpace space;
  SpringSet spring_set = SpringSet::fabric;
  std::vector<Binding> spring_numbers;        ///< in the order of the set
  std::vector<std::vector<Binding>> effects;  ///< [effect of the cloth][parameter]
  std::vector<Binding> tilt;                  ///< rotation of gravity about two level axes; or none
  Eigen::Matrix<double, 3, 2> level_axes;
  std::vector<Binding> sheet_motion;  ///< the sheet's turn (rad) and shift (m); or none
  DriveCorrection drive_correction;   ///< for tracked held points; or none
  std::vector<GaussianPrior> priors;
  /// An effect of the measurement with its parameters, in the description's order.
  struct MeasurementTerm {
    std::shared_ptr<const MeasurementEffect> effect;
    EffectDescription description;
    std::vector<Binding> parameters;
  };
  std::vector<MeasurementTerm> measurement;
  /// An effect that the cloth does not have, at its neutral values. A parameter of it changes no
  /// run, but has a direction (EmergingEffect).
  struct EmergingTerm {
    int parameter = 0;
    std::shared_ptr<const Effect> effect;
    std::vector<double> values;  ///< neutral, but for a change of that parameter
    double change = 0;           ///< the change of that parameter
  };
  std::vector<EmergingTerm> emerging;
  double marker_offset_sigma_m =
      0;                          ///< prior of fit/observe/marker_offsets.h; 0: markers have none
  double derivatives_kept_s = 0;  ///< of effects' forces (Schedule)
  bool fast_derivatives = false;  ///< likewise
  /// Cameras read their rows in turn, in the time that they declare. The frame's time is that of
  /// the middle row, as the effect rolling_shutter has it.
  bool reads_in_rows = false;
  StopCheck stop;  ///< of its simulations (FitOptions::is_cancelled)

  int frames() const { return static_cast<int>(frame_time_s.size()); }
};

/// Gives a problem the surface's derivatives where an effect of its measurement looks beside
/// markers.
void add_derivative_weights(FitProblem& problem);

/// Returns the properties of a problem that decide which effects of the measurement apply.
MeasurementSetting measurement_setting(const FitProblem& problem);

}  // namespace clothfit
