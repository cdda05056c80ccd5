#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fit/cost/bordered_chain.h"
#include "fit/cost/objective.h"
#include "model/integrate/simulate.h"

namespace clothfit {

/// The windows that the fitted frames are cut into, with a first guess of the state that each
/// begins with. The first window begins as the recording does, so that its guess is empty. Shapes:
/// 3 x vertices, world (m, m/s).
struct ShootingWindows {
  std::vector<int> first_frame;  ///< of each window, rising from 0
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s;
  int nodes =
      4;  ///< per side of the cloth, of the corrections of a state; 2 to the mesh's vertices
  int count() const { return static_cast<int>(first_frame.size()); }
};

/// How closely a window must begin where the one before it ends: standard deviations at a node.
struct Continuity {
  double position_m = 0;        ///< > 0
  double velocity_m_per_s = 0;  ///< > 0
};

/// The shooting cost: what free runs over short windows leave of the observations in the first
/// `frames` frames, each coordinate divided by its sigma, and the gaps between the end of a window
/// and the beginning of the next. Every window but the first begins with a state of its own,
///
///   P(v) = guess + sum_k B(v, k) p_k,   V(v) = guess + sum_k B(v, k) w_k,
///
/// B the smooth fields of fit/observe/node_weights.h, held points put where they belong. A gap is
/// what of (end - guess) lies in those fields less (p, w): finer differences are not seen, and it
/// is for the guess to have them. With as many nodes as vertices nothing is finer, and the cost
/// tends to the trajectory's as the continuity's sigma goes to 0; with one window it is that.
///
/// Short windows cannot lose the cloth however wrong the parameters are, so that the cost has wide
/// basins: what makes multiple shooting converge from afar [bock1983].
///
/// As an Objective its window states are those of `corrections`, and derivatives are by the
/// parameters alone; `equations` has both. Constant offsets of markers are not taken out. Windows
/// but the first begin with effects that remember nothing, and with supports that no effect shifts.
class ShootingObjective final : public Objective {
 public:
  /// Of each window but the first, 6 numbers for each node k and axis c: p at 3 k + c (m), then w
  /// at 3 nodes^2 + 3 k + c (m/s). The first window's are empty.
  using Corrections = std::vector<Eigen::VectorXd>;

  /// Throws InputError for windows that do not fit the frames or the mesh.
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

  /// Residuals for one parameter vector and other window states; empty as those above.
  Eigen::VectorXd residual(const Eigen::VectorXd& values, const Corrections& corrections) const;

  /// Half the sum of squares of the residuals, observations under Huber's loss beyond
  /// `huber_threshold` (infinite: none), without priors. Infinite for no residuals.
  double cost(const Eigen::VectorXd& residual, double huber_threshold) const;

  /// The cost to second order, as Gauss and Newton have it, by the space's coordinates (the border)
  /// and the windows' corrections (the chain; the first block is empty). `right` is the negative
  /// gradient. One linearisation for each window, side by side. Priors of the problem are in it.
  struct Equations {
    bool usable = false;
    int runs = 0;  ///< of the length of all windows together
    double cost = 0;
    Eigen::VectorXd residual;
    BorderedChain chain;
  };
  Equations equations(const Eigen::VectorXd& values, double huber_threshold) const;

  /// The same windows with the guesses of the corrected states, and what of these is finer than the
  /// nodes taken from the ends of the windows before; corrections that keep what the nodes see.
  /// None where the windows cannot be run.
  std::optional<ShootingWindows> recentred(const Eigen::VectorXd& values) const;

 private:
  struct Model;
  struct Window;
  Model model_at(const Eigen::VectorXd& values, bool derivatives) const;
  Schedule schedule_of(int window) const;
  /// The model with the state that the window begins with. \return Derivatives by the state's own
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
  /// What lies at each coordinate of a state, over the continuity's sigma.
  Eigen::VectorXd continuity_weights() const;
  int rows(int window) const {
    const auto w = static_cast<size_t>(window);
    return first_row_[w + 1] - first_row_[w];
  }
  bool is_last(int window) const { return window + 1 == windows_.count(); }
  /// Of a window, where its gap to the next begins in its residuals.
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
