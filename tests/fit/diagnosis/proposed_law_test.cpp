// Checks laws that are proposed for simulated recordings whose missing force is known. Not checked
// here: what the terms do (tests/model/effects/force_law_test.cpp, tension_law_test.cpp).
#include "fit/diagnosis/proposed_law.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "fit/diagnosis/discretisation.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/simulation.h"
#include "tests/fit/hidden_effect.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const FitOptions kProposedLawOptions{.loss = Loss::squared};

/// A cloth with few vertices, which is fitted soon.
const SyntheticCloth kProposalCloth{.mesh = 5, .markers = 5};

/// Makes a recording that a hidden effect moves, on the mesh of moved_by().
FitInput with_hidden(const DeclaredEffect& hidden, int held_out_from = 20) {
  return moved_by(
      hidden,
      synthetic_input({.markers = 5, .frames = held_out_from + 6, .held_out_from = held_out_from}));
}

/// The end of a diagnosis that has found nothing, and the law that is proposed for the residual.
struct Proposal {
  FitInput input;
  DiagnosisSetup setup{.inputs = {&input, 1},
                       .options = kProposedLawOptions,
                       .columns = input.recording.cloth.mesh_columns,
                       .rows = input.recording.cloth.mesh_rows};
  FittedModel model;
  ProposedLaw law;

  Proposal(FitInput recorded, int most_terms) : input(std::move(recorded)) {
    // Fits begin at the true fabric, which spares a search; first over ten frames.
    std::vector<NamedValues> start{named(SyntheticCloth{}.fabric)};
    for (const double share : {0.4, 1.0}) {
      model = shortened(model_at(setup, {}, start), share);
      refine_model(model, setup, {.iterations = 60}, {});
      EXPECT_TRUE(model.usable());
      start = model.values();
    }
    // Beside 9 x 9 vertices the errors of the mesh would take a model of 17 x 17.
    if (setup.columns == kProposalCloth.mesh) refine_with_discretisation(model, setup, {});
    EXPECT_TRUE(model.usable());
    law = propose_law(setup, model, {.most_terms = most_terms}, {});
  }

  /// Returns the rms of a model's residuals on the frames that no fit has seen, in sigmas.
  static double held_out_rms(const FittedModel& model) {
    const FitProblem& problem = *model.problems.front();
    const PooledPart& part = model.parts.front();
    const TrajectoryObjective all(problem, problem.frames(), part.steps);
    const Eigen::VectorXd residual = all.residuals({part.values}).front();
    double sum = 0;
    int count = 0;
    for (const Objective::Block& block : all.blocks()) {
      if (block.frame < problem.first_held_out) continue;
      sum += residual.segment(block.offset, block.dimension).squaredNorm();
      count += block.dimension;
    }
    return std::sqrt(sum / count);
  }

  /// Returns a coefficient of the law; 0 +- 0 where it has none.
  LawCoefficient coefficient(const std::string& parameter) const {
    const auto found = std::ranges::find(law.coefficients, parameter, &LawCoefficient::parameter);
    return found != law.coefficients.end() ? *found : LawCoefficient{};
  }

  void expect_that_it_halves_the_held_out_error() const {
    EXPECT_LT(law.after.mean, law.before.mean);
    EXPECT_LT(held_out_rms(law.model), 0.5 * held_out_rms(model));
  }
};

const Proposal& of_hidden_drag() {
  static const Proposal proposal(
      synthetic_input({.drag_rate_per_s = 1.2, .markers = 5, .frames = 26, .held_out_from = 20}),
      4);
  return proposal;
}

TEST(ProposedLaw, IsTheHiddenDragWithItsCoefficient) {
  const Proposal& proposal = of_hidden_drag();

  const LawCoefficient drag = proposal.coefficient("drag");
  ASSERT_GT(drag.sigma, 0) << proposal.law.formula;
  EXPECT_NEAR(drag.value, 1.2, 3 * drag.sigma);
  EXPECT_LT(drag.sigma, 0.12);
  EXPECT_EQ(proposal.law.coefficients.size(), 1u) << proposal.law.formula;
  EXPECT_THAT(proposal.law.formula, StartsWith("a = -1."));
  EXPECT_THAT(proposal.law.formula, HasSubstr(" 1/s v"));
  proposal.expect_that_it_halves_the_held_out_error();
}

