#include "model/topology/surface.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace clothfit {
namespace {

constexpr double kSmallestRelativeWeight = 1e-12;
constexpr double kOutsideAllowed_m = 1e-6;

/// Second derivatives of the natural cubic spline at its knots, as an n x n operator on the values.
/// There are n evenly spaced knots (spacing 1):
///
///   M_{k-1} + 4 M_k + M_{k+1} = 6 (f_{k-1} - 2 f_k + f_{k+1}),  M_0 = M_{n-1} = 0
///
/// by elimination without pivoting: the matrix is strictly diagonally dominant. Entries fall by 3.7
/// from one to the next beside the diagonal. Those beyond kBand, below 1e-37, are left out, so that
/// memory grows with n and not with its square.
class SecondDerivatives {
 public:
  static constexpr int kBand = 64;

  explicit SecondDerivatives(int n) : band_(BandRows::Zero(n, kWidth)) {
    Eigen::VectorXd above = Eigen::VectorXd::Zero(n);
    for (int k = 1; k + 1 < n; ++k) {
      const double pivot = 4 - above(k - 1);
      above(k) = 1 / pivot;
      band_(k, kBand - 1) += 6;
      band_(k, kBand) -= 12;
      band_(k, kBand + 1) += 6;
      band_.row(k).head(kWidth - 1) -= band_.row(k - 1).tail(kWidth - 1);
      band_.row(k) /= pivot;
    }
    for (int k = n - 2; k >= 1; --k)
      band_.row(k).tail(kWidth - 1) -= above(k) * band_.row(k + 1).head(kWidth - 1);
  }

  double operator()(int k, int column) const {
    const int place = column - k + kBand;
    return place >= 0 && place < kWidth ? band_(k, place) : 0;
  }

 private:
  static constexpr int kWidth = 2 * kBand + 1;
  using BandRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  BandRows band_;  ///< row k holds columns k - kBand to k + kBand
};

/// Returns weights (points x n) of the interpolation at the coordinates `x_m`, or of its derivative
/// there. The `n` knots are evenly spaced over [0, length_m]; the derivative has that `order` (0 to
/// 2; 1/m^order).
Surface::Weights axis_weights(int n, double length_m, const Eigen::VectorXd& x_m,
                              SurfaceInterpolation interpolation, int order) {
  const bool is_bicubic = interpolation == SurfaceInterpolation::bicubic;
  const SecondDerivatives second_derivatives(is_bicubic ? n : 0);
  std::vector<Eigen::Triplet<double>> kept;
  for (Eigen::Index point = 0; point < x_m.size(); ++point) {
    assert(x_m(point) >= -kOutsideAllowed_m && x_m(point) <= length_m + kOutsideAllowed_m);
    const double x = std::clamp(x_m(point) / length_m, 0.0, 1.0) * (n - 1);
    const int k = std::min(static_cast<int>(x), n - 2);
    const double u = x - k;

    // On [k, k + 1]: f = (1 - u) f_k + u f_{k+1} + c(1 - u) M_k + c(u) M_{k+1}, c(u) = (u^3 - u)/6.
    const int first = is_bicubic ? std::max(0, k - SecondDerivatives::kBand) : k;
    const int end = is_bicubic ? std::min(n, k + 2 + SecondDerivatives::kBand) : k + 2;
    Eigen::RowVectorXd weight = Eigen::RowVectorXd::Zero(end - first);
    if (order == 0) weight.segment<2>(k - first) << 1 - u, u;
    if (order == 1) weight.segment<2>(k - first) << -1, 1;
    if (is_bicubic) {
      const auto c = [order](double v) {
        return order == 0 ? v * (v * v - 1) / 6 : order == 1 ? (3 * v * v - 1) / 6 : v;
      };
      const double of_k = (order == 1 ? -1 : 1) * c(1 - u), of_next = c(u);
      for (int j = first; j < end; ++j)
        weight(j - first) +=
            of_k * second_derivatives(k, j) + of_next * second_derivatives(k + 1, j);
    }
    weight *= std::pow((n - 1) / length_m, order);

    const double smallest = kSmallestRelativeWeight * weight.cwiseAbs().maxCoeff();
    for (int j = first; j < end; ++j)
      if (std::abs(weight(j - first)) > smallest)
        kept.emplace_back(static_cast<int>(point), j, weight(j - first));
  }
  Surface::Weights weights(x_m.size(), n);
  weights.setFromTriplets(kept.begin(), kept.end());
  weights.makeCompressed();
  return weights;
}

/// Returns the orders along s and along t.
std::pair<int, int> derivative_orders(SurfaceQuantity quantity) {
  switch (quantity) {
    case SurfaceQuantity::place:
      return {0, 0};
    case SurfaceQuantity::by_s:
      return {1, 0};
    case SurfaceQuantity::by_t:
      return {0, 1};
    case SurfaceQuantity::by_ss:
      return {2, 0};
    case SurfaceQuantity::by_st:
      return {1, 1};
    case SurfaceQuantity::by_tt:
      return {0, 2};
  }
  return {0, 0};
}

}  // namespace

