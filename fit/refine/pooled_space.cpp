#include "fit/refine/pooled_space.h"

#include <algorithm>
#include <cassert>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"

namespace clothfit {

PooledSpace::PooledSpace(std::span<const FitProblem* const> problems)
    : problems_(problems.begin(), problems.end()), places_(problems.size()) {
  assert(!problems.empty());
  for (const FitParameter& parameter : problems.front()->space.parameters) {
    if (!is_physical(parameter.role)) continue;
    std::vector<int> indices;
    for (const FitProblem* problem : problems)
      indices.push_back(problem->space.index(parameter.name));
    if (std::ranges::find(indices, -1) != indices.end())
      throw InputError("pooled fit", "not all recordings have the parameter " + parameter.name,
                       "recordings of one cloth, with the same effects");
    shared_.push_back(std::move(indices));
  }
  size_ = shared();
  for (size_t n = 0; n < problems.size(); ++n) {
    const ParameterSpace& space = problems[n]->space;
    for (int p = 0; p < space.size(); ++p)
      if (!is_physical(space.parameters[static_cast<size_t>(p)].role)) places_[n].own.push_back(p);
    if (space.size() - static_cast<int>(places_[n].own.size()) != shared())
      throw InputError("pooled fit", "a recording has parameters of the physics that others lack",
                       "recordings of one cloth, with the same effects");
    places_[n].first = size_;
    size_ += static_cast<int>(places_[n].own.size());
  }
}

std::vector<int> PooledSpace::shared_of(size_t recording) const {
  std::vector<int> common;
  for (const std::vector<int>& indices : shared_) common.push_back(indices[recording]);
  return common;
}

Eigen::VectorXd PooledSpace::coordinates(const std::vector<Eigen::VectorXd>& values) const {
  Eigen::VectorXd x(size_);
  for (size_t n = problems_.size(); n-- > 0;) {  // the first one's shared values stay
    const Eigen::VectorXd own = problems_[n]->space.coordinates(values[n]);
    x.head(shared()) = own(shared_of(n));
    x.segment(places_[n].first, static_cast<Eigen::Index>(places_[n].own.size())) =
        own(places_[n].own);
  }
  return x;
}

std::vector<Eigen::VectorXd> PooledSpace::values(const Eigen::VectorXd& coordinates) const {
  std::vector<Eigen::VectorXd> result;
  for (size_t n = 0; n < problems_.size(); ++n) {
    Eigen::VectorXd own(problems_[n]->space.size());
    Eigen::Index next = 0;
    for (const int place : shared_of(n)) own[place] = coordinates[next++];
    next = places_[n].first;
    for (const int place : places_[n].own) own[place] = coordinates[next++];
    result.push_back(problems_[n]->space.values(own));
  }
  return result;
}

Eigen::VectorXd PooledSpace::ends(double FitParameter::*end) const {
  std::vector<Eigen::VectorXd> values;
  for (const FitProblem* problem : problems_) {
    Eigen::VectorXd of(problem->space.size());
    for (int p = 0; p < problem->space.size(); ++p)
      of[p] = problem->space.parameters[static_cast<size_t>(p)].*end;
    values.push_back(of);
  }
  return coordinates(values);
}

Eigen::VectorXd PooledSpace::lower() const {
  return ends(&FitParameter::lower);
}

Eigen::VectorXd PooledSpace::upper() const {
  return ends(&FitParameter::upper);
}

PooledSpace::Expansion PooledSpace::gather(const std::vector<Quadratic>& parts) const {
  Expansion result{.usable = true,
                   .gradient = Eigen::VectorXd::Zero(size_),
                   .shared = Eigen::MatrixXd::Zero(shared(), shared()),
                   .own = {},
                   .between = {}};
  for (size_t n = 0; n < parts.size(); ++n) {
    result.usable = result.usable && parts[n].usable;
    if (!result.usable) return result;
    const std::vector<int> common = shared_of(n);
    const std::vector<int>& own = places_[n].own;
    result.cost += parts[n].cost;
    result.gradient.head(shared()) += parts[n].gradient(common);
    result.gradient.segment(places_[n].first, static_cast<Eigen::Index>(own.size())) =
        parts[n].gradient(own);
    result.shared += parts[n].information(common, common);
    result.own.push_back(parts[n].information(own, own));
    result.between.push_back(parts[n].information(own, common));
  }
  return result;
}

Eigen::VectorXd PooledSpace::step(const Expansion& expansion, double damping,
                                  const std::vector<bool>& held) const {
  // A held coordinate, or one that nothing depends on, keeps a unit of its own on the diagonal.
  const auto prepared = [&](Eigen::MatrixXd information, int first) {
    for (Eigen::Index p = 0; p < information.rows(); ++p) {
      information(p, p) *= 1 + damping;
      if (!held[static_cast<size_t>(first + p)] && information(p, p) > 0) continue;
      information.row(p).setZero();
      information.col(p).setZero();
      information(p, p) = 1;
    }
    return information;
  };
  Eigen::VectorXd gradient = expansion.gradient;
  for (Eigen::Index p = 0; p < size_; ++p)
    if (held[static_cast<size_t>(p)]) gradient[p] = 0;
  Eigen::MatrixXd reduced = prepared(expansion.shared, 0);
  Eigen::VectorXd right = -gradient.head(shared());
  std::vector<SymmetricFactors> own;
  std::vector<Eigen::MatrixXd> between;
  for (size_t n = 0; n < places_.size(); ++n) {
    own.emplace_back(prepared(expansion.own[n], places_[n].first));
    between.push_back(expansion.between[n]);
    for (Eigen::Index p = 0; p < between[n].rows(); ++p)
      if (held[static_cast<size_t>(places_[n].first + p)]) between[n].row(p).setZero();
    for (Eigen::Index s = 0; s < shared(); ++s)
      if (held[static_cast<size_t>(s)]) between[n].col(s).setZero();
    if (between[n].rows() == 0) continue;
    reduced -= between[n].transpose() * own[n].solve(between[n]);
    right += between[n].transpose() *
             own[n].solve(gradient.segment(places_[n].first, between[n].rows()));
  }
  Eigen::VectorXd step(size_);
  step.head(shared()) = SymmetricFactors(reduced).solve(right);
  for (size_t n = 0; n < places_.size(); ++n) {
    const Eigen::Index count = between[n].rows();
    if (count == 0) continue;
    step.segment(places_[n].first, count) =
        own[n].solve(-gradient.segment(places_[n].first, count) - between[n] * step.head(shared()));
  }
  return step;
}

double PooledSpace::predicted_decrease(const Expansion& expansion,
                                       const Eigen::VectorXd& way) const {
  const auto shared_way = way.head(shared());
  double square = shared_way.dot(expansion.shared * shared_way);
  for (size_t n = 0; n < places_.size(); ++n) {
    const auto own = way.segment(places_[n].first, expansion.own[n].rows());
    square += own.dot(expansion.own[n] * own) + 2 * own.dot(expansion.between[n] * shared_way);
  }
  return -expansion.gradient.dot(way) - 0.5 * square;
}

}  // namespace clothfit
