// Checks how far two hypotheses are apart in a recording, and in others that could be made. Not
// checked here: the projection (projection_test.cpp), derivatives
// (hypothesis_derivatives_test.cpp), what other recordings change (candidate_recording_test.cpp),
// and which hypotheses a search says are alike (search_test.cpp).
#include "fit/diagnosis/separation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "fit/diagnosis/candidate_recording.h"
#include "fit/diagnosis/diagnose.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/parameterised_model.h"
#include "model/effects/registry.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

FitOptions options_of(ObservationKind observations) {
  FitOptions options;
  options.loss = Loss::squared;
  options.observations = observations;
  return options;
}

const std::string kSeed = "seed " + std::to_string(SyntheticCloth().seed);

/// A cloth that is fitted and simulated soon.
const SyntheticCloth kSmallCloth{.mesh = 5, .markers = 5, .frames = 24, .held_out_from = 18};

const FitOptions kInSpace = options_of(ObservationKind::tracks3d);
const FitOptions kInPixels = options_of(ObservationKind::tracks2d);

DiagnosisSetup setup_of(const FitInput& input, const FitOptions& options) {
  return {.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
}

const Hypothesis kGravityTilt{
    .effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};
const Hypothesis kWorldTilt{
    .effect = "world_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};
const Hypothesis kGravityScale{.effect = "gravity_scale", .mode = "", .amplitudes = {"excess"}};
const Hypothesis kFrameRate{.effect = "frame_rate_error", .mode = "", .amplitudes = {"excess"}};
const Hypothesis kWind{.effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}};
const Hypothesis kWindDrag{.effect = "wind", .mode = "drag", .amplitudes = {"c"}};
const Hypothesis kGust{.effect = "gust",
                       .mode = "",
                       .amplitudes = {"q_x", "q_y", "q_z"},
                       .shape = {{"frequency", 1.5}, {"phase", 0}},
                       .shape_sigma = {{"frequency", 1.2}, {"phase", 0.125}}};

/// Amplitudes at which each of these is found.
const NamedValues kFound{{"gravity_tilt.about_x", 0.02},
                         {"gravity_tilt.about_y", 0.01},
                         {"gravity_scale.excess", 0.02},
                         {"wind.q_x", 0.005},
                         {"wind.q_y", 0.01},
                         {"viscous_damping.rate", 0.2}};

/// Returns a model that has hypotheses, with the true fabric; linearised.
FittedModel model_with(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses) {
  NamedValues values = named(SyntheticCloth().fabric);
  values.insert(kFound.begin(), kFound.end());
  FittedModel model = model_at(setup, hypotheses, {values});
  linearise_model(model);
  EXPECT_TRUE(model.usable());
  return model;
}

/// Returns the model in a candidate, linearised. It is not usable where that does not run.
FittedModel in(const CandidateRecording& candidate, const FittedModel& model) {
  FitProblem problem = *model.problems.front();
  candidate.change(problem);
  FittedModel there = model;
  PooledPart& part = there.parts.front();
  const bool runs = observe(problem, part.values, part.steps);
  part.frames = problem.first_held_out;
  there.problems = {std::make_shared<const FitProblem>(std::move(problem))};
  if (runs)
    linearise_model(there);
  else
    there.state = FitState::failed;
  return there;
}

/// Returns how far apart two hypotheses are in each candidate of some kinds.
std::multimap<CandidateKind, double> distances(const FittedModel& model,
                                               const Hypothesis& hypothesis,
                                               const Hypothesis& other,
                                               const std::set<CandidateKind>& kinds) {
  std::multimap<CandidateKind, double> result;
  for (const CandidateRecording& candidate : candidate_recordings(*model.problems.front())) {
    if (!kinds.contains(candidate.kind)) continue;
    const FittedModel there = in(candidate, model);
    EXPECT_TRUE(there.usable()) << candidate.what;
    if (there.usable())
      result.emplace(candidate.kind, hypothesis_distance(there, hypothesis, other));
  }
  return result;
}

double best(const std::multimap<CandidateKind, double>& distances, CandidateKind kind) {
  double most = -std::numeric_limits<double>::infinity();
  const auto [first, last] = distances.equal_range(kind);
  for (auto at = first; at != last; ++at) most = std::max(most, at->second);
  return most;
}

// The other route fits all parameters, and those of a hypothesis that the model has at neutral.
TEST(HypothesisDistance, IsWhatLeastSquaresLeave) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  const DiagnosisSetup setup = setup_of(input, kInSpace);
  FittedModel both = model_with(setup, {kWind, drag_hypothesis()});
  PooledPart& part = both.parts.front();
  const ParameterSpace& space = both.problems.front()->space;
  part.values[space.index("viscous_damping.rate")] = 0;
  linearise_model(both);
  ASSERT_TRUE(both.usable());
  const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(part.linear.residual.size());
  Eigen::MatrixXd others(change.size(), 0);
  for (int p = 0; p < space.size(); ++p) {
    const Eigen::VectorXd own = part.linear.residual_by_coordinate.col(p);
    if (space.parameters[static_cast<size_t>(p)].name.starts_with("wind.q_")) {
      change += part.values[p] / slope[p] * own;
    } else {
      others.conservativeResize(Eigen::NoChange, others.cols() + 1);
      others.rightCols(1) = own.normalized();
    }
  }
  const Eigen::VectorXd coefficients = others.colPivHouseholderQr().solve(change);
  const double expected = (change - others * coefficients).norm();

  const double found = hypothesis_distance(model_with(setup, {kWind}), kWind, drag_hypothesis());

  EXPECT_GT(expected, 1);
  // Time steps are those of either model's own stability, and the derivative is a difference.
  EXPECT_NEAR(found, expected, 0.01 * expected);
}

