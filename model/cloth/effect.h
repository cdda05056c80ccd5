#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/fabric/fabric.h"
#include "model/kernels/cloth_sweep.h"
#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

struct Cloth;
struct EffectLinearisation;
struct FittedEffect;

/// Says how a fit walks along a parameter.
enum class ParameterScale { linear, logarithmic };

/// A parameter of an effect. Three named NAME_x, NAME_y, NAME_z are a vector's, which a recording
/// may declare as NAME: [x, y, z].
struct EffectParameter {
  std::string name;
  std::string unit;
  double neutral = 0;
  double lower = 0;  ///< bounds of a fit
  double upper = 0;
  double typical = 1;  ///< size of a change that matters, for scaling
  ParameterScale scale = ParameterScale::linear;
  /// An empirical effect's coefficient stands in the law that a diagnosis writes. These are its
  /// left side, "a", and its factor, "-|v| v"; empty for all others.
  std::string law_side = {}, law_factor = {};
  /// It is a whole number that picks something. No fit moves it, and where nobody gives it, it is
  /// neutral.
  bool picks = false;
};

/// Says how the data are tested for an effect.
enum class EffectTest {
  smooth,    ///< by the derivative at the neutral value
  profiled,  ///< some parameters matter only away from neutral: over a grid of them
  finite     ///< no derivative at neutral: by fits at trial amplitudes
};

/// Values of a parameter that sets the shape of an effect, not its amplitude.
struct ShapeGrid {
  std::string parameter;
  std::vector<double> values;  ///< in its unit, or as the next two say
  bool per_duration = false;   ///< frequencies, in units of 1 / duration of the observed motion
  bool of_duration = false;    ///< times since its first frame, as fractions of its duration
  bool over_cloth = false;     ///< a place or a length on it
  /// The numbers of the held points on which the effect acts, from 1 on, in place of values. There
  /// are none where these are fewer than two, or where an edge is held.
  bool per_held_point = false;
  /// No grid says where the effect acts; the pushes on the cloth do (fit/diagnosis/contacts.h).
  bool from_pushes = false;
};

/// One mode of an effect; the data are asked for each mode by itself.
struct EffectMode {
  std::string name;                     ///< such as "hem"; empty where an effect has one mode only
  std::vector<std::string> amplitudes;  ///< parameters; at their neutral values the mode is absent
  std::vector<ShapeGrid> shapes;        ///< tried at each combination; all others stay neutral
  /// Effects that it refines. It is asked only of models that have one of them; none: of all.
  std::vector<std::string> beside = {};
};

/// Describes an effect. At the neutral values of all its parameters it leaves the trajectory
/// bit-equal. Shape parameters have a neutral value too, but at that value alone nothing need
/// vanish.
struct EffectDescription {
  std::string name;
  std::string summary;  ///< one line for a person, with the equation
  std::vector<EffectParameter> parameters;
  EffectTest test = EffectTest::smooth;
  std::vector<EffectMode> modes = {};  ///< none: one mode, whose amplitudes are all parameters
  bool empirical = false;              ///< it describes a force and names no cause for it
  bool touches = false;                ///< it lets the cloth touch an obstacle
  /// Without at least and at most so many driven held points it does nothing.
  std::pair<int, int> driven_points = {0, std::numeric_limits<int>::max()};
  /// Says what a person may do about it, as a short command: "level the camera". Empty: nothing.
  std::string remedy = {};
  /// Tells the fitted values of a mode in quantities of people: "6.43 g along the bottom edge". The
  /// text is empty where they do nothing. Null: nothing says more than the parameters themselves.
  std::string (*in_words)(const FittedEffect& found) = nullptr;
};

/// The state that an effect may look at: at the beginning of a step, in SI units, world.
template <class L = ExactLanes>
struct EffectScene {
  const Cloth& cloth;
  const LaneSprings<L>& springs;
  const LaneVector<L>& gravity_m_per_s2;
  const LaneVectors<L>& position_m;
  const LaneVectors<L>& velocity_m_per_s;
  double time_s = 0;  ///< the recording's, at the beginning of the step
  double time_step_s = 0;
};

