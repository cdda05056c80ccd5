// Checks the surface between the vertices. Not checked here: how the vertices move (step_test.cpp),
// and how a point of the surface becomes a pixel (tests/calib/camera/projection_test.cpp).

#include "model/topology/surface.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

namespace clothfit {
namespace {

constexpr double kWidth_m = 0.40;
constexpr double kHeight_m = 0.30;

Eigen::Matrix2Xd random_points(int count, unsigned seed) {
  std::mt19937_64 rng(seed);
  Eigen::Matrix2Xd points(2, count);
  const auto uniform = [&] { return static_cast<double>(rng() >> 11) * 0x1p-53; };
  for (int p = 0; p < count; ++p) points.col(p) << kWidth_m * uniform(), kHeight_m * uniform();
  return points;
}

/// Returns material coordinates of the vertices, in the order of their indices.
Eigen::Matrix2Xd vertex_points(int columns, int rows) {
  Eigen::Matrix2Xd points(2, columns * rows);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j)
      points.col(i * columns + j) << j * kWidth_m / (columns - 1), i * kHeight_m / (rows - 1);
  return points;
}

template <class Shape>
Eigen::Matrix3Xd sample(const Eigen::Matrix2Xd& points, const Shape& shape) {
  Eigen::Matrix3Xd positions(3, points.cols());
  for (Eigen::Index p = 0; p < points.cols(); ++p)
    positions.col(p) = shape(points(0, p), points(1, p));
  return positions;
}

Eigen::Vector3d plane(double s, double t) {
  return {0.3 + 0.9 * s - 0.2 * t, -1.1 + 0.1 * s + 0.7 * t, 2.0 - 0.4 * s - 0.6 * t};
}

Eigen::Vector3d waves(double s, double t) {
  return {s + 0.01 * std::sin(20 * t), 0.03 * std::sin(16 * s + 0.3) * std::cos(13 * t), -t};
}

/// Returns the largest distance between `waves` and the surface through vertices on it. Points lie
/// in the given window of the cloth (fractions of its size, from every edge).
double largest_error_m(int vertices_per_side, double margin, SurfaceInterpolation interpolation) {
  Eigen::Matrix2Xd points = random_points(400, 11);
  const Eigen::Vector2d size(kWidth_m, kHeight_m);
  points = (1 - 2 * margin) * points;
  points.colwise() += Eigen::Vector2d(margin * size);
  const Surface surface = make_surface(vertices_per_side, vertices_per_side, kWidth_m, kHeight_m,
                                       points, interpolation);
  const Eigen::Matrix3Xd vertices =
      sample(vertex_points(vertices_per_side, vertices_per_side), waves);
  return (surface.evaluate(vertices) - sample(points, waves)).colwise().norm().maxCoeff();
}

/// Value and derivatives of the natural cubic spline through `f` at knots 0, 1, 2, ... They come
/// from a dense solve of the conditions on its pieces a + b u + c u^2 + d u^3: another route than
/// moments.
struct PieceSpline {
  Eigen::MatrixXd piece;  ///< 4 x (n - 1)
  explicit PieceSpline(const Eigen::VectorXd& f) {
    const Eigen::Index n = f.size();
    const Eigen::Index unknowns = 4 * (n - 1);
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(unknowns);
    Eigen::Index row = 0;
    for (Eigen::Index k = 0; k + 1 < n; ++k) {
      a(row, 4 * k) = 1;  // value at the piece's start
      b(row++) = f(k);
      a.row(row).segment<4>(4 * k).setOnes();  // and at its end
      b(row++) = f(k + 1);
      if (k + 2 == n) break;
      a.row(row).segment<4>(4 * k) << 0, 1, 2, 3;  // slopes agree
      a(row++, 4 * (k + 1) + 1) = -1;
      a.row(row).segment<4>(4 * k) << 0, 0, 2, 6;  // and second derivatives
      a(row++, 4 * (k + 1) + 2) = -2;
    }
    a(row++, 2) = 2;                                     // no curvature at the start
    a.row(row++).segment<4>(4 * (n - 2)) << 0, 0, 2, 6;  // nor at the end
    piece = a.fullPivLu().solve(b).reshaped(4, n - 1);
  }
  double operator()(double x) const {
    const auto k = std::min<Eigen::Index>(static_cast<Eigen::Index>(x), piece.cols() - 1);
    const double u = x - static_cast<double>(k);
    return piece(0, k) + u * (piece(1, k) + u * (piece(2, k) + u * piece(3, k)));
  }
};

TEST(Surface, ReproducesPlanesWhateverTheMesh) {
  const Eigen::Matrix2Xd points = random_points(50, 1);
  for (const auto interpolation : {SurfaceInterpolation::bicubic, SurfaceInterpolation::bilinear}) {
    for (const auto& [columns, rows] :
         {std::pair{2, 2}, {3, 2}, {2, 5}, {3, 3}, {17, 17}, {9, 40}}) {
      SCOPED_TRACE(testing::Message() << columns << " x " << rows);
      const Surface surface =
          make_surface(columns, rows, kWidth_m, kHeight_m, points, interpolation);

      const Eigen::Matrix3Xd at_points =
          surface.evaluate(sample(vertex_points(columns, rows), plane));

      // Weights below 1e-12 are left out; everything else is rounding.
      EXPECT_LT((at_points - sample(points, plane)).cwiseAbs().maxCoeff(), 1e-11);
    }
  }
}

TEST(Surface, PassesThroughItsVerticesWithASingleWeight) {
  const int columns = 17, rows = 9;
  const Eigen::Matrix2Xd points = vertex_points(columns, rows);
  const Surface surface = make_surface(columns, rows, kWidth_m, kHeight_m, points);
  const Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, columns * rows);

