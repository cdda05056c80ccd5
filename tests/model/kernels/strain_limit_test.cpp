// Checks springs kept from stretching beyond their critical elongation. Not checked here: the
// springs' pull (cloth_sweep_test.cpp).

#include "model/kernels/strain_limit.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/model/instruction_sets.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// Two springs of type structural_t, 1 m apart: between vertices 0 and 2, and between 1 and 3.
constexpr Mesh kLimitedPair{.columns = 2, .rows = 2, .width_m = 1, .height_m = 0.1};

LaneLimits<> no_limits() {
  LaneLimits<> limits;
  for (LaneValue<>& longest : limits.longest_m) longest.setConstant(INFINITY);
  limits.tolerated_m = limits.longest_m;
  return limits;
}

/// Limits every type's springs to (1 + `critical`) times their flat length.
LaneLimits<> limits_of(const Mesh& mesh, double critical, double tolerance = 0) {
  LaneLimits<> limits;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    limits.longest_m[type].setConstant((1 + critical) * flat_lengths(mesh)[type]);
    limits.tolerated_m[type].setConstant((1 + critical + tolerance) * flat_lengths(mesh)[type]);
  }
  return limits;
}

/// Returns a flat cloth, `stretch` times as large, with noise.
Eigen::Matrix3Xd stretched(const Mesh& mesh, double stretch, Uniform& uniform) {
  return stretch * flat_positions(mesh) + uniform.vectors(mesh.vertex_count(), 0.02);
}

/// Returns the largest elongation beyond `critical`, as a share of the flat length.
double largest_excess(const Mesh& mesh, const Eigen::Matrix3Xd& position_m, double critical) {
  double largest = -1;
  const SpringNet net = make_springs(mesh);
  for (size_t type = 0; type < kSpringTypes; ++type)
    for (const auto& [a, b] : net[type])
      largest = std::max(
          largest,
          (position_m.col(b) - position_m.col(a)).norm() / flat_lengths(mesh)[type] - 1 - critical);
  return largest;
}

TEST(StrainLimit, SetsASpringToExactlyItsCriticalElongation) {
  // Given a spring of 0.1 m drawn out to 0.15 m between masses of 1 kg and 3 kg,
  LaneLimits<> limits = no_limits();
  limits.longest_m[structural_t].setConstant(0.11);
  Eigen::VectorXd mass_kg(4);
  mass_kg << 1, 1, 3, 1;
  Eigen::Matrix3Xd p = Eigen::Matrix3Xd::Zero(3, 4);
  p.col(2) << 0, 0.09, 0.12;
  p.col(1) << 1, 0, 0;
  p.col(3) << 1, 0.05, 0;  // and another that is shorter than it may be,
  LaneVectors<> position = every_lane(p);

  const LimitOutcome<> outcome =
      StrainLimiter<>(kLimitedPair, mass_kg.cwiseInverse()).limit_positions(limits, position);

  // then it is 0.11 m long, along the same line, and the light end moved three times as far.
  const Eigen::Matrix3Xd moved = position.lane(0);
  const Eigen::Vector3d along = p.col(2).normalized();
  EXPECT_LT((moved.col(0) - 0.75 * 0.04 * along).norm(), 1e-16);
  EXPECT_LT((moved.col(2) - (0.15 - 0.25 * 0.04) * along).norm(), 1e-16);
  EXPECT_EQ(moved.col(1), p.col(1));
  EXPECT_EQ(moved.col(3), p.col(3));
  EXPECT_TRUE((outcome.too_long == 1).all());
}