Surface make_surface(int columns, int rows, double width_m, double height_m,
                     const Eigen::Matrix2Xd& points, SurfaceInterpolation interpolation,
                     SurfaceQuantity quantity) {
  assert(columns >= 2 && rows >= 2);
  assert(width_m > 0 && height_m > 0);
  Surface surface;
  surface.columns = columns;
  surface.rows = rows;
  const auto [along_s, along_t] = derivative_orders(quantity);
  surface.row_weights = axis_weights(rows, height_m, points.row(1), interpolation, along_t);
  surface.column_weights = axis_weights(columns, width_m, points.row(0), interpolation, along_s);
  return surface;
}

void interpolate(const Surface& surface, int width, std::span<const double> vertex_values,
                 std::span<double> point_values) {
  assert(width >= 1);
  const auto stride = static_cast<size_t>(width);
  assert(vertex_values.size() == stride * static_cast<size_t>(surface.vertices()));
  assert(point_values.size() == stride * static_cast<size_t>(surface.points()));
  const auto columns = static_cast<size_t>(surface.columns);

  std::fill(point_values.begin(), point_values.end(), 0.0);
  double* point_value = point_values.data();
  for (int point = 0; point < surface.points(); ++point, point_value += stride) {
    for (Surface::Weights::InnerIterator row(surface.row_weights, point); row; ++row) {
      const double* row_values =
          vertex_values.data() + static_cast<size_t>(row.index()) * columns * stride;
      for (Surface::Weights::InnerIterator column(surface.column_weights, point); column;
           ++column) {
        const double weight = row.value() * column.value();
        const double* value = row_values + static_cast<size_t>(column.index()) * stride;
        for (size_t field = 0; field < stride; ++field) point_value[field] += weight * value[field];
      }
    }
  }
}

Eigen::Matrix3Xd Surface::evaluate(const Eigen::Matrix3Xd& positions) const {
  assert(positions.cols() == vertices());
  Eigen::Matrix3Xd at_points(3, points());
  interpolate(*this, 3, {positions.data(), static_cast<size_t>(positions.size())},
              {at_points.data(), static_cast<size_t>(at_points.size())});
  return at_points;
}

Surface::Weights vertex_weights(const Surface& surface) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int point = 0; point < surface.points(); ++point) {
    for (Surface::Weights::InnerIterator row(surface.row_weights, point); row; ++row) {
      for (Surface::Weights::InnerIterator column(surface.column_weights, point); column;
           ++column) {
        entries.emplace_back(
            point,
            static_cast<int>(row.index()) * surface.columns + static_cast<int>(column.index()),
            row.value() * column.value());
      }
    }
  }
  Surface::Weights weights(surface.points(), surface.vertices());
  weights.setFromTriplets(entries.begin(), entries.end());
  weights.makeCompressed();
  return weights;
}

}  // namespace clothfit