  const Eigen::Matrix3Xd at_points = surface.evaluate(vertices);

  // The rounding of (s / spacing) is about 1e-15; nothing else is between.
  EXPECT_LT((at_points - vertices).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(surface.row_weights.nonZeros(), columns * rows);
  EXPECT_EQ(surface.column_weights.nonZeros(), columns * rows);
}

TEST(Surface, TakesAPointAHairOutsideAsTheEdge) {
  Eigen::Matrix2Xd points(2, 2);
  points << -9e-7, kWidth_m + 9e-7, kHeight_m + 9e-7, -9e-7;
  const Surface surface = make_surface(5, 4, kWidth_m, kHeight_m, points);

  const Eigen::Matrix3Xd at_points = surface.evaluate(sample(vertex_points(5, 4), plane));

  EXPECT_LT((at_points.col(0) - plane(0, kHeight_m)).norm(), 1e-12);
  EXPECT_LT((at_points.col(1) - plane(kWidth_m, 0)).norm(), 1e-12);
}

TEST(Surface, AgreesWithASplineMadeOfPieces) {
  for (const int n : {2, 3, 4, 5, 17}) {
    SCOPED_TRACE(n);
    const int points = 60;
    Eigen::Matrix2Xd along_s(2, points);
    along_s.row(0).setLinSpaced(0, kWidth_m);
    along_s.row(1).setConstant(kHeight_m / 2);
    const Surface surface = make_surface(n, 2, kWidth_m, kHeight_m, along_s);

    // Column j of the weights is the spline through 1 at vertex j and 0 at the others.
    for (int j = 0; j < n; ++j) {
      const PieceSpline cardinal(Eigen::VectorXd::Unit(n, j));
      for (int p = 0; p < points; ++p) {
        const double x = along_s(0, p) / kWidth_m * (n - 1);
        EXPECT_NEAR(surface.column_weights.coeff(p, j), cardinal(x), 3e-12);
      }
    }
  }
}

TEST(Surface, HasNoCurvatureAcrossItsEdges) {
  const double h = 1e-4 * kWidth_m;
  Eigen::Matrix2Xd points(2, 6);  // three points from either edge inwards
  points.row(0) << 0, h, 2 * h, kWidth_m - 2 * h, kWidth_m - h, kWidth_m;
  points.row(1).setConstant(0.1);
  const Surface surface = make_surface(9, 9, kWidth_m, kHeight_m, points);
  Eigen::Matrix2Xd inside = points.leftCols(3);
  inside.row(0).array() += 0.55 * kWidth_m;

  const Eigen::Matrix3Xd vertices = sample(vertex_points(9, 9), waves);
  const Eigen::Matrix3Xd x = surface.evaluate(vertices);
  const Eigen::Matrix3Xd middle =
      make_surface(9, 9, kWidth_m, kHeight_m, inside).evaluate(vertices);

  const auto curvature = [&](const Eigen::Matrix3Xd& p, int k) {
    return ((p.col(k) - 2 * p.col(k + 1) + p.col(k + 2)) / (h * h)).norm();
  };
  // The second derivative grows linearly from 0 at the edge, so one step inside it is O(h).
  EXPECT_LT(curvature(x, 0), 1e-2 * curvature(middle, 0));
  EXPECT_LT(curvature(x, 3), 1e-2 * curvature(middle, 0));
}

TEST(Surface, ConvergesWithTheFourthPowerOfTheSpacingInside) {
  // The natural end condition is wrong for a surface that is curved at its edge. That error dies
  // out by 0.27 per vertex, so a third of the cloth away from the edges only the order matters.
  const double coarse = largest_error_m(25, 0.33, SurfaceInterpolation::bicubic);
  const double fine = largest_error_m(49, 0.33, SurfaceInterpolation::bicubic);
  const double bilinear_coarse = largest_error_m(25, 0.33, SurfaceInterpolation::bilinear);
  const double bilinear_fine = largest_error_m(49, 0.33, SurfaceInterpolation::bilinear);

  EXPECT_NEAR(std::log2(coarse / fine), 4, 0.3);
  EXPECT_NEAR(std::log2(bilinear_coarse / bilinear_fine), 2, 0.2);
  EXPECT_LT(coarse, 0.02 * bilinear_coarse);
}

TEST(Surface, ConvergesWithTheSquareOfTheSpacingAtCurvedEdges) {
  const double coarse = largest_error_m(25, 0, SurfaceInterpolation::bicubic);
  const double fine = largest_error_m(49, 0, SurfaceInterpolation::bicubic);

  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.4);
}

