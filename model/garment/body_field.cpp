#include "model/garment/body_field.h"

#include <algorithm>
#include <cmath>

namespace clothfit {
namespace {

/// The spline differs from the distance by less than this.
constexpr double kMarginCells = 2;
/// The grid's border is so far from the body that nothing is near there.
constexpr int kBorderCells = 8;
/// Bounds the table of blocks: a few megabytes.
constexpr double kMostCells = 1024;

/// Values and derivatives of the three quadratic B-splines at `x` cells from the middle one.
struct Weights {
  std::array<double, 3> value, slope;
  static constexpr std::array<double, 3> second{1, -2, 1};

  explicit Weights(double x)
      : value{0.5 * (0.5 - x) * (0.5 - x), 0.75 - x * x, 0.5 * (0.5 + x) * (0.5 + x)},
        slope{x - 0.5, -2 * x, x + 0.5} {}
};

}  // namespace

BodyField::BodyField(const Obstacle& body, double cell_m) : body_(body) {
  const auto [low_m, high_m] = body.bounds_m();
  cell_m_ = std::max(cell_m, (high_m - low_m).maxCoeff() / kMostCells);
  low_m_ = low_m.array() - kBorderCells * cell_m_;
  const Eigen::Vector3d cells = (high_m - low_m).array() / cell_m_ + 2 * kBorderCells;
  blocks_ = (cells / kSide).array().ceil().cast<int>();
  block_.resize(static_cast<size_t>(blocks_.prod()));
}

int BodyField::block_at(const Eigen::Vector3i& node) const {
  const Eigen::Vector3i block = node / kSide;
  if ((node.array() < 2).any() || (node.array() >= kSide * blocks_.array() - 2).any()) return -1;
  return (block.z() * blocks_.y() + block.y()) * blocks_.x() + block.x();
}

void BodyField::fill(const Eigen::Vector3i& first_node, Block& block) const {
  constexpr int kWide = kSide + 2;
  std::array<double, kWide * kWide * kWide> sample_m;
  const auto at = [](int i, int j, int k, int side) {
    return static_cast<size_t>((k * side + j) * side + i);
  };
  double row_within_m = Obstacle::kAnywhere_m;
  for (int k = 0; k < kWide; ++k)
    for (int j = 0; j < kWide; ++j) {
      double within_m = row_within_m;
      for (int i = 0; i < kWide; ++i) {
        const Eigen::Vector3d place_m =
            low_m_ + cell_m_ * (first_node + Eigen::Vector3i(i - 1, j - 1, k - 1)).cast<double>();
        const double distance_m = body_.distance(place_m, within_m)->distance_m;
        sample_m[at(i, j, k, kWide)] = distance_m;
        within_m = std::abs(distance_m) + 1.01 * cell_m_;  // the next is no farther
        if (i == 0)
          row_within_m = std::abs(distance_m) + (j + 1 < kWide ? 1.01 : 2 * kWide) * cell_m_;
      }
    }
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const auto sample = [&](int di, int dj, int dk) {
          return sample_m[at(i + 1 + di, j + 1 + dj, k + 1 + dk, kWide)];
        };
        const double around = sample(-1, 0, 0) + sample(1, 0, 0) + sample(0, -1, 0) +
                              sample(0, 1, 0) + sample(0, 0, -1) + sample(0, 0, 1);
        block[at(i, j, k, kSide)] = sample(0, 0, 0) - (around - 6 * sample(0, 0, 0)) / 8;
      }
}

const BodyField::Block& BodyField::filled(const Eigen::Vector3i& node) const {
  const Eigen::Vector3i of = node / kSide;
  std::unique_ptr<Block>& block =
      block_[static_cast<size_t>((of.z() * blocks_.y() + of.y()) * blocks_.x() + of.x())];
  if (!block) {
    block = std::make_unique<Block>();
    fill(node / kSide * kSide, *block);
  }
  return *block;
}

BodyField::Distance BodyField::evaluate(const Eigen::Vector3d& place_m) const {
  const Eigen::Vector3d cells = (place_m - low_m_) / cell_m_;
  const Eigen::Vector3i middle = (cells.array() + 0.5).floor().cast<int>();
  const std::array<Weights, 3> w{Weights(cells.x() - middle.x()), Weights(cells.y() - middle.y()),
                                 Weights(cells.z() - middle.z())};
  double value = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      // Along the first axis first: sums of coefficients by value, slope and second derivative.
      double line = 0, line_slope = 0, line_second = 0;
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3i node = middle + Eigen::Vector3i(i - 1, j - 1, k - 1);
        const Eigen::Vector3i in = node - node / kSide * kSide;
        const double c =
            filled(node)[static_cast<size_t>((in.z() * kSide + in.y()) * kSide + in.x())];
        const auto n = static_cast<size_t>(i);
        line += w[0].value[n] * c;
        line_slope += w[0].slope[n] * c;
        line_second += Weights::second[n] * c;
      }
      const auto y = static_cast<size_t>(j), z = static_cast<size_t>(k);
      const double by_value = w[1].value[y] * w[2].value[z];
      const double by_y = w[1].slope[y] * w[2].value[z], by_z = w[1].value[y] * w[2].slope[z];
      value += by_value * line;
      slope += Eigen::Vector3d(by_value * line_slope, by_y * line, by_z * line);
      second(0, 0) += by_value * line_second;
      second(1, 0) += by_y * line_slope;
      second(2, 0) += by_z * line_slope;
      second(1, 1) += Weights::second[y] * w[2].value[z] * line;
      second(2, 1) += w[1].slope[y] * w[2].slope[z] * line;
      second(2, 2) += w[1].value[y] * Weights::second[z] * line;
    }
  second.triangularView<Eigen::StrictlyUpper>() = second.transpose();
  return {value, slope / cell_m_, second / (cell_m_ * cell_m_)};
}

std::optional<BodyField::Distance> BodyField::near(const Eigen::Vector3d& place_m, double within_m,
                                                   double& free_way_m) const {
  free_way_m = 0;
  const Eigen::Vector3i node =
      ((place_m - low_m_) / cell_m_).array().max(-1e6).min(1e6).floor().cast<int>();
  const int block = block_at(node);
  if (block < 0 || !block_[static_cast<size_t>(block)]) {
    const auto exact = body_.distance(place_m, Obstacle::kAnywhere_m);
    const double way_m =
        (exact ? exact->distance_m : Obstacle::kAnywhere_m) - within_m - kMarginCells * cell_m_;
    if (way_m > 0) {
      free_way_m = way_m;
      return std::nullopt;
    }
  }
  const Distance found = evaluate(place_m);
  if (found.distance_m >= within_m) return std::nullopt;
  return found;
}

}  // namespace clothfit
