#include "fit/diagnosis/adequacy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "data/algebra/dense_factors.h"
#include "data/parallel.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/diagnosis/projection.h"

namespace clothfit {
namespace {

/// Mean product of pairs of residuals over their mean square, with its standard score.
struct Correlation {
  double value = 0, score = 0;
};

using Place = std::pair<int, int>;  ///< marker, frame

/// Returns where each marker's residuals lie in each frame, for one set of observations.
std::map<Place, const Objective::Block*> blocks_of(const TrajectoryObjective& objective, int set) {
  std::map<Place, const Objective::Block*> found;
  for (const Objective::Block& block : objective.blocks())
    if (block.set == set) found[{block.marker, block.frame}] = &block;
  return found;
}

/// Returns pairs of markers that are nearest to each other on the cloth, within a tenth. Each pair
/// comes once.
std::vector<std::pair<int, int>> neighbours(const Eigen::Matrix2Xd& place_m) {
  std::vector<std::pair<int, int>> pairs;
  for (Eigen::Index m = 0; m < place_m.cols(); ++m) {
    double nearest = INFINITY;
    for (Eigen::Index o = 0; o < place_m.cols(); ++o)
      if (o != m) nearest = std::min(nearest, (place_m.col(o) - place_m.col(m)).norm());
    for (Eigen::Index o = m + 1; o < place_m.cols(); ++o)
      if ((place_m.col(o) - place_m.col(m)).norm() < 1.1 * nearest)
        pairs.emplace_back(static_cast<int>(m), static_cast<int>(o));
  }
  return pairs;
}

Correlation correlation(double products, double squares, double count) {
  if (count == 0 || squares == 0) return {};
  // Each product of white residuals has variance sigma^4.
  return {products / squares, products / (squares / count * std::sqrt(count))};
}

/// Returns cos(pi k x) for k below `count`, smooth functions for each x from 0 to 1: count x
/// places.
Eigen::MatrixXd waves(int count, const Eigen::VectorXd& x) {
  Eigen::MatrixXd result(count, x.size());
  for (int k = 0; k < count; ++k) result.row(k) = (std::numbers::pi * k * x).array().cos();
  return result;
}

/// Returns smooth functions of place and time for each coordinate of each set of observations. They
/// are products of `along` waves each way over the cloth and `in_time` over the frames.
Eigen::MatrixXd smooth_functions(const TrajectoryObjective& objective, int along, int in_time) {
  const FitProblem& problem = objective.problem();
  const Eigen::Vector2d first = problem.marker_place_m.rowwise().minCoeff();
  const Eigen::Vector2d extent =
      (problem.marker_place_m.rowwise().maxCoeff() - first).cwiseMax(1e-9);
  const Eigen::Map<const Eigen::VectorXd> time_s(problem.frame_time_s.data(), objective.frames());
  const double length_s = std::max(time_s[time_s.size() - 1] - time_s[0], 1e-9);
  const auto along_axis = [&](Eigen::Index axis) -> Eigen::VectorXd {
    return (problem.marker_place_m.row(axis).array() - first[axis]) / extent[axis];
  };
  const Eigen::MatrixXd over_s = waves(along, along_axis(0)), over_t = waves(along, along_axis(1)),
                        over_time = waves(in_time, (time_s.array() - time_s[0]) / length_s);
  int kinds = 0;
  std::vector<int> first_kind;
  for (const ObservationSet& set : problem.observations) {
    first_kind.push_back(kinds);
    kinds += set.dimension;
  }
  const int each = along * along * in_time;
  Eigen::MatrixXd functions =
      Eigen::MatrixXd::Zero(objective.residual_count(), static_cast<Eigen::Index>(each) * kinds);
  for (const Objective::Block& block : objective.blocks())
    for (int c = 0; c < block.dimension; ++c) {
      Eigen::Index column =
          static_cast<Eigen::Index>(first_kind[static_cast<size_t>(block.set)] + c) * each;
      for (int i = 0; i < along; ++i)
        for (int j = 0; j < along; ++j)
          for (int k = 0; k < in_time; ++k)
            functions(block.offset + c, column++) =
                over_s(i, block.marker) * over_t(j, block.marker) * over_time(k, block.frame);
    }
  return functions;
}

/// Sums over pairs of blocks.
struct Pairs {
  double products = 0, squares = 0, count = 0;