TEST(Surface, IsBilinearOnAMeshOfFourVertices) {
  const Eigen::Matrix2Xd points = random_points(50, 3);
  const Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, 4);

  const Eigen::Matrix3Xd bicubic =
      make_surface(2, 2, kWidth_m, kHeight_m, points).evaluate(vertices);
  const Eigen::Matrix3Xd bilinear =
      make_surface(2, 2, kWidth_m, kHeight_m, points, SurfaceInterpolation::bilinear)
          .evaluate(vertices);

  EXPECT_EQ(bicubic, bilinear);
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    const double a = points(0, p) / kWidth_m, b = points(1, p) / kHeight_m;
    const Eigen::Vector3d by_hand = (1 - b) * ((1 - a) * vertices.col(0) + a * vertices.col(1)) +
                                    b * ((1 - a) * vertices.col(2) + a * vertices.col(3));
    EXPECT_LT((bilinear.col(p) - by_hand).norm(), 1e-15);
  }
}

TEST(Surface, WeightsOfAPointSumToOne) {
  const Eigen::Matrix2Xd points = random_points(200, 4);
  for (const auto interpolation : {SurfaceInterpolation::bicubic, SurfaceInterpolation::bilinear}) {
    const Surface surface = make_surface(60, 17, kWidth_m, kHeight_m, points, interpolation);

    const Eigen::VectorXd sums = vertex_weights(surface) * Eigen::VectorXd::Ones(60 * 17);

    EXPECT_LT((sums.array() - 1).abs().maxCoeff(), 1e-11);  // each omitted one is 1e-12
  }
}

TEST(Surface, LeavesOutFarVerticesOfALargeMesh) {
  Eigen::Matrix2Xd point(2, 1);
  point << 0.4999 * kWidth_m, 0.5001 * kHeight_m;

  const Surface surface = make_surface(200, 200, kWidth_m, kHeight_m, point);

  // To both sides 0.268^k < 1e-12 from k = 21 on.
  EXPECT_LE(surface.column_weights.nonZeros(), 44);
  EXPECT_GE(surface.column_weights.nonZeros(), 36);
}

