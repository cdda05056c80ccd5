// Checks products of small blocks with changes in every exact and every fast lane, on every
// instruction set. They are compared with dense arithmetic lane by lane.

#include "model/kernels/block_products.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/model/instruction_sets.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

constexpr int kVertices = 5;
/// For sums of some ten numbers of size 1.
template <class L>
constexpr double kRounding = 500 * std::numeric_limits<typename L::Number>::epsilon();

template <class L>
LaneVectors<L> random_lanes(Uniform& uniform) {
  LaneVectors<L> vectors = LaneVectors<L>::zero(kVertices);
  for (int lane = 0; lane < L::kCount; ++lane)
    vectors.set_lane(lane, uniform.vectors(kVertices, 1));
  return vectors;
}

template <class L>
void expect_near(const LaneVectors<L>& found, int lane, const Eigen::Matrix3Xd& expected) {
  EXPECT_LT((found.lane(lane) - expected).cwiseAbs().maxCoeff(), kRounding<L>) << "lane " << lane;
}

class BlockProductsOn : public testing::TestWithParam<InstructionSet> {
 protected:
  BlockProductsOn() : on_(GetParam()) {}
  /// Calls `check(position, velocity, before)` with changes in exact lanes, then in fast ones.
  template <class Check>
  void in_all_lanes(const Check& check) {
    in_lanes<ExactLanes>(check);
    in_lanes<FastLanes>(check);
  }

  Uniform uniform_{7};

 private:
  template <class L, class Check>
  void in_lanes(const Check& check) {
    const LaneVectors<L> position = random_lanes<L>(uniform_), velocity = random_lanes<L>(uniform_);
    check(position, velocity, random_lanes<L>(uniform_));
  }

  OnInstructionSet on_;
};

TEST_P(BlockProductsOn, BlocksOfMotionAddWhatDenseOnesDo) {
  // One block acts on the vertex it looks at, two on the same vertex, one has no part by velocity.
  std::vector<MotionBlock> blocks;
  for (const auto& [on, of] : {std::pair(0, 0), std::pair(3, 1), std::pair(3, 4)})
    blocks.push_back({on, of, uniform_.vectors(3, 2), uniform_.vectors(3, 2)});
  blocks.back().by_velocity.setZero();

  in_all_lanes([&]<class L>(const LaneVectors<L>& position, const LaneVectors<L>& velocity,
                            const LaneVectors<L>& before) {
    LaneVectors<L> action = before;
    add_products(blocks, position, velocity, action);

    for (int lane = 0; lane < L::kCount; ++lane) {
      Eigen::Matrix3Xd expected = before.lane(lane);
      for (const MotionBlock& block : blocks)
        expected.col(block.on) += block.by_position * position.lane(lane).col(block.of) +
                                  block.by_velocity * velocity.lane(lane).col(block.of);
      expect_near(action, lane, expected);
    }
  });
}

TEST_P(BlockProductsOn, SpringsPullTheirEndsAgainstEachOther) {
  std::vector<SpringJacobian> springs;
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(4, 1)})
    springs.push_back({.a = a,
                       .b = b,
                       .direction = uniform_.vectors(1, 1).col(0).normalized(),
                       .w_n_per_m = uniform_.vectors(1, 2).col(0),
                       .tension_ratio_n_per_m = uniform_(-1, 1),
                       .damping_ns_per_m = uniform_(0, 1)});
  in_all_lanes([&]<class L>(const LaneVectors<L>& position, const LaneVectors<L>& velocity,
                            const LaneVectors<L>& before) {
    LaneArray<L> tension(L::kCount, 2);
    for (typename L::Number& value : tension.reshaped())
      value = static_cast<typename L::Number>(uniform_(-1, 1));

    LaneVectors<L> action = before;
    add_products(springs, tension, position, velocity, action);

    for (int lane = 0; lane < L::kCount; ++lane) {
      Eigen::Matrix3Xd expected = before.lane(lane);
      for (size_t n = 0; n < springs.size(); ++n) {
        const SpringJacobian& s = springs[n];
        const Eigen::Vector3d along = position.lane(lane).col(s.b) - position.lane(lane).col(s.a);
        const Eigen::Vector3d rate = velocity.lane(lane).col(s.b) - velocity.lane(lane).col(s.a);
        const Eigen::Vector3d pull =
            s.tension_ratio_n_per_m * along +
            s.direction * (s.w_n_per_m.dot(along) + s.damping_ns_per_m * s.direction.dot(rate) +
                           tension(lane, static_cast<Eigen::Index>(n)));
        expected.col(s.a) += pull;
        expected.col(s.b) -= pull;
      }
      expect_near(action, lane, expected);
    }
  });
}

TEST_P(BlockProductsOn, BlocksOfForceActWhereTheForceIs) {
  const std::vector<ForceBlock> blocks{{2, uniform_.vectors(3, 2)}, {0, uniform_.vectors(3, 2)}};

  in_all_lanes([&]<class L>(const LaneVectors<L>& position, const LaneVectors<L>& velocity,
                            const LaneVectors<L>& before) {
    static_cast<void>(velocity);
    LaneVectors<L> action = before;
    add_products(blocks, position, action);

    for (int lane = 0; lane < L::kCount; ++lane) {
      Eigen::Matrix3Xd expected = before.lane(lane);
      for (const ForceBlock& block : blocks)
        expected.col(block.on) += block.derivative * position.lane(lane).col(block.on);
      expect_near(action, lane, expected);
    }
  });
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, BlockProductsOn, testing::ValuesIn(instruction_sets()),
                         [](const auto& set) { return set.param.name(); });

}  // namespace
}  // namespace clothfit