  void add(const Eigen::Ref<const Eigen::VectorXd>& one,
           const Eigen::Ref<const Eigen::VectorXd>& other) {
    products += one.dot(other);
    squares += 0.5 * (one.squaredNorm() + other.squaredNorm());
    count += static_cast<double>(one.size());
  }
};

/// Adds a recording's pairs: a marker and itself in the next frame, and neighbours in one frame.
void add_pairs(const TrajectoryObjective& objective,
               const Eigen::Ref<const Eigen::VectorXd>& residual, Pairs& in_time, Pairs& along) {
  const FitProblem& problem = objective.problem();
  const std::vector<std::pair<int, int>> near = neighbours(problem.marker_place_m);
  const auto of = [&](const Objective::Block* block) {
    return residual.segment(block->offset, block->dimension);
  };
  for (size_t s = 0; s < problem.observations.size(); ++s) {
    const auto blocks = blocks_of(objective, static_cast<int>(s));
    for (const auto& [place, block] : blocks) {
      const auto next = blocks.find({place.first, place.second + 1});
      if (next != blocks.end()) in_time.add(of(block), of(next->second));
    }
    for (int frame = 0; frame < objective.frames(); ++frame) {
      for (const auto& [one, other] : near) {
        const auto a = blocks.find({one, frame}), b = blocks.find({other, frame});
        if (a != blocks.end() && b != blocks.end()) along.add(of(a->second), of(b->second));
      }
    }
  }
}

/// The square that smooth functions take from the projected residual, and their number.
struct Taken {
  double square = 0, rank = 0;
};

Taken taken_by_smooth(const FittedModel& model, const ModelProjection& projection, int along,
                      int in_time) {
  Taken taken;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    Columns functions;
    for (size_t m = 0; m < model.parts.size(); ++m)
      functions.push_back(smooth_functions(model.objective(m), along, in_time));
    if (2 * functions[n].cols() > functions[n].rows()) continue;
    // Each recording has functions of its own.
    for (size_t m = 0; m < model.parts.size(); ++m)
      if (m != n) functions[m] = Eigen::MatrixXd::Zero(functions[m].rows(), functions[n].cols());
    const Eigen::MatrixXd left = projection.columns(functions);
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(left.cols(), left.cols());
    information.selfadjointView<Eigen::Lower>().rankUpdate(left.transpose());
    information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
    const LeastNormFactors solver(information);
    const Eigen::VectorXd pull = left.transpose() * projection.residual();
    taken.square += pull.dot(solver.solve(pull));
    taken.rank += static_cast<double>(solver.rank());
  }
  return taken;
}

void add_smooth(const FittedModel& model, const ModelProjection& projection, Adequacy& result) {
  const double chi_square = projection.residual().squaredNorm();
  constexpr std::pair<int, int> kSets[] = {{1, 4}, {2, 4}, {2, 8}, {3, 6}};
  std::array<Taken, std::size(kSets)> taken_by_set;
  for_each_index(std::size(kSets), [&](size_t k) {
    taken_by_set[k] = taken_by_smooth(model, projection, kSets[k].first, kSets[k].second);
  });
  for (const Taken& taken : taken_by_set) {
    if (taken.rank == 0) continue;
    const double score = (taken.square - taken.rank) / std::sqrt(2 * taken.rank);
    if (score <= result.smooth_score) continue;
    result.smooth_score = score;
    result.smooth_share = (taken.square - taken.rank) / chi_square;
  }
}

bool looks_like_noise(const Adequacy& of) {
  const double discretisation = of.discretisation_square;
  const bool structured =
      of.smooth_score > kCriteria.structure_score &&
      of.smooth_share * of.chi_square_per_dof >
          std::max(kCriteria.structure_share, kCriteria.smooth_discretisation * discretisation);
  return !structured &&
         of.chi_square_per_dof < 1 + std::max(kCriteria.excess_chi_square,
                                              kCriteria.left_discretisation * discretisation);
}

}  // namespace

double discretisation_expected(const FittedModel& model) {
  double square = 0;
  for (const PooledPart& part : model.parts) square += part.directions.squaredNorm();
  return square / static_cast<double>(model.residual_count());
}

double discretisation_found(const FittedModel& model) {
  double square = 0;
  for (const PooledPart& part : model.parts)
    square += (residual_of(part) - part.linear.residual).squaredNorm();
  return square / static_cast<double>(model.residual_count());
}

Adequacy judge_adequacy(const FittedModel& model, Loss loss) {
  const ModelProjection projection(model, loss);
  const ModelProjection noise_alone(model, loss, false);
  Adequacy result;
  const Eigen::VectorXd& residual = projection.residual();
  result.chi_square_per_dof =
      residual.squaredNorm() / std::max(1.0, projection.weights() - projection.taken());
  result.noise_chi_square_per_dof = noise_alone.residual().squaredNorm() /
                                    std::max(1.0, noise_alone.weights() - noise_alone.taken());

  Pairs time_pairs, near_pairs;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const TrajectoryObjective objective = model.objective(n);
    add_pairs(objective, residual.segment(projection.first_row(n), objective.residual_count()),
              time_pairs, near_pairs);
  }
  const Correlation in_time =
      correlation(time_pairs.products, time_pairs.squares, time_pairs.count);
  const Correlation along = correlation(near_pairs.products, near_pairs.squares, near_pairs.count);
  result.time_correlation = in_time.value;
  result.time_score = in_time.score;
  result.neighbour_correlation = along.value;
  result.neighbour_score = along.score;

  add_smooth(model, projection, result);
  result.discretisation_square = discretisation_expected(model);
  result.discretisation_found = discretisation_found(model);
  result.adequate = looks_like_noise(result);
  return result;
}

}  // namespace clothfit
