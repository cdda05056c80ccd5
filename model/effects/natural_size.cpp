#include <algorithm>
#include <cmath>

#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Gives the fabric's springs another size at rest than the stated one. The cloth may have shrunk,
/// or its markers may have been placed by a wrong scale:
///
///   tension -= k l0 e,   e = warp  along the warp (types 0 and 4)
///                        e = weft  along the weft (types 1 and 5)
///                        e = (warp + weft) / 2  between them (types 2 and 3)
///
/// so that the natural length is l0 (1 + e) in place of l0. Where cells are square, the diagonal's
/// is that of a cell with such sides to the first order in warp - weft. Parameters: warp, weft
/// (ratios), neutral at 0. Ours.
namespace clothfit::natural_size {
namespace {

template <class Real>
Real change(SpringType type, const std::array<Real, 2>& along) {
  switch (type) {
    case structural_t:
    case flexion_t:
      return along[0];
    case structural_s:
    case flexion_s:
      return along[1];
    default:
      return Real(0.5) * (along[0] + along[1]);
  }
}

struct Law {
  static constexpr int kParameters = 2, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 2>& along,
                      std::array<Real, 0>&) {
    return -at.stiffness_n_per_m * at.natural_length_m * change(at.type, along);
  }

  // A constant pull stiffens a spring across itself, by k l0 |e| / l. Springs shorter than l0 are
  // stiffened more than this bound, but they are then stiff along themselves only.
  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& p) {
    const std::array<double, 2> along{p[0], p[1]};
    return {.frequency2_per_s2 = network_bound(cloth, [&](SpringType type, const Spring&) {
              return std::max(0.0, -change(type, along)) *
                     springs.stiffness_n_per_m[static_cast<size_t>(type)];
            })};
  }
};

/// The warp runs from top to bottom, the weft from left to right.
std::string in_words(const FittedEffect& found) {
  const auto side = [](double by_m, const char* way) {
    if (by_m == 0) return std::string();
    return millimetres(std::abs(by_m)) + (by_m < 0 ? " shorter " : " longer ") + way;
  };
  const std::string sides =
      listed({side(found.value("warp") * found.mesh.height_m, "from top to bottom"),
              side(found.value("weft") * found.mesh.width_m, "from left to right")});
  return sides.empty() ? sides : "unloaded, the cloth is " + sides;
}

}  // namespace

EffectDescription describe() {
  return {.name = "natural_size",
          .summary = "natural lengths l0 (1 + e), T = -k l0 e",
          .parameters = {{.name = "warp",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.1,
                          .typical = 0.02},
                         {.name = "weft",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.2,
                          .upper = 0.1,
                          .typical = 0.02}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::natural_size