TEST(Surface, LanesAgreeWithSingleRunsToTheLastBit) {
  const int lanes = 8, columns = 9, rows = 7;
  const Eigen::Matrix2Xd points = random_points(30, 5);
  const Surface surface = make_surface(columns, rows, kWidth_m, kHeight_m, points);
  const Eigen::MatrixXd fields = Eigen::MatrixXd::Random(lanes, columns * rows);

  Eigen::MatrixXd together(lanes, points.cols());
  interpolate(surface, lanes, {fields.data(), static_cast<size_t>(fields.size())},
              {together.data(), static_cast<size_t>(together.size())});

  for (int lane = 0; lane < lanes; ++lane) {
    const Eigen::VectorXd alone_in = fields.row(lane);
    Eigen::VectorXd alone(points.cols());
    interpolate(surface, 1, {alone_in.data(), static_cast<size_t>(alone_in.size())},
                {alone.data(), static_cast<size_t>(alone.size())});
    EXPECT_EQ(alone, together.row(lane).transpose());
  }
}

TEST(Surface, WholeOperatorAgreesWithEvaluation) {
  const Eigen::Matrix2Xd points = random_points(40, 6);
  const Surface surface = make_surface(6, 11, kWidth_m, kHeight_m, points);
  const Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, 66);

  const Eigen::Matrix3Xd through_matrix =
      (vertex_weights(surface) * vertices.transpose()).transpose();

  EXPECT_LT((through_matrix - surface.evaluate(vertices)).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Surface, HasTheDerivativesOfItsPlacesAndOfItsSlopes) {
  // Given vertices anywhere, and points that leave room for a difference
  constexpr double kStep_m = 1e-5;
  const Eigen::Matrix2Xd points = (0.98 * random_points(60, 9)).array() + 0.001;
  const Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, 6 * 11);
  const auto at = [&](const Eigen::Matrix2Xd& where, SurfaceQuantity quantity) {
    return make_surface(6, 11, kWidth_m, kHeight_m, where, SurfaceInterpolation::bicubic, quantity)
        .evaluate(vertices);
  };

  using enum SurfaceQuantity;
  const auto expect_derivative = [&](SurfaceQuantity derivative, SurfaceQuantity of, int axis) {
    const Eigen::Vector2d step = kStep_m * Eigen::Vector2d::Unit(axis);
    const Eigen::Matrix3Xd differences =
        (at(points.colwise() + step, of) - at(points.colwise() - step, of)) / (2 * kStep_m);
    const Eigen::Matrix3Xd found = at(points, derivative);
    // The differences' own error is step^2 / 6 of a third derivative of about 10 / spacing^3.
    // Second derivatives have corners at the vertices, which a step across blurs.
    const double scale = found.cwiseAbs().maxCoeff();
    EXPECT_LT((found - differences).cwiseAbs().maxCoeff(), of == place ? 1e-4 : 1e-2 * scale);
    EXPECT_GT(scale, 10);
  };
  expect_derivative(by_s, place, 0);
  expect_derivative(by_t, place, 1);
  expect_derivative(by_ss, by_s, 0);
  expect_derivative(by_st, by_s, 1);
  expect_derivative(by_st, by_t, 0);
  expect_derivative(by_tt, by_t, 1);
}

TEST(Surface, HasTheSlopesOfAPlaneEverywhere) {
  const Eigen::Matrix2Xd points = random_points(50, 12);
  const Eigen::Matrix3Xd vertices = sample(vertex_points(7, 5), plane);
  for (const auto interpolation : {SurfaceInterpolation::bicubic, SurfaceInterpolation::bilinear}) {
    const auto slopes = [&](SurfaceQuantity quantity) {
      return make_surface(7, 5, kWidth_m, kHeight_m, points, interpolation, quantity)
          .evaluate(vertices);
    };
    const Eigen::Vector3d by_s(0.9, 0.1, -0.4), by_t(-0.2, 0.7, -0.6);
    EXPECT_LT((slopes(SurfaceQuantity::by_s).colwise() - by_s).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((slopes(SurfaceQuantity::by_t).colwise() - by_t).cwiseAbs().maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace clothfit
