// Checks laws of a spring's tension. Not checked here: the effects that are written as such
// (tests/model/effects/).

#include "model/effects/spring_law.h"

#include <gtest/gtest.h>

#include "tests/model/effect_contract.h"
#include "tests/model/effect_derivatives.h"
#include "tests/model/plain_springs.h"

namespace clothfit {
namespace {

TEST(SpringLaw, OfPlainSpringsIsWhatTheKernelComputes) {
  Uniform uniform(1);
  const effect_contract::State state(uniform);
  const SpringLawEffect<PlainSprings> springs;

  const Eigen::Matrix3Xd law_n =
      effect_contract::force_n(springs, state, {}, at_rest(state.position_m));

  const Eigen::Matrix3Xd kernel_n =
      spring_forces_n(state.cloth.mesh, spring_parameters(cotton(), state.cloth.mesh),
                      state.position_m, state.velocity_m_per_s);
  EXPECT_LT((law_n - kernel_n).norm(), 1e-14 * kernel_n.norm());  // sums in another order
}

TEST(SpringLaw, DerivativesOfPlainSpringsAreTrue) {
  for (const unsigned seed : {1u, 2u}) {
    Uniform uniform(seed);
    EXPECT_EQ(derivative_mismatch(SpringLawEffect<PlainSprings>(), {}, {}, uniform), "") << seed;
  }
}

TEST(SpringLaw, ASpringOfNoLengthPullsAtNothing) {
  Uniform uniform(2);
  effect_contract::State state(uniform);
  state.position_m.setZero();

  EXPECT_EQ(effect_contract::force_n(SpringLawEffect<PlainSprings>(), state, {},
                                     at_rest(state.position_m))
                .cwiseAbs()
                .maxCoeff(),
            0);
}

TEST(SpringLaw, KnowsTheMiddleOfEverySpring) {
  const Mesh mesh{.columns = 5, .rows = 3, .width_m = 0.4, .height_m = 0.2};
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  for (const auto& springs : make_springs(mesh)) {
    for (const Spring& spring : springs) {
      const Eigen::Vector3d middle = 0.5 * (flat.col(spring.a) + flat.col(spring.b));

      const auto [s, t] = middle_of(mesh, spring);

      EXPECT_NEAR(s, middle.x() / 0.4, 1e-15);
      EXPECT_NEAR(t, middle.y() / 0.2, 1e-15);
    }
  }
}

}  // namespace
}  // namespace clothfit