TEST(HypothesisDistance, IsNoneAlongWhatTheDiscretisationMayErrBy) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  FittedModel model = model_with(setup_of(input, kInSpace), {kWind});
  PooledPart& part = model.parts.front();
  EXPECT_GT(hypothesis_distance(model, kWind, drag_hypothesis()), 2);

  const ParameterSpace& space = model.problems.front()->space;
  const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
  part.directions = Eigen::MatrixXd::Zero(part.linear.residual.size(), 1);
  for (const std::string& name : kWind.parameters()) {
    const int p = space.index(name);
    part.directions += part.values[p] / slope[p] * part.linear.residual_by_coordinate.col(p);
  }

  // A length v along a direction of standard deviation v leaves v / sqrt(1 + v^2).
  EXPECT_LT(hypothesis_distance(model, kWind, drag_hypothesis()), 1);
}

TEST(HypothesisDistance, IsOfNoHypothesisThatCannotAct) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  const Hypothesis focal{.effect = "focal_error", .mode = "", .amplitudes = {"excess"}};
  const FittedModel model = model_with(setup_of(input, kInSpace), {kWind});

  EXPECT_TRUE(std::isnan(hypothesis_distance(model, kWind, focal)));
}

// A turn of gravity is one of all that is measured. A wrong frame rate is another gravity, where
// the fabric is free. Both hold in whatever is let go from supports that stand still.
TEST(Candidates, TellWhatIsTheSameByConstructionOnlyWhereSupportsMove) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  struct Case {
    Hypothesis hypothesis, other;
    double same;  ///< sigmas: single precision rounds, and the scheme's own error differs
  };
  for (const Case& of :
       {Case{kGravityTilt, kWorldTilt, 1e-2}, Case{kGravityScale, kFrameRate, 1}}) {
    SCOPED_TRACE(of.hypothesis.title());
    const FittedModel model = model_with(setup_of(input, kInSpace), {of.hypothesis});
    EXPECT_GT(hypothesis_distance(model, of.hypothesis, drag_hypothesis()), 5);
    EXPECT_LT(hypothesis_distance(model, of.hypothesis, of.other), of.same);

    const std::set<CandidateKind> still{CandidateKind::duration, CandidateKind::frame_rate,
                                        CandidateKind::attitude, CandidateKind::turned};
    std::set<CandidateKind> all = still;
    all.insert(CandidateKind::shaken);
    const std::multimap<CandidateKind, double> then =
        distances(model, of.hypothesis, of.other, all);

    for (const CandidateKind kind : still) {
      ASSERT_TRUE(then.contains(kind));
      EXPECT_LT(best(then, kind), of.same) << static_cast<int>(kind);
    }
    EXPECT_GT(best(then, CandidateKind::shaken), 10);
  }
}

// More is seen of the same run, and nothing more can be adjusted.
TEST(Candidates, OfMoreFramesOrCamerasTellNoWorse) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  for (const FitOptions* options : {&kInSpace, &kInPixels}) {
    const bool in_pixels = options == &kInPixels;
    for (const auto& [hypothesis, other] : {std::pair(kWind, kGust), std::pair(kWind, kWindDrag),
                                            std::pair(drag_hypothesis(), kWindDrag)}) {
      SCOPED_TRACE(hypothesis.title() + " and " + other.title() + (in_pixels ? ", pixels" : ""));
      const FittedModel model = model_with(setup_of(input, *options), {hypothesis});
      const double now = hypothesis_distance(model, hypothesis, other);

      const std::multimap<CandidateKind, double> then =
          distances(model, hypothesis, other,
                    {CandidateKind::duration, CandidateKind::frame_rate, CandidateKind::camera});

      constexpr double kRounding = 1 - 1e-6;
      EXPECT_GT(best(then, CandidateKind::duration), kRounding * now);
      // Frames between others cut time in another way.
      EXPECT_GT(best(then, CandidateKind::frame_rate), 0.99 * now);
      EXPECT_EQ(then.contains(CandidateKind::camera), in_pixels);
      if (in_pixels) {
        EXPECT_GT(best(then, CandidateKind::camera), kRounding * now);
      }
    }
  }
}

