#include "fit/diagnosis/rival.h"

#include <utility>
#include <vector>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/hypothesis_derivatives.h"

namespace clothfit {
namespace {

/// Returns the columns of all recordings, one below the other; none where there are none.
Eigen::MatrixXd stacked(const Columns& columns) {
  Eigen::Index rows = 0;
  for (const Eigen::MatrixXd& own : columns) rows += own.rows();
  if (columns.empty() || rows == 0) return {};
  Eigen::MatrixXd all(rows, columns.front().cols());
  Eigen::Index first = 0;
  for (const Eigen::MatrixXd& own : columns) {
    all.middleRows(first, own.rows()) = own;
    first += own.rows();
  }
  return all;
}

}  // namespace

Change change_by(const DiagnosisSetup& setup, const FittedModel& model, size_t k) {
  std::vector<Hypothesis> others = model.hypotheses;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
  Change change{.without = model_at(setup, others, model.values()), .of_residuals = {}};
  Eigen::VectorXd all(model.residual_count());
  Eigen::Index first = 0;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    PooledPart& part = change.without.parts[n];
    part.frames = model.parts[n].frames;
    part.steps = model.parts[n].steps;
    const Eigen::VectorXd& with = model.parts[n].linear.residual;
    const Eigen::VectorXd residual = change.without.objective(n).residuals({part.values}).front();
    if (residual.size() != with.size()) return change;
    all.segment(first, with.size()) = with - residual;
    first += with.size();
  }
  change.of_residuals = std::move(all);
  return change;
}

FittedModel with_rival(const DiagnosisSetup& setup, const FittedModel& model, size_t k,
                       const Change& change, const Hypothesis& rival, const StageOptions& stage,
                       const ProgressCallback& progress) {
  const std::vector<Columns> columns = hypothesis_derivatives(change.without, {&rival, 1});
  const Eigen::MatrixXd jacobian = stacked(columns.front());
  if (jacobian.rows() != change.of_residuals.size() || jacobian.cols() == 0) return {};
  if (squared_multiple_correlation(change.of_residuals, jacobian) < kCriteria.changes_alike)
    return {};

  const Eigen::VectorXd amplitude = jacobian.colPivHouseholderQr().solve(change.of_residuals);
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  hypotheses[k] = rival;
  std::vector<NamedValues> values = model.values();
  set_amplitudes(rival, amplitude, values);
  FittedModel result = model_at(setup, hypotheses, values);
  for (size_t n = 0; n < result.parts.size(); ++n) {
    result.parts[n].frames = model.parts[n].frames;
    result.parts[n].correction = model.parts[n].correction;
    result.parts[n].directions = model.parts[n].directions;
    result.parts[n].amplitudes = model.parts[n].amplitudes;
  }
  refine_model(result, setup, stage, progress);
  return result;
}

}  // namespace clothfit