TEST(StrainLimit, MovesTheFreeEndAloneWhenTheOtherIsHeld) {
  LaneLimits<> limits = no_limits();
  limits.longest_m[structural_t].setConstant(0.11);
  Eigen::VectorXd inverse_mass(4);
  inverse_mass << 0, 0, 1, 0;  // the second pair is held at both ends
  Eigen::Matrix3Xd p = Eigen::Matrix3Xd::Zero(3, 4);
  p(1, 2) = 0.15;
  p.col(1) << 1, 0, 0;
  p.col(3) << 1, 0.2, 0;
  LaneVectors<> position = every_lane(p);

  StrainLimiter<>(kLimitedPair, inverse_mass).limit_positions(limits, position);

  Eigen::Matrix3Xd expected = p;
  expected(1, 2) = 0.11;
  EXPECT_LT((position.lane(0) - expected).cwiseAbs().maxCoeff(), 1e-16);
}

TEST(StrainLimit, ByFirstRatesSetsWhatWasTooLongAlthoughOthersHaveShortenedItSince) {
  // Given three vertices in a row, 0.15 m apart where 0.1 m is natural. The spring over both steps
  // (0.3 m) is limited to 0.29 m, those over one (type 1) to 0.11 m.
  const Mesh row{.columns = 3, .rows = 2, .width_m = 0.2, .height_m = 1};
  LaneLimits<> limits = no_limits();
  limits.longest_m[structural_s].setConstant(0.11);
  limits.longest_m[flexion_s].setConstant(0.29);
  Eigen::Matrix3Xd p = flat_positions(row);
  p.row(0) *= 1.5;
  StrainLimiter<> limiter(row, Eigen::VectorXd::Ones(6));
  LaneVectors<> in_turn = every_lane(p), by_first = in_turn;

  limiter.limit_positions(limits, in_turn);
  const LimitOutcome<> outcome = limiter.limit_by_first_rates(limits, by_first);

  // then the first pair moves to 0.02, 0.13; the second to 0.13 + 0.03, 0.30 - 0.03. The outer
  // vertices, 0.25 m apart by then, stay there, or move to 0.29 m by the first look.
  const auto x = [](const LaneVectors<>& position, int k) { return position.x(0, k); };
  EXPECT_NEAR(x(in_turn, 0), 0.02, 1e-15);
  EXPECT_NEAR(x(in_turn, 2), 0.27, 1e-15);
  EXPECT_NEAR(x(by_first, 0), 0.0, 1e-15);
  EXPECT_NEAR(x(by_first, 1), 0.16, 1e-15);
  EXPECT_NEAR(x(by_first, 2), 0.29, 1e-15);
  EXPECT_TRUE((outcome.too_long == 6).all());
}

TEST(StrainLimit, LeavesClothWithinItsLimitsAsItIs) {
  Uniform uniform(1);
  const Mesh mesh = square_mesh(9);
  const Eigen::Matrix3Xd p = flat_positions(mesh) + uniform.vectors(81, 0.002);
  ASSERT_LT(largest_excess(mesh, p, 0.2), 0);
  const Eigen::VectorXd inverse_mass = Eigen::VectorXd::Ones(81);
  LaneVectors<> position = every_lane(p), velocity = every_lane(uniform.vectors(81, 1));
  const Eigen::Matrix3Xd v = velocity.lane(0);
  StrainLimiter<> limiter(mesh, inverse_mass);

  const LimitOutcome<> once = limiter.limit_positions(limits_of(mesh, 0.2), position);
  const LimitOutcome<> consistent =
      limiter.limit_consistently(limits_of(mesh, 0.2), 10, 1e-3, position, velocity);
  const LimitOutcome<> by_first = limiter.limit_by_first_rates(limits_of(mesh, 0.2), position);
  const LimitOutcome<> never = limiter.limit_positions(no_limits(), position);

  for (const LimitOutcome<>& outcome : {once, by_first, consistent, never})
    EXPECT_TRUE((outcome.too_long == 0).all());
  EXPECT_TRUE((consistent.unmet == 0).all());
  EXPECT_EQ(position.lane(0), p);
  EXPECT_EQ(velocity.lane(0), v);
}