TEST(SeparatingRecordings, AreTheBestOfEachKindBesideTheNumberOfThePresentOne) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input({});
  const DiagnosisSetup setup = setup_of(input, kInSpace);
  const FittedModel model = model_with(setup, {kGravityScale, drag_hypothesis()});
  const std::vector<AcceptedEffect> accepted{
      {.trial = {.hypothesis = drag_hypothesis()}, .alike = {kWindDrag}},
      {.trial = {.hypothesis = kGravityScale}, .alike = {kFrameRate, drag_hypothesis()}}};

  const std::vector<std::vector<Separation>> found =
      separating_recordings(setup, model, accepted, {});

  ASSERT_EQ(found.size(), 2u);
  for (size_t n = 0; n < 2; ++n) {
    // Drag is in the model, so nothing is to be told from it.
    ASSERT_EQ(found[n].size(), 1u);
    const Separation& one = found[n].front();
    EXPECT_TRUE(one.from.same_mode(accepted[n].alike.front()));
    EXPECT_EQ(one.now, hypothesis_distance(model, accepted[n].trial.hypothesis, one.from));
    ASSERT_EQ(one.recordings.size(), 3u);
    for (size_t k = 1; k < 3; ++k)
      EXPECT_LE(one.recordings[k].sigmas, one.recordings[k - 1].sigmas);
    EXPECT_GT(one.recordings.front().sigmas, one.now);
  }
  EXPECT_TRUE(found[1].front().recordings.front().what.starts_with("held points shaken"));

  EXPECT_TRUE(
      separating_recordings(setup, model, {{.trial = {.hypothesis = kGravityScale}}}, {}).empty());
  int calls = 0;
  const auto stop_at_third = [&](const Progress&) { return ++calls < 3; };
  EXPECT_THROW(separating_recordings(setup, model, accepted, stop_at_third), StopRequested);
  EXPECT_EQ(calls, 3);
}

TEST(SeparatingRecordings, ErrAsTheModelDoes) {
  SCOPED_TRACE(kSeed);
  const FitInput input = synthetic_input(kSmallCloth);
  DiagnosisSetup setup = setup_of(input, kInSpace);
  setup.columns = setup.rows = kSmallCloth.mesh;
  const std::vector<AcceptedEffect> accepted{
      {.trial = {.hypothesis = kGravityScale}, .alike = {kFrameRate}}};
  const FittedModel exact = model_with(setup, {kGravityScale});
  FittedModel errs = that_may_err(setup, exact);
  errs.parts.front().correction = Eigen::VectorXd::Zero(exact.residual_count());

  const auto best_of = [&](const FittedModel& model) {
    return separating_recordings(setup, model, accepted, {})[0][0].recordings[0].sigmas;
  };
  const double with = best_of(errs), without = best_of(exact);

  EXPECT_LT(with, 0.9 * without);
  EXPECT_GT(with, 0.3 * without);
}

// A diagnosis from tracks finds an effect that cannot be told from another one. It could be if the
// supports had moved.
TEST(SeparatingRecordings, AreNamedByADiagnosis) {
  SCOPED_TRACE(kSeed);
  DiagnoseOptions options;
  options.fit.generations = 10;
  options.fit.population = 40;
  options.fit.refine_best = 1;
  options.refits = 3;
  options.most_effects = 1;
  options.law_terms = 0;
  // Few hypotheses are asked, for time's sake.
  for (const EffectEntry& entry : effect_registry())
    if (entry.name != kGravityTilt.effect && entry.name != kWind.effect)
      options.without.push_back(entry.name);
  // All that is measured is turned, about 0.8 degrees.
  FitInput input = synthetic_input(kSmallCloth);
  const Eigen::AngleAxisd turn(0.014, Eigen::Vector3d(1, 1, 0).normalized());
  for (Position3d& row : input.tracks3d) row.position_m = turn * row.position_m;

  const Diagnosis diagnosis = diagnose(input, options, {});

  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  ASSERT_FALSE(diagnosis.separation_of(0).empty());
  const Separation& one = diagnosis.separation_of(0).front();
  const std::set<std::string> names{diagnosis.accepted.front().trial.hypothesis.effect,
                                    one.from.effect};
  EXPECT_EQ(names, (std::set<std::string>{"gravity_tilt", "world_tilt"}));
  EXPECT_LT(one.now, 0.1);
  ASSERT_FALSE(one.recordings.empty());
  EXPECT_TRUE(one.recordings.front().what.starts_with("held points shaken"))
      << one.recordings.front().what;
  EXPECT_GT(one.recordings.front().sigmas, 5);
  EXPECT_TRUE(diagnosis.separation_of(1).empty());
}

}  // namespace
}  // namespace clothfit