TEST(ProposedLaw, IsTheHiddenDragWithTheSquareOfTheNormalSpeed) {
  const double c_n = 2.5;  // kg/m3
  const Proposal proposal(
      with_hidden({.name = "quadratic_drag", .parameters = {{"c_n", {c_n}}, {"c_t", {0}}}}), 1);

  const LawCoefficient drag = proposal.coefficient("normal_drag_squared");
  ASSERT_GT(drag.sigma, 0) << proposal.law.formula;
  EXPECT_NEAR(drag.value, c_n / 2, 3 * drag.sigma);
  EXPECT_LT(drag.sigma, 0.1 * c_n / 2);
  EXPECT_THAT(proposal.law.formula, StartsWith("p = -1."));
  EXPECT_THAT(proposal.law.formula, HasSubstr(" kg/m3 |n.v| (n.v) n"));
  proposal.expect_that_it_halves_the_held_out_error();
}

TEST(ProposedLaw, HasTwoTermsWhereTwoForcesAreHidden) {
  DeclaredEffect hidden{.name = "force_law", .parameters = {}};
  for (const EffectParameter& parameter : describe_effect("force_law").parameters)
    hidden.parameters[parameter.name] = {0};
  hidden.parameters["tangential_drag"] = {2};
  hidden.parameters["normal_push_by_s"] = {0.1};
  const Proposal proposal(with_hidden(hidden), 2);

  for (const auto& [parameter, truth] :
       std::map<std::string, double>{{"tangential_drag", 2}, {"normal_push_by_s", 0.1}}) {
    const LawCoefficient found = proposal.coefficient(parameter);
    ASSERT_GT(found.sigma, 0) << parameter << ": " << proposal.law.formula;
    EXPECT_NEAR(found.value, truth, 3 * found.sigma) << parameter;
  }
  proposal.expect_that_it_halves_the_held_out_error();
}

TEST(ProposedLaw, SeesATensionCurveThatBends) {
  const Proposal proposal(
      with_hidden({.name = "stiffening",
                   .parameters = {{"stretched", {2}}, {"compressed", {0}}, {"strain", {0.05}}}},
                  26),
      4);

  EXPECT_THAT(proposal.law.formula, HasSubstr("T / (k l0) = "));
  proposal.expect_that_it_halves_the_held_out_error();
}

TEST(ProposedLaw, TakesNoTermWhereNothingIsHidden) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    SyntheticCloth cloth = kProposalCloth;
    cloth.seed = seed;
    const Proposal proposal(synthetic_input(cloth), 4);

    EXPECT_FALSE(proposal.law.found()) << "seed " << seed << ": " << proposal.law.formula;
    EXPECT_EQ(proposal.law.formula, "");
    EXPECT_EQ(proposal.law.model.values(), proposal.model.values());
  }
}

// The model that comes with a law is one that simulations take. It does there what it did here.
TEST(ProposedLaw, CanBeSimulatedAsItStands) {
  const Proposal& proposal = of_hidden_drag();
  const FitProblem& problem = *proposal.law.model.problems.front();
  const PooledPart& found = proposal.law.model.parts.front();

  const Simulation simulation =
      make_simulation(describe_model(problem, proposal.input.recording, found.values));
  const SimulateResult result = run(simulation, found.steps.run_s);

  const SimulateResult here =
      run_model(problem, {found.values}, problem.frames(), found.steps).front();
  ASSERT_TRUE(result.usable());
  // Steps differ only in how they divide the frames' intervals; drag is 15 sigmas of 0.5 mm.
  for (size_t f = 0; f < here.position_m.size(); ++f)
    EXPECT_LT((result.position_m[f] - here.position_m[f]).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace clothfit
