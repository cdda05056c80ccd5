#include "fit/uncertainty/linearised_fit.h"

#include <string>

#include "data/input_error.h"

namespace clothfit {

void LinearisedFit::validate() const {
  const auto n = residual.size();
  const auto p = jacobian.cols();
  if (n == 0 || p == 0 || jacobian.rows() != n)
    throw InputError("linearised fit",
                     "a Jacobian of " + std::to_string(jacobian.rows()) + " x " +
                         std::to_string(p) + " for " + std::to_string(n) + " residuals",
                     "a row for each residual and a column for each coordinate, at least one");
  if (weight.size() != 0 && weight.size() != n)
    throw InputError("linearised fit", std::to_string(weight.size()) + " weights",
                     "one for each of " + std::to_string(n) + " residuals, or none");
  if (prior_information.size() != 0 &&
      (prior_information.rows() != p || prior_information.cols() != p))
    throw InputError("linearised fit", "prior information of another size",
                     "a square matrix of " + std::to_string(p) + " rows, or none");
  if (!residual.allFinite() || !jacobian.allFinite() || !weight.allFinite() ||
      !prior_information.allFinite())
    throw InputError("linearised fit", "a number that is not finite", "finite numbers");
  if (weight.size() != 0 && weight.minCoeff() < 0)
    throw InputError("linearised fit", "a weight below 0", "weights of 0 or more");
}

BlockSums sum_over_blocks(const LinearisedFit& fit, const Eigen::VectorXi& block) {
  fit.validate();
  if (block.size() != fit.residual.size())
    throw InputError("blocks", std::to_string(block.size()) + " block indices",
                     "one for each of " + std::to_string(fit.residuals()) + " residuals");
  const int count = block.maxCoeff() + 1;
  if (block.minCoeff() < 0 || count > fit.residuals())
    throw InputError("blocks", "an index below 0 or beyond the residuals", "0 ... blocks - 1");
  if (count < 2)
    throw InputError("blocks", "one block", "at least two",
                     "the gradient over all residuals is zero and tells of no scatter");

  std::vector<std::vector<Eigen::Index>> rows(static_cast<size_t>(count));
  for (Eigen::Index i = 0; i < block.size(); ++i) rows[static_cast<size_t>(block[i])].push_back(i);
  const int p = fit.coordinates();
  BlockSums sums;
  sums.gradient.resize(p, count);
  sums.prior_information = fit.prior_information.size() == 0
                               ? Eigen::MatrixXd::Zero(p, p)
                               : Eigen::MatrixXd(fit.prior_information);
  sums.total_information = sums.prior_information;
  for (int b = 0; b < count; ++b) {
    const auto& own = rows[static_cast<size_t>(b)];
    if (own.empty())
      throw InputError("blocks", "no residual in block " + std::to_string(b),
                       "indices without gaps");
    const Eigen::MatrixXd jacobian = fit.jacobian(own, Eigen::all);
    Eigen::MatrixXd weighted = jacobian;
    if (fit.weight.size() != 0) weighted = Eigen::VectorXd(fit.weight(own)).asDiagonal() * jacobian;
    sums.gradient.col(b) = weighted.transpose() * Eigen::VectorXd(fit.residual(own));
    sums.information.push_back(weighted.transpose() * jacobian);
    sums.total_information += sums.information.back();
  }
  return sums;
}

}  // namespace clothfit
