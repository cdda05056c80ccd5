#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/algebra/dense_factors.h"
#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// Takes out of residuals near an optimum everything that the model may still move. That is its
/// parameters J under their priors P, and directions E of unit variance in which the model's own
/// discretisation errs. Of a vector v under the weights W there remains
///
///   v - [J E] H^-1 [J E]' W v,   H = [J E]' W [J E] + diag(P, I).
///
/// Generalised least squares with the covariance W^-1 + E E' cannot explain this by J. Behind the
/// residuals come rows of the priors and of E, one for each of their numbers. With these it is an
/// orthogonal projection, and products of projected vectors are those of that least squares.
class Projection {
 public:
  /// `weight` is Huber's, of each residual. `prior_gradient` is that of half the sum of the priors'
  /// squares.
  Projection(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& prior_information,
             const Eigen::VectorXd& prior_gradient, const Eigen::MatrixXd& unit_directions,
             const Eigen::VectorXd& weight, const Eigen::VectorXd& residual);

  /// The projected residual and projected columns, times the square roots of the weights. Rows of
  /// the residuals come first.
  const Eigen::VectorXd& residual() const { return residual_; }
  Eigen::MatrixXd columns(const Eigen::MatrixXd& of) const;

  /// Numbers that the projection takes from the residual, and the sum of its weights.
  double taken() const { return taken_; }
  double weights() const { return root_weight_.squaredNorm(); }

 private:
  Eigen::VectorXd root_weight_;
  Eigen::MatrixXd moved_;  ///< sqrt(W) [J E], then the roots of diag(P, I)
  SymmetricFactors information_;
  Eigen::VectorXd residual_;
  double taken_ = 0;
};

/// The projection of a model of several recordings. What is each recording's own is taken out
/// first, then the shared parameters. Residuals beyond three robust scales, or three sigmas where
/// that is more, weigh less if the loss says so.
class ModelProjection {
 public:
  /// Projects with the directions of the parts, or without any.
  ModelProjection(const FittedModel& model, Loss loss, bool with_directions = true);

  const Eigen::VectorXd& residual() const { return shared_.front().residual(); }
  /// Projects columns that belong to all recordings: residuals x columns of each.
  Eigen::MatrixXd columns(const std::vector<Eigen::MatrixXd>& of) const;
  /// Returns where a recording's residuals begin in the projected vectors.
  Eigen::Index first_row(size_t recording) const { return first_row_[recording]; }

  double taken() const;
  double weights() const;

 private:
  Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& projected) const;

  std::vector<Projection> own_;
  std::vector<Projection> shared_;  ///< one
  std::vector<Eigen::Index> first_row_;
};

/// The least squares of a residual by columns, with both projected.
struct Explained {
  Eigen::VectorXd amplitude;    ///< of each column
  Eigen::MatrixXd information;  ///< of the amplitudes
  double decrease = 0;          ///< of the sum of squares
};

/// Explains a residual by columns, with amplitudes from `lower` to `upper`.
Explained explain(const Eigen::VectorXd& residual, const Eigen::MatrixXd& columns,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace clothfit
