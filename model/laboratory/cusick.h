#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/rest/minimise.h"
#include "model/topology/cloth_mesh.h"

namespace clothfit {

/// The drape test of Cusick [iso9073-9, bs5058]: a round specimen lies on a smaller round disc and
/// hangs over its rim. The drape coefficient is the shadow of the part that hangs over, seen from
/// above, as a share of its area flat: 0 for cloth that falls straight down, 1 for a plate.
struct CusickOptions {
  double specimen_diameter_m = 0.30;  ///< 0.24, 0.30 or 0.36 in the standards
  double disc_diameter_m = 0.18;
  double spacing_m = 0.005;  ///< of the mesh; half of it takes six times as long
  int starts = 4;            ///< >= 1; drapes of the same cloth, each from an unevenness of its own
  unsigned seed = 1;
  /// Residual force on all vertices that counts as balanced, as a share of the weight.
  double tolerance = 1e-4;
  /// Called between steps with the share of the work done, by several threads at once; `false`
  /// cancels. May be empty.
  std::function<bool(double share)> go_on;

  void validate() const;  ///< throws InputError
};

/// A drape of the specimen.
struct Drape {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  double coefficient = 0;
  int nodes = 0;  ///< folds that stand out, counted along the rim
  double energy_j = 0;
  int iterations = 0;
  Eigen::Matrix3Xd position_m;  ///< 3 x vertices; z up, the disc's top at z = 0
  bool usable() const { return reason == MinimiseReason::converged; }
};

struct CusickResult {
  ClothMesh mesh;
  std::vector<Drape> drapes;  ///< one of each start
  int usable = 0;             ///< how many are
  /// Over the usable ones; NaN without any, the spread without a second.
  double mean_coefficient = 0, spread_coefficient = 0;  ///< spread: standard deviation
  double mean_nodes = 0;
};

/// Lets the specimen drape. It begins flat, but for an unevenness of a tenth of a millimetre. Its
/// weight grows from almost nothing, as that of a specimen whose support is lowered: sudden weight
/// makes more folds than a laboratory sees. Cloth above the disc stays. Contact of the cloth with
/// itself and with the disc's side is not looked for.
///
/// A start's drape depends on the options and the start's number alone, whatever the number of
/// threads.
CusickResult drape_cusick(const MeasuredFabric& fabric, const CusickOptions& options);

/// Returns how many folds stand out in the rim of a drape: places farther from the axis than what
/// lies between by `prominence_m` or more.
int count_nodes(const Eigen::VectorXd& rim_radius_m, double prominence_m);

}  // namespace clothfit
