// Checks how models of the coarse mesh come to the analysed one. What a search finds on the coarse
// mesh is checked in search_test.cpp.
#include "fit/diagnosis/coarse_rounds.h"

#include <gtest/gtest.h>

#include <limits>

#include "fit/diagnosis/space_mapping.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

/// A dragged cloth whose recording has a coarse mesh.
const SyntheticCloth kOnTwoMeshes{
    .drag_rate_per_s = 1.2, .mesh = 13, .markers = 5, .frames = 20, .held_out_from = 16};

/// A search with the analysed mesh of 13 x 13 vertices, whose coarse one has 9 x 9.
struct TwoMeshes {
  FitInput input = synthetic_input(kOnTwoMeshes);
  FitOptions fit;
  DiagnosisSetup setup{.inputs = {&input, 1}, .options = fit, .columns = 13, .rows = 13};
  SearchOptions options{.threshold = std::numeric_limits<double>::infinity()};
  SearchContext search{setup, options, {}};
};

TEST(CorrectedOnMesh, LeavesWhatTheModelLeaves) {
  const TwoMeshes meshes;
  const FittedModel model = true_model(meshes.setup, kOnTwoMeshes, {drag_hypothesis()});

  const FittedModel coarse = corrected_on_mesh(meshes.search.coarse, model);

  ASSERT_TRUE(coarse.usable());
  EXPECT_EQ(coarse.problems.front()->cloth.mesh.columns, 9);
  EXPECT_LT((coarse.residual() - model.residual()).norm(), 1e-9 * model.residual().norm());
  EXPECT_GT(coarse.parts.front().correction.norm(), 0);
  EXPECT_FALSE(corrected_on_mesh(meshes.search.coarse, FittedModel()).usable());
}

TEST(LedToAnalysedMesh, EndsNearTheOptimumThere) {
  const TwoMeshes meshes;
  FittedModel coarse = true_model(meshes.search.coarse, kOnTwoMeshes, {drag_hypothesis()});
  refine_model(coarse, meshes.search.coarse, {}, {});
  FittedModel optimum = true_model(meshes.setup, kOnTwoMeshes, {drag_hypothesis()});
  refine_model(optimum, meshes.setup, {}, {});

  const FittedModel led = led_to_analysed_mesh(meshes.search, coarse);

  ASSERT_TRUE(led.usable());
  EXPECT_TRUE(led.is_unrefined());
  EXPECT_EQ(led.problems.front()->cloth.mesh.columns, 13);
  EXPECT_LT(meshes.search.left_by(led), 1.05 * meshes.search.left_by(optimum));
}

TEST(CoarseRounds, AreOfModelsThatMisfitGrosslyAlone) {
  const TwoMeshes meshes;
  const FittedModel model = true_model(meshes.setup, kOnTwoMeshes, {drag_hypothesis()});
  ASSERT_FALSE(model.misfits_grossly());

  CoarseRounds rounds;
  search_on_coarse_mesh(meshes.search, model, rounds);

  EXPECT_TRUE(rounds.first.empty());
  EXPECT_TRUE(rounds.found.empty());
}

}  // namespace
}  // namespace clothfit
