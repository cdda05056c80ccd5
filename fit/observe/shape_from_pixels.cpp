#include "fit/observe/shape_from_pixels.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "fit/observe/node_weights.h"
#include "model/topology/mesh.h"

namespace clothfit {
namespace {

constexpr double kStretchSigma = 0.01;  ///< for warp and weft, as a share of the length
constexpr double kShearSigma = 0.1;
constexpr double kLeastSigmaPx = 1;

/// The observations of one frame, to be compared with a sheet whose shape is given by its nodes.
struct Frame {
  const std::vector<ObservationSet>& sets;
  std::vector<std::pair<size_t, size_t>> rows;  ///< set, row
  const Eigen::MatrixXd& at_markers;            ///< markers x nodes
  const Eigen::MatrixXd& at_vertices;           ///< vertices x nodes
  const SpringNet& springs;
  const std::array<double, kSpringTypes>& flat_m;

  int residual_count() const {
    size_t count = 2 * rows.size();
    for (size_t type = 0; type <= shear_up; ++type) count += springs[type].size();
    return static_cast<int>(count);
  }
};

/// All residuals of a frame as a function of the nodes' places, 3 x nodes.
class FrameCost final : public ceres::CostFunction {
 public:
  explicit FrameCost(const Frame& frame) : frame_(frame) {
    set_num_residuals(frame.residual_count());
    mutable_parameter_block_sizes()->push_back(static_cast<int>(3 * frame.at_markers.cols()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index nodes = frame_.at_markers.cols();
    const Eigen::Map<const Eigen::Matrix3Xd> at_nodes(parameters[0], 3, nodes);
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    RowMajor none;
    Eigen::Map<RowMajor> jacobian(derivatives ? jacobians[0] : none.data(),
                                  derivatives ? num_residuals() : 0, derivatives ? 3 * nodes : 0);
    Eigen::Index n = 0;
    for (const auto& [s, r] : frame_.rows) {
      const ObservationSet& set = frame_.sets[s];
      const Observation& row = set.rows[r];
      const Eigen::RowVectorXd weights = frame_.at_markers.row(row.marker);
      Eigen::Matrix3d by_position;
      const auto pixel = set.predict(at_nodes * weights.transpose(), &by_position);
      if (!pixel) return false;
      const double sigma = std::max(row.sigma, kLeastSigmaPx);
      for (Eigen::Index c = 0; c < 2; ++c, ++n) {
        residuals[n] = ((*pixel)[c] - row.observed[c]) / sigma;
        if (!derivatives) continue;
        for (Eigen::Index k = 0; k < nodes; ++k)
          jacobian.row(n).segment<3>(3 * k) = weights[k] / sigma * by_position.row(c);
      }
    }
    const Eigen::Matrix3Xd vertices = at_nodes * frame_.at_vertices.transpose();
    for (size_t type = 0; type <= shear_up; ++type) {
      const double share = type <= structural_s ? kStretchSigma : kShearSigma;
      const double unit_m = share * frame_.flat_m[type];
      for (const auto& [a, b] : frame_.springs[type]) {
        const Eigen::Vector3d along = vertices.col(b) - vertices.col(a);
        const double length_m = along.norm();
        if (!(length_m > 0)) return false;
        residuals[n] = (length_m - frame_.flat_m[type]) / unit_m;
        if (derivatives) {
          const Eigen::RowVector3d by_end = along.transpose() / (length_m * unit_m);
          for (Eigen::Index k = 0; k < nodes; ++k)
            jacobian.row(n).segment<3>(3 * k) =
                (frame_.at_vertices(b, k) - frame_.at_vertices(a, k)) * by_end;
        }
        ++n;
      }
    }
    return true;
  }

 private:
  const Frame& frame_;
};

}  // namespace

std::optional<ShapesFromPixels> shapes_from_pixels(const std::vector<ObservationSet>& sets,
                                                   const Eigen::Matrix2Xd& marker_m, double width_m,
                                                   double height_m, const Rigid3& world_from_sheet,
                                                   int nodes, int frames) {
  const Mesh lattice{2 * nodes - 1, 2 * nodes - 1, width_m, height_m};
  const Eigen::MatrixXd at_markers = node_weights(lattice, nodes, marker_m);
  const Eigen::MatrixXd at_vertices =
      node_weights(lattice, nodes, flat_positions(lattice).topRows<2>());
  const SpringNet springs = make_springs(lattice);
  const std::array<double, kSpringTypes> flat_m = flat_lengths(lattice);
  Eigen::Matrix3Xd at_nodes = flat_positions({nodes, nodes, width_m, height_m});
  for (Eigen::Index k = 0; k < at_nodes.cols(); ++k)
    at_nodes.col(k) = world_from_sheet * Eigen::Vector3d(at_nodes.col(k));

  ShapesFromPixels shapes{.nodes = nodes};
  double sum = 0;
  Eigen::Index count = 0;
  for (int f = 0; f < frames; ++f) {
    Frame frame{sets, {}, at_markers, at_vertices, springs, flat_m};
    std::vector<bool> seen(static_cast<size_t>(marker_m.cols()), false);
    for (size_t s = 0; s < sets.size(); ++s) {
      for (size_t r = 0; r < sets[s].rows.size(); ++r) {
        if (sets[s].rows[r].frame != f) continue;
        frame.rows.emplace_back(s, r);
        seen[static_cast<size_t>(sets[s].rows[r].marker)] = true;
      }
    }
    if (2 * std::ranges::count(seen, true) < marker_m.cols()) return std::nullopt;
    ceres::Problem problem;
    problem.AddResidualBlock(new FrameCost(frame), nullptr, at_nodes.data());
    ceres::Solver::Options options;
    // As in refine(): the dense solvers' sums depend on the processor's caches.
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-6;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return std::nullopt;
    std::vector<double> residuals;
    problem.Evaluate({}, nullptr, &residuals, nullptr, nullptr);
    for (size_t n = 0; n < 2 * frame.rows.size(); ++n) sum += residuals[n] * residuals[n];
    count += static_cast<Eigen::Index>(2 * frame.rows.size());
    shapes.node_m.push_back(at_nodes);
  }
  shapes.rms_residual = std::sqrt(sum / static_cast<double>(count));
  return shapes;
}

}  // namespace clothfit
