// Checks held points as constraints of a minimisation. Not checked here: equilibria with them
// (equilibrium_test.cpp).

#include "model/rest/held_projection.h"

#include <gtest/gtest.h>

#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

const Mesh kSixBySix = square_mesh(6);

/// Returns a vertex, a point inside a cell, and one on an edge of the same cell.
std::vector<HeldVertexWeights> points() {
  return {held_at(kSixBySix, 0, 0), held_at(kSixBySix, 0.19, 0.23), held_at(kSixBySix, 0.16, 0.2)};
}

TEST(HeldProjection, PlacesAllPointsAtOnceByTheSmallestMove) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  const HeldProjection held(kSixBySix, points());
  const MeshField before =
      MeshField::of(FieldLayout::of(kSixBySix), crumpled(kSixBySix, 0.3, uniform));
  const Eigen::Matrix3Xd target_m = uniform.vectors(3, 1);

  MeshField after = before;
  held.place(target_m, after);

  EXPECT_LT((held.locate(after) - target_m).norm(), 1e-14);
  // The smallest move has no part along those that keep the points where they are.
  MeshField move = after;
  move.values -= before.values;
  MeshField kept = move;
  held.project(kept);
  EXPECT_LT(norm(kept), 1e-14 * norm(move));
}

TEST(HeldProjection, LeavesOnlyMovesThatHoldThePoints) {
  SCOPED_TRACE("seed 2");
  Uniform uniform(2);
  const HeldProjection held(kSixBySix, points());
  const MeshField field =
      MeshField::of(FieldLayout::of(kSixBySix), uniform.vectors(kSixBySix.vertex_count(), 1));

  MeshField once = field;
  held.project(once);
  MeshField twice = once;
  held.project(twice);

  EXPECT_LT(held.locate(once).norm(), 1e-15);
  EXPECT_EQ(once.at(0), Eigen::Vector3d::Zero().eval());  // a vertex that is held stays exactly
  twice.values -= once.values;
  EXPECT_LT(norm(twice), 1e-15);
  EXPECT_EQ(once.at(35), field.at(35));  // untouched
  EXPECT_GT(norm(once), 0.5 * norm(field));
}

TEST(HeldProjection, LetsTwoPointsShareAPlace) {
  const HeldProjection held(kSixBySix, {held_at(kSixBySix, 0, 0), held_at(kSixBySix, 0, 0)});
  MeshField field(FieldLayout::of(kSixBySix));

  held.place(Eigen::Matrix3Xd::Ones(3, 2), field);

  EXPECT_LT((field.at(0) - Eigen::Vector3d::Ones()).norm(), 1e-14);
}

}  // namespace
}  // namespace clothfit