TEST(StrainLimit, KeepsTheCentreOfMassAndMomentum) {
  for (const unsigned seed : {2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Mesh mesh = square_mesh(9);
    const Eigen::VectorXd mass_kg = masses_by_area(mesh, 0.025);
    const Eigen::Matrix3Xd p = stretched(mesh, 1.3, uniform), v = uniform.vectors(81, 1);
    LaneVectors<> position = every_lane(p), velocity = every_lane(v);

    StrainLimiter<>(mesh, mass_kg.cwiseInverse())
        .limit_consistently(limits_of(mesh, 0.1), 20, 1e-3, position, velocity);

    const Eigen::Matrix3Xd moved = position.lane(0);
    EXPECT_GT((moved - p).cwiseAbs().maxCoeff(), 0.01);
    EXPECT_LT(((moved - p) * mass_kg).norm(), 1e-16);  // kg m
    EXPECT_LT(((velocity.lane(0) - v) * mass_kg).norm(), 1e-13);
    // The velocity of a vertex contains its move.
    EXPECT_LT((velocity.lane(0) - v - (moved - p) / 1e-3).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(StrainLimit, SweepsUntilNoSpringIsLongerThanToleratedOrSaysSo) {
  int met = 0, unmet = 0;
  for (const int vertices : {5, 9, 17}) {
    for (const double critical : {0.02, 0.1}) {
      for (const unsigned seed : {4u, 5u, 6u}) {
        SCOPED_TRACE(testing::Message() << vertices << ", " << critical << ", seed " << seed);
        // Given a crumpled and stretched cloth, held at its upper corners within reach,
        Uniform uniform(seed);
        const Mesh mesh = square_mesh(vertices);
        Eigen::VectorXd inverse_mass = masses_by_area(mesh, 0.025).cwiseInverse();
        Eigen::Matrix3Xd p = stretched(mesh, 1 + uniform(0, 0.3), uniform);
        p.col(0) << 0, 0, 0;
        p.col(vertices - 1) << 0.4, 0, 0;
        inverse_mass[0] = inverse_mass[vertices - 1] = 0;
        LaneVectors<> once = every_lane(p), position = once, velocity = every_lane(at_rest(p));
        StrainLimiter<> limiter(mesh, inverse_mass);

        limiter.limit_positions(limits_of(mesh, critical), once);
        const LimitOutcome<> outcome = limiter.limit_consistently(
            limits_of(mesh, critical, 1e-3), StrainLimit{}.most_sweeps, 1e-3, position, velocity);

        // then one sweep leaves springs that are too long, and many sweeps none, or that is said.
        EXPECT_GT(largest_excess(mesh, once.lane(0), critical), 2e-3);
        const bool is_met = (outcome.unmet == 0).all();
        EXPECT_EQ(is_met, largest_excess(mesh, position.lane(0), critical) < 1e-3 + 1e-12);
        ++(is_met ? met : unmet);
        EXPECT_EQ(position.lane(0).col(0), p.col(0));
        EXPECT_EQ(position.lane(0).col(vertices - 1), p.col(vertices - 1));
      }
    }
  }
  EXPECT_GT(met, 0);
  EXPECT_GT(unmet, 0);  // a large cloth asks for more sweeps than a step is given
}

TEST(StrainLimit, SaysWhenHeldPointsAreTooFarApart) {
  const Mesh mesh = square_mesh(5);
  Eigen::VectorXd inverse_mass = masses_by_area(mesh, 0.025).cwiseInverse();
  inverse_mass[0] = inverse_mass[4] = 0;
  Eigen::Matrix3Xd p = flat_positions(mesh);
  p.row(0) *= 1.125;  // the corners are 12.5 % apart, the springs between may stretch by 10 %
  LaneVectors<> position = every_lane(p), velocity = every_lane(at_rest(p));

  const LimitOutcome<> outcome =
      StrainLimiter<>(mesh, inverse_mass)
          .limit_consistently(limits_of(mesh, 0.1, 1e-3), 50, 1e-3, position, velocity);

  EXPECT_TRUE((outcome.unmet == 1).all());
}

// --- against plain arithmetic --------------------------------------------------------------------

/// Makes one sweep over plain vectors in the published order; returns whether it shortened a
/// spring. With `rates_first`, the given positions decide which springs are too long.
bool reference_sweep(const Mesh& mesh, const Eigen::VectorXd& inverse_mass,
                     const LaneLimits<>& limits, Eigen::Index lane, double steps_per_s,
                     Eigen::Matrix3Xd& p, Eigen::Matrix3Xd& v, bool rates_first = false) {
  bool shortened = false;
  const auto squared_length = [](const Eigen::Vector3d& d) {
    return d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
  };
  const Eigen::Matrix3Xd given = p;
  const SpringNet net = make_springs(mesh);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const int group : {0, 1}) {
      for (const Spring& spring : net[type]) {
        const int self = type == shear_up ? spring.b : spring.a;
        const int other = type == shear_up ? spring.a : spring.b;
        const int i = self / mesh.columns, j = self % mesh.columns;
        const int place = type == structural_s ? j
                          : type == flexion_s  ? j / 2
                          : type == flexion_t  ? i / 2
                                               : i;
        if (place % 2 != group) continue;
        const Eigen::Vector3d along = p.col(other) - p.col(self);
        const double length2 = squared_length(along);
        const double looked_at =
            rates_first ? squared_length(given.col(other) - given.col(self)) : length2;
        const double longest = limits.longest_m[type][lane];
        const double sum = inverse_mass[self] + inverse_mass[other];
        if (!(looked_at > longest * longest) || sum == 0) continue;
        shortened = true;
        double inverse =
            std::bit_cast<double>(0x5fe6eb50c7b537a9 - (std::bit_cast<std::int64_t>(length2) >> 1));
        for (int n = 0; n < 4; ++n)
          inverse = inverse * (1.5 - (0.5 * length2) * (inverse * inverse));
        const double excess = 1 - longest * inverse;
        const double first = inverse_mass[self] / sum, second = inverse_mass[other] / sum;
        p.col(self) += excess * first * along;
        p.col(other) -= excess * second * along;
        v.col(self) += steps_per_s * excess * first * along;
        v.col(other) -= steps_per_s * excess * second * along;
      }
    }
  }
  return shortened;
}

bool reference_is_tolerable(const Mesh& mesh, const Eigen::VectorXd& inverse_mass,
                            const LaneLimits<>& limits, Eigen::Index lane,
                            const Eigen::Matrix3Xd& p) {
  const SpringNet net = make_springs(mesh);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const auto& [a, b] : net[type]) {
      const Eigen::Vector3d d = p.col(b) - p.col(a);
      const double tolerated = limits.tolerated_m[type][lane];
      const double length2 = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
      if (length2 > tolerated * tolerated && inverse_mass[a] + inverse_mass[b] > 0) return false;
    }
  }
  return true;
}

