#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fit/cost/bordered_chain.h"
#include "fit/cost/objective.h"
#include "model/integrate/simulate.h"

namespace clothfit {

/// The windows of the fitted frames, with a first guess of the state at the start of each. The
/// first window begins as the recording does, so its guess is empty. Shapes: 3 x vertices, world
/// (m, m/s).
struct ShootingWindows {
  std::vector<int> first_frame;  ///< one for each window, rising from 0
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s;
  int nodes = 4;  ///< a side of the cloth, for the corrections of a state; 2 to the mesh's vertices
  int count() const { return static_cast<int>(first_frame.size()); }
};

/// Standard deviations, at a node, of the gap between a window's end and the next one's beginning.
struct Continuity {
  double position_m = 0;        ///< > 0
  double velocity_m_per_s = 0;  ///< > 0
};

/// The shooting cost: residuals of free runs over short windows, and the gaps between windows. The
/// residuals are those of the first `frames` frames, each coordinate divided by its sigma. A gap
/// lies between the end of a window and the beginning of the next. Every window but the first
/// begins with a state of its own,
///
///   P(v) = guess + sum_k B(v, k) p_k,   V(v) = guess + sum_k B(v, k) w_k,
///
/// B the smooth fields of fit/observe/node_weights.h, held points put where they belong. A gap is
/// the part of (end - guess) in those fields less (p, w). Finer differences are not seen; the guess
/// has to contain them. With as many nodes as vertices nothing is finer, and the cost tends to the
/// trajectory's as the continuity's sigma goes to 0. With one window it is the trajectory's.
///
/// Short windows cannot lose the cloth however wrong the parameters are. The cost therefore has
/// wide basins, and multiple shooting converges from afar [bock1983].
///
/// As an Objective it takes the window states of `corrections`, and derivatives are by the
/// parameters alone; `equations` has both. Constant offsets of markers are not removed. Windows but
/// the first begin with effects that remember nothing, and with supports that no effect shifts.
class ShootingObjective final : public Objective {
 public:
  /// For each window but the first, 6 numbers for each node k and axis c: p at 3 k + c (m), then w
  /// at 3 nodes^2 + 3 k + c (m/s). The first window's are empty.
  using Corrections = std::vector<Eigen::VectorXd>;

  /// The windows must fit the frames and the mesh.
  ShootingObjective(const FitProblem& problem, int frames, const TimeSteps& steps,
                    ShootingWindows windows, const Continuity& continuity);

  const ShootingWindows& windows() const { return windows_; }
  int state_size() const { return static_cast<int>(6 * basis_.cols()); }
  Corrections no_corrections() const;
  void set_corrections(Corrections corrections);
  const Corrections& corrections() const { return corrections_; }

  std::string name() const override;
  double spring_steps_per_run() const override;
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const override;
  using Objective::linearise;
  Linearisation linearise(const Eigen::VectorXd& values) const override;

  /// Returns residuals for one parameter vector and other window states; empty as those above.
  Eigen::VectorXd residual(const Eigen::VectorXd& values, const Corrections& corrections) const;

  /// Returns half the sum of squares of the residuals, without priors. Observations beyond
  /// `huber_threshold` (infinite: none) are under Huber's loss. The cost is infinite for no
  /// residuals.
  double cost(const Eigen::VectorXd& residual, double huber_threshold) const;

  /// The cost to second order (Gauss and Newton). Its unknowns are the space's coordinates (the
  /// border) and the windows' corrections (the chain, whose first block is empty). `right` is the
  /// negative gradient. There is one linearisation for each window, side by side. Priors of the
  /// problem are in it.
  struct Equations {
    bool usable = false;
    int runs = 0;  ///< each as long as all windows together
    double cost = 0;
    Eigen::VectorXd residual;
    BorderedChain chain;
  };
  Equations equations(const Eigen::VectorXd& values, double huber_threshold) const;

  /// Returns the same windows with the corrected states as guesses. Detail finer than the nodes is
  /// taken from the ends of the windows before; corrections keep the part that the nodes see.
  /// Returns nothing where the windows cannot be run.
  std::optional<ShootingWindows> recentred(const Eigen::VectorXd& values) const;

 private:
  struct Model;
  struct Window;
  Model model_at(const Eigen::VectorXd& values, bool derivatives) const;
  Schedule schedule_of(int window) const;
  /// Adds the state at the start of the window to the model. \return Derivatives by the state's own
  /// coordinates where the model has those by the parameters.
  std::vector<Direction> begin(int window, const Eigen::VectorXd& correction, Model& model) const;
  std::optional<Window> run(int window, Model model, const Corrections& corrections) const;
  std::optional<Window> run_with_tangents(int window, Model model, bool by_states) const;
  std::vector<std::optional<Window>> run_all(const Eigen::VectorXd& values,
                                             const Corrections& corrections) const;
  std::vector<std::optional<Window>> linearise_all(const Eigen::VectorXd& values,
                                                   bool by_states) const;
  Eigen::VectorXd seen_by_nodes(const Eigen::Matrix3Xd& position_m,
                                const Eigen::Matrix3Xd& velocity_m_per_s) const;
  /// Returns the weight of each coordinate of a state: one over the continuity's sigma.
  Eigen::VectorXd continuity_weights() const;
  int rows(int window) const {
    const auto w = static_cast<size_t>(window);
    return first_row_[w + 1] - first_row_[w];
  }
  bool is_last(int window) const { return window + 1 == windows_.count(); }
  /// Returns where a window's gap to the next begins in its residuals.
  int gap_row(int window) const { return rows(window) - (is_last(window) ? 0 : state_size()); }

  int frames_;
  ShootingWindows windows_;
  Continuity continuity_;
  Corrections corrections_;
  Eigen::MatrixXd basis_;         ///< vertices x nodes^2
  Eigen::MatrixXd to_nodes_;      ///< nodes^2 x vertices: least squares
  Eigen::MatrixXd held_weights_;  ///< held points x vertices
  Eigen::MatrixXd held_move_;     ///< vertices x held points: smallest move that brings them there
  /// Residuals of window w are [first_row_[w], first_row_[w + 1]), blocks likewise.
  std::vector<int> first_row_, first_block_;
};

}  // namespace clothfit