/// One effect's parameters in every lane, in the description's order and units.
template <class L = ExactLanes>
using EffectValues = std::vector<LaneValue<L>>;

/// The memory of an effect from step to step: lanes x numbers. It is zero at the start unless
/// ParameterSet::start_effect_memory says otherwise.
template <class L = ExactLanes>
using EffectMemory = LaneArray<L>;

/// An effect's work on simulations in lanes of kind L. It does some of three things and leaves the
/// others as they are.
template <class L>
class LaneEffect {
 public:
  virtual ~LaneEffect() = default;

  /// Adds the effect's force on every vertex to `force_n` and advances its memory.
  virtual void add_force(const EffectScene<L>& /*scene*/, const EffectValues<L>& /*parameters*/,
                         EffectMemory<L>& /*memory*/, LaneVectors<L>& /*force_n*/) const {}

  /// Changes the sum F of all forces but the weight on every vertex. It serves inertia other than
  /// the vertices' mass m: the step accelerates a vertex by g + F / m.
  virtual void change_force(const EffectScene<L>& /*scene*/, const EffectValues<L>& /*parameters*/,
                            LaneVectors<L>& /*force_n*/) const {}

  /// Shifts `target_m`, where each held point is placed at the end of the step (world), and
  /// advances the memory. `support_force_n` is the cloth's pull on each, its weight included.
  virtual void shift_supports(const EffectScene<L>& /*scene*/,
                              const EffectValues<L>& /*parameters*/,
                              const LaneVectors<L>& /*support_force_n*/,
                              EffectMemory<L>& /*memory*/, LaneVectors<L>& /*target_m*/) const {}
};

/// Bounds from which a stable time step follows.
struct EffectRates {
  double damping_per_s = 0;       ///< rate at which velocities are damped, at most
  double frequency2_per_s2 = 0;   ///< added to the square of the largest angular frequency
  double acceleration_ratio = 1;  ///< acceleration for a given force over that without the effect
};

/// An effect's work in lanes of the kinds L.
template <class... L>
class EffectInLanes : public LaneEffect<L>... {
 public:
  using LaneEffect<L>::add_force...;
  using LaneEffect<L>::change_force...;
  using LaneEffect<L>::shift_supports...;
};

/// One physical effect beyond springs, dampers along them, and gravity.
class Effect : public EffectInLanes<ExactLanes, FastLanes, SingleLane> {
 public:
  /// Says whether `change_force` and `shift_supports` do anything.
  virtual bool changes_force() const { return false; }
  virtual bool shifts_supports() const { return false; }

  /// Says whether the effect shifts supports before anything moves, too, independently of any
  /// memory. Cloth that starts at rest then hangs from the shifted places.
  virtual bool shifts_supports_at_rest() const { return false; }

  /// Returns how many numbers it remembers of one simulation.
  virtual int memory_size(const Cloth& /*cloth*/) const { return 0; }

  /// Adds the derivatives of `add_force`, `change_force` and `shift_supports` in one simulation to
  /// those there are. They are taken at the arguments of these functions.
  virtual void linearise_force(const EffectScene<SingleLane>& /*scene*/,
                               const EffectValues<SingleLane>& /*parameters*/,
                               const EffectMemory<SingleLane>& /*memory*/,
                               EffectLinearisation& /*derivatives*/) const {}
  virtual void linearise_change(const EffectScene<SingleLane>& /*scene*/,
                                const EffectValues<SingleLane>& /*parameters*/,
                                const LaneVectors<SingleLane>& /*force_n*/,
                                EffectLinearisation& /*derivatives*/) const {}
  virtual void linearise_supports(const EffectScene<SingleLane>& /*scene*/,
                                  const EffectValues<SingleLane>& /*parameters*/,
                                  const LaneVectors<SingleLane>& /*support_force_n*/,
                                  const EffectMemory<SingleLane>& /*memory*/,
                                  EffectLinearisation& /*derivatives*/) const {}

  /// `parameters` are in the description's order.
  virtual EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                            const std::vector<double>& parameters) const = 0;
};

}  // namespace clothfit