class StrainLimitOn : public testing::TestWithParam<InstructionSet> {};

TEST_P(StrainLimitOn, AgreesWithPlainArithmeticToTheLastBit) {
  const OnInstructionSet on(GetParam());
  Uniform uniform(5);
  for (const Mesh& mesh :
       {square_mesh(9), Mesh{.columns = 3, .rows = 6, .width_m = 0.1, .height_m = 0.25}}) {
    SCOPED_TRACE(mesh.columns);
    // Given lanes that are stretched unlike, the first of them not at all,
    Eigen::VectorXd inverse_mass = masses_by_area(mesh, 0.025).cwiseInverse();
    inverse_mass[0] = inverse_mass[2] = 0;
    LaneLimits<> limits = limits_of(mesh, 0.1, 2e-3);
    LaneVectors<> position = LaneVectors<>::zero(mesh.vertex_count()), velocity = position;
    std::vector<Eigen::Matrix3Xd> p, v;
    for (int l = 0; l < kLanes; ++l) {
      p.push_back(l == 0 ? flat_positions(mesh) : stretched(mesh, 1 + 0.05 * l, uniform));
      v.push_back(uniform.vectors(mesh.vertex_count(), 1));
      for (LaneValue<>& longest : limits.longest_m) longest[l] *= 1 + 0.001 * l;
      position.set_lane(l, p.back());
      velocity.set_lane(l, v.back());
    }
    const LaneVectors<> start = position;

    // when they are limited until all are within their limits,
    StrainLimiter<> limiter(mesh, inverse_mass);
    limiter.limit_consistently(limits, 40, 1e-3, position, velocity);
    LaneVectors<> once = start, by_first = start;
    limiter.limit_positions(limits, once);
    limiter.limit_by_first_rates(limits, by_first);

    // then each is where it would be alone, bit for bit.
    for (int l = 0; l < kLanes; ++l) {
      SCOPED_TRACE(l);
      Eigen::Matrix3Xd first = start.lane(l), unused = at_rest(first);
      reference_sweep(mesh, inverse_mass, limits, l, 0, first, unused);
      EXPECT_EQ(once.lane(l), first);
      first = start.lane(l);
      reference_sweep(mesh, inverse_mass, limits, l, 0, first, unused, true);
      EXPECT_EQ(by_first.lane(l), first);

      const auto lane = static_cast<size_t>(l);
      for (int n = 0; n < 40; ++n) {
        if (!reference_sweep(mesh, inverse_mass, limits, l, 1000, p[lane], v[lane])) break;
        if (reference_is_tolerable(mesh, inverse_mass, limits, l, p[lane])) break;
      }
      EXPECT_EQ(position.lane(l), p[lane]);
      EXPECT_EQ(velocity.lane(l), v[lane]);
    }
    EXPECT_EQ(position.lane(0), start.lane(0));
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, StrainLimitOn, testing::ValuesIn(instruction_sets()),
                         [](const auto& set) { return set.param.name(); });

// --- in a cloth that swings ----------------------------------------------------------------------

/// A soft cloth, let go flat, that falls into its two held corners for half a second. Recorded are
/// the largest elongation beyond 10 %, and how many springs the limit had to shorten in the last
/// step.
struct LimitedSwing {
  double largest_excess = -1;
  double too_long = 0;
  bool met = true;
};

LimitedSwing swing(StrainLimitMode mode) {
  Cloth cloth = square_cloth(9);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
  cloth.strain_limit = {.mode = mode, .tolerance = 1e-3, .most_sweeps = 1000};
  Fabric soft = cotton();
  soft.tension_warp_n_per_m = soft.tension_weft_n_per_m = 4;
  ParameterSet set{.springs = spring_parameters(soft, cloth.mesh),
                   .start_position_m = flat_positions(cloth.mesh)};
  set.springs.critical_elongation.fill(0.1);
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  LimitedSwing result;
  for (int n = 0; n < 1000; ++n) {
    run.step(5e-4);
    result.met = result.met && run.limit_outcome().unmet[0] == 0;
    result.largest_excess =
        std::max(result.largest_excess, largest_excess(cloth.mesh, run.position_m(), 0.1));
  }
  result.too_long = run.limit_outcome().too_long[0];
  return result;
}

TEST(StrainLimit, HoldsTheWholeClothInTheConsistentMode) {
  const LimitedSwing free = swing(StrainLimitMode::off);
  const LimitedSwing paper = swing(StrainLimitMode::positions);
  const LimitedSwing consistent = swing(StrainLimitMode::consistent);

  EXPECT_GT(free.largest_excess, 0.3);
  EXPECT_TRUE(consistent.met);
  EXPECT_LT(consistent.largest_excess, 1e-3 + 1e-12);
  // The paper's single sweep lets later springs undo the corrections of earlier ones.
  EXPECT_GT(paper.largest_excess, 1e-3);
  EXPECT_LT(paper.largest_excess, free.largest_excess);
  EXPECT_GT(paper.too_long, 0);
}

}  // namespace
}  // namespace clothfit
