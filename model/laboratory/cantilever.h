#pragma once

#include <functional>

#include "model/fabric/measured_fabric.h"
#include "model/laboratory/thread_direction.h"
#include "model/rest/minimise.h"

namespace clothfit {

/// The cantilever test [astm.d1388, option A]: a strip is pushed over the edge of a table until its
/// end touches a plane that falls from the edge at 41.5 degrees. Half of the overhang counts as the
/// bending length.
struct CantileverOptions {
  double width_m = 0.025;
  double angle_deg = 41.5;
  int cells = 32;  ///< along the overhang; the error falls with their square
  /// Called between steps; `false` cancels. May be empty.
  std::function<bool()> go_on;

  void validate() const;  ///< throws InputError
};

struct CantileverResult {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  double overhang_m = 0;
  double bending_length_m = 0;  ///< half of it
  double bending_n_m = 0;       ///< weight per area x bending length^3, as the standard has it
  bool usable() const { return reason == MinimiseReason::converged; }
};

/// Finds the overhang of a strip along `direction`.
CantileverResult bend_cantilever(const MeasuredFabric& fabric, ThreadDirection direction,
                                 const CantileverOptions& options = {});

}  // namespace clothfit
