#include "fit/uncertainty/linearised_fit.h"

#include <cassert>

#include "data/input_error.h"

namespace clothfit {

void LinearisedFit::validate() const {
  assert(residual.size() > 0 && jacobian.cols() > 0 && jacobian.rows() == residual.size());
  assert(weight.size() == 0 || weight.size() == residual.size());
  assert(prior_information.size() == 0 || (prior_information.rows() == jacobian.cols() &&
                                           prior_information.cols() == jacobian.cols()));
  if (!residual.allFinite() || !jacobian.allFinite() || !weight.allFinite() ||
      !prior_information.allFinite())
    throw InputError("linearised fit", "a number that is not finite", "finite numbers");
  assert(weight.size() == 0 || weight.minCoeff() >= 0);
}

BlockSums sum_over_blocks(const LinearisedFit& fit, const Eigen::VectorXi& block) {
  fit.validate();
  assert(block.size() == fit.residual.size() && block.minCoeff() >= 0);
  const int count = block.maxCoeff() + 1;
  assert(count <= fit.residuals());
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
    assert(!own.empty());
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
