// Checks products of small blocks with changes in every lane, on every instruction set. They are
// compared with dense arithmetic lane by lane.

#include "model/kernels/block_products.h"

#include <gtest/gtest.h>

#include "tests/model/instruction_sets.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

constexpr int kVertices = 5;
constexpr double kRounding = 1e-13;  ///< for sums of some ten numbers of size 1

LaneVectors<> random_lanes(Uniform& uniform) {
  LaneVectors<> vectors = LaneVectors<>::zero(kVertices);
  for (int lane = 0; lane < kLanes; ++lane) vectors.set_lane(lane, uniform.vectors(kVertices, 1));
  return vectors;
}

void expect_near(const LaneVectors<>& found, int lane, const Eigen::Matrix3Xd& expected) {
  EXPECT_LT((found.lane(lane) - expected).cwiseAbs().maxCoeff(), kRounding) << "lane " << lane;
}

class BlockProductsOn : public testing::TestWithParam<InstructionSet> {
 protected:
  BlockProductsOn() : on_(GetParam()) {}
  Uniform uniform_{7};
  const LaneVectors<> position_ = random_lanes(uniform_), velocity_ = random_lanes(uniform_);
  const LaneVectors<> before_ = random_lanes(uniform_);

 private:
  OnInstructionSet on_;
};

TEST_P(BlockProductsOn, BlocksOfMotionAddWhatDenseOnesDo) {
  // One block acts on the vertex it looks at, two on the same vertex, one has no part by velocity.
  std::vector<MotionBlock> blocks;
  for (const auto& [on, of] : {std::pair(0, 0), std::pair(3, 1), std::pair(3, 4)})
    blocks.push_back({on, of, uniform_.vectors(3, 2), uniform_.vectors(3, 2)});
  blocks.back().by_velocity.setZero();

  LaneVectors<> action = before_;
  add_products(blocks, position_, velocity_, action);

  for (int lane = 0; lane < kLanes; ++lane) {
    Eigen::Matrix3Xd expected = before_.lane(lane);
    for (const MotionBlock& block : blocks)
      expected.col(block.on) += block.by_position * position_.lane(lane).col(block.of) +
                                block.by_velocity * velocity_.lane(lane).col(block.of);
    expect_near(action, lane, expected);
  }
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
  LaneArray<> tension(kLanes, 2);
  for (double& value : tension.reshaped()) value = uniform_(-1, 1);

  LaneVectors<> action = before_;
  add_products(springs, tension, position_, velocity_, action);

  for (int lane = 0; lane < kLanes; ++lane) {
    Eigen::Matrix3Xd expected = before_.lane(lane);
    for (size_t n = 0; n < springs.size(); ++n) {
      const SpringJacobian& s = springs[n];
      const Eigen::Vector3d along = position_.lane(lane).col(s.b) - position_.lane(lane).col(s.a);
      const Eigen::Vector3d rate = velocity_.lane(lane).col(s.b) - velocity_.lane(lane).col(s.a);
      const Eigen::Vector3d pull =
          s.tension_ratio_n_per_m * along +
          s.direction * (s.w_n_per_m.dot(along) + s.damping_ns_per_m * s.direction.dot(rate) +
                         tension(lane, static_cast<Eigen::Index>(n)));
      expected.col(s.a) += pull;
      expected.col(s.b) -= pull;
    }
    expect_near(action, lane, expected);
  }
}

TEST_P(BlockProductsOn, BlocksOfForceActWhereTheForceIs) {
  const std::vector<ForceBlock> blocks{{2, uniform_.vectors(3, 2)}, {0, uniform_.vectors(3, 2)}};

  LaneVectors<> action = before_;
  add_products(blocks, position_, action);

  for (int lane = 0; lane < kLanes; ++lane) {
    Eigen::Matrix3Xd expected = before_.lane(lane);
    for (const ForceBlock& block : blocks)
      expected.col(block.on) += block.derivative * position_.lane(lane).col(block.on);
    expect_near(action, lane, expected);
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, BlockProductsOn, testing::ValuesIn(instruction_sets()),
                         [](const auto& set) { return set.param.name(); });

}  // namespace
}  // namespace clothfit
