#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/algebra/dense_factors.h"
#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Residuals near an optimum with everything taken out of them that the model may still move: its
/// parameters J under their priors P, and directions E of unit variance in which the model's own
/// discretisation errs. What is left of a vector v under the weights W,
///
///   v - [J E] H^-1 [J E]' W v,   H = [J E]' W [J E] + diag(P, I),
///
/// is what generalised least squares with the covariance W^-1 + E E' cannot explain by J. Behind
/// the residuals come rows of the priors and of E, one for each of their numbers: with these it is
/// an orthogonal projection, and products of projected vectors are those of that least squares.
class Projection {
 public:
  /// `weight`: Huber's, of each residual. `prior_gradient`: of half the sum of the priors' squares.
  Projection(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& prior_information,
             const Eigen::VectorXd& prior_gradient, const Eigen::MatrixXd& unit_directions,
             const Eigen::VectorXd& weight, const Eigen::VectorXd& residual);

  /// What is left of the residual, and of columns; times the square roots of the weights. Rows of
  /// the residuals first.
  const Eigen::VectorXd& residual() const { return residual_; }
  Eigen::MatrixXd columns(const Eigen::MatrixXd& of) const;

  /// Numbers that the residual loses by it, of its weights' sum.
  double taken() const { return taken_; }
  double weights() const { return root_weight_.squaredNorm(); }

 private:
  Eigen::VectorXd root_weight_;
  Eigen::MatrixXd moved_;  ///< sqrt(W) [J E], then the roots of diag(P, I)
  SymmetricFactors information_;
  Eigen::VectorXd residual_;
  double taken_ = 0;
};

/// The projection of a model of several recordings: what is each recording's own goes first, then
/// the shared parameters. Residuals beyond three robust scales, or three sigmas where that is more,
/// weigh less if the loss says so.
class ModelProjection {
 public:
  /// With the directions of the parts, or without any.
  ModelProjection(const FittedModel& model, Loss loss, bool with_directions = true);

  const Eigen::VectorXd& residual() const { return shared_.front().residual(); }
  /// Of columns that belong to all recordings: residuals x columns of each.
  Eigen::MatrixXd columns(const std::vector<Eigen::MatrixXd>& of) const;
  /// Where a recording's residuals lie in the projected vectors.
  Eigen::Index first_row(size_t recording) const { return first_row_[recording]; }

  double taken() const;
  double weights() const;

 private:
  Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& projected) const;

  std::vector<Projection> own_;
  std::vector<Projection> shared_;  ///< one
  std::vector<Eigen::Index> first_row_;
};

/// How well columns explain what is left of a residual: of least squares with both projected.
struct Explained {
  Eigen::VectorXd amplitude;    ///< of each column
  Eigen::MatrixXd information;  ///< of the amounts
  double decrease = 0;          ///< of the sum of squares
};

/// Amounts stay within their ends.
Explained explain(const Eigen::VectorXd& residual, const Eigen::MatrixXd& columns,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace clothfit
