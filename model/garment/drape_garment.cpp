#include "model/garment/drape_garment.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "data/input_error.h"
#include "model/garment/garment_energy.h"
#include "model/garment/pattern_outline.h"
#include "model/sheet/settle_otherwise.h"

namespace clothfit {
namespace {

/// A seam with gaps below this is closed: its sides become one without a jump.
constexpr double kClosed_m = 1e-3;
/// Threads begin to pull with this and pull harder by a factor until all gaps are closed. The last
/// pull is 2000 N per metre of seam, what a strong one bears.
constexpr double kFirstThread_n_per_m2 = 4, kThreadGrowth = 4,
                 kLastThread_n_per_m2 = 2000 / kClosed_m;
/// Rest of the open garment, and of meshes that only start the next.
constexpr double kCoarseTolerance = 1e-2;
/// No point passes through an arm in one step.
constexpr double kLongestStep_m = 0.02;
/// A garment of so many particles takes gigabytes and hours.
constexpr double kMostParticles = 100'000;
/// Inertia of the first steps: that of a cloth which comes to rest within 30 ms.
constexpr double kFirstShift_per_s2 = 1000;

/// Returns the mean difference between the lengths of a mesh's edges and those in the flat cloth.
double spring_error_m(const ClothMesh& cloth, const Eigen::Matrix3Xd& vertex_m) {
  const Eigen::Matrix3Xi triangles = cloth.triangles();
  double sum_m = 0;
  for (const auto& corner : triangles.colwise())
    for (int k = 0; k < 3; ++k) {
      const int a = corner[k], b = corner[(k + 1) % 3];
      sum_m += std::abs((vertex_m.col(a) - vertex_m.col(b)).norm() -
                        (cloth.material_m.col(a) - cloth.material_m.col(b)).norm());
    }
  return sum_m / static_cast<double>(triangles.size());
}

class GarmentDraping {
 public:
  GarmentDraping(const Pattern& pattern, const std::vector<MeasuredFabric>& fabrics,
                 const Obstacle* body, const GarmentOptions& options)
      : pattern_(pattern), fabrics_(fabrics), options_(options) {
    if (body) body_.emplace(*body, 2 * options.hold_off_m);
    for (double spacing_m = options.spacing_m;; spacing_m *= 2) {
      spacings_m_.insert(spacings_m_.begin(), spacing_m);
      if (2 * spacing_m > options.coarsest_m * (1 + 1e-9)) break;
    }
  }

  GarmentDrape run() {
    GarmentDrape result;
    mesh_coarsest(result);
    result.position_m = result.mesh.placed_m;
    keep_shape(result.position_m, result);
    check_start(result);
    const bool sewn = sew(result);
    for (size_t level = options_.single ? spacings_m_.size() - 1 : 0;
         sewn && level < spacings_m_.size() && !cancelled_; ++level) {
      if (level > 0) refine(spacings_m_[level], result);
      const bool is_last = level + 1 == spacings_m_.size();
      rest(is_last ? options_.tolerance : std::max(options_.tolerance, kCoarseTolerance), result);
    }
    keep_shape(result.position_m, result);
    return result;
  }

 private:
  /// Meshes the pattern at the coarsest spacing that its panels bear.
  void mesh_coarsest(GarmentDrape& result) {
    for (;; spacings_m_.erase(spacings_m_.begin())) {
      try {
        result.mesh = mesh_garment(pattern_, spacings_m_.front());
        return;
      } catch (const InputError&) {
        if (spacings_m_.size() == 1) throw;
      }
    }
  }

  void check_start(const GarmentDrape& result) const {
    if (!body_) return;
    GarmentEnergy energy = energy_of(result.mesh, GarmentEnergy::Seams::open);
    energy.set_body(*body_, options_.hold_off_m);
    const Inside inside = energy.inside_body(result.position_m);
    if (inside.places == 0) return;
    const Panel& panel =
        pattern_
            .panels[static_cast<size_t>(result.mesh.panel_of[static_cast<size_t>(inside.point)])];
    const Eigen::Vector3d place_m = result.position_m.col(inside.point);
    throw InputError("panels." + panel.name,
                     fmt::format("it begins inside the body, {:.0f} mm deep near ({:.3f}, {:.3f}, "
                                 "{:.3f}) m",
                                 1e3 * inside.deepest_m, place_m.x(), place_m.y(), place_m.z()),
                     "panels that wait beside the body", "move its placement outwards");
  }

  GarmentEnergy energy_of(const GarmentMesh& mesh, GarmentEnergy::Seams seams) const {
    return options_.springs ? GarmentEnergy(mesh, *options_.springs, seams)
                            : GarmentEnergy(mesh, fabrics_, seams);
  }

  void set_contact(GarmentEnergy& energy, double spacing_m) const {
    constexpr double kOfSpacing = 0.1;
    if (body_) energy.set_body(*body_, options_.hold_off_m);
    if (options_.self_distance_m > 0)
      energy.set_self_contact(std::max(options_.self_distance_m, kOfSpacing * spacing_m));
  }

  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  void keep_shape(const Eigen::Matrix3Xd& vertex_m, GarmentDrape& result) const {
    if (options_.keep_shapes) result.shapes.push_back({seconds(), vertex_m});
  }

  /// Keeps what a step has reached, and every so often its shape.
  void note_step(const SettleStep& step, const GarmentEnergy& energy, double weight_n,
                 std::vector<GarmentStep>* steps, GarmentDrape& result) const {
    const Eigen::Matrix3Xd vertex_m = energy.vertices_m(step.position_m);
    if (steps)
      steps->push_back({seconds(), step.energy_j, step.gradient_n / weight_n,
                        spring_error_m(result.mesh.cloth, vertex_m)});
    constexpr int kStepsBetweenShapes = 10;
    if (step.iteration > 0 && step.iteration % kStepsBetweenShapes == 0)
      keep_shape(vertex_m, result);
  }

  SettleRule rule_for(const GarmentEnergy& energy, double weight_n, double tolerance,
                      GarmentProgress progress) {
    SettleRule rule;
    rule.stop.gradient_n = tolerance * weight_n;
    rule.stop.most_iterations = options_.most_iterations;
    rule.stop.lowest_energy_j = -std::numeric_limits<double>::infinity();
    rule.load_n = weight_n;
    rule.longest_step_m = kLongestStep_m;
    rule.first_shift_per_s2 = kFirstShift_per_s2;
    progress.particles = energy.points();
    if (options_.go_on)
      rule.stop.go_on = [this, progress, weight_n](int iteration, double gradient_n) mutable {
        progress.iteration = iteration;
        progress.imbalance = gradient_n / weight_n;
        cancelled_ = !options_.go_on(progress);
        return !cancelled_;
      };
    return rule;
  }

  static void measure_gaps(GarmentDrape& result) {
    result.widest_gap_m = 0;
    for (size_t n = 0; n < result.mesh.seams.size(); ++n)
      for (const auto& [a, b] : result.mesh.seams[n]) {
        const double gap_m = (result.position_m.col(a) - result.position_m.col(b)).norm();
        if (gap_m <= result.widest_gap_m) continue;
        result.widest_gap_m = gap_m;
        result.widest_seam = static_cast<int>(n);
      }
  }

  static void measure_stretch(GarmentDrape& result) {
    constexpr double kTorn = 1.5;
    const Eigen::Matrix3Xi triangles = result.mesh.cloth.triangles();
    double stretched = 0;
    for (const auto& corner : triangles.colwise())
      for (int k = 0; k < 3; ++k) {
        const int a = corner[k], b = corner[(k + 1) % 3];
        const Eigen::Vector2d flat_m =
            result.mesh.cloth.material_m.col(a) - result.mesh.cloth.material_m.col(b);
        stretched +=
            (result.position_m.col(a) - result.position_m.col(b)).norm() > kTorn * flat_m.norm();
      }
    result.stretched_share = stretched / static_cast<double>(triangles.size());
  }

  /// Draws the seams together; says whether they met, and the cloth bears it.
  bool sew(GarmentDrape& result) {
    GarmentEnergy energy = energy_of(result.mesh, GarmentEnergy::Seams::open);
    set_contact(energy, result.mesh.cloth.spacing_m);
    const double weight_n = energy.weight_n();
    energy.set_gravity(Eigen::Vector3d::Zero());
    const std::vector<bool> held(static_cast<size_t>(energy.points()), false);
    measure_gaps(result);
    double thread_n_per_m2 = kFirstThread_n_per_m2;
    for (bool is_last = false; !(result.widest_gap_m <= kClosed_m);
         thread_n_per_m2 = std::min(kThreadGrowth * thread_n_per_m2, kLastThread_n_per_m2)) {
      if (is_last) {
        result.state = GarmentState::not_sewn;
        return false;
      }
      is_last = thread_n_per_m2 == kLastThread_n_per_m2;
      energy.set_thread(thread_n_per_m2);
      GarmentProgress progress;
      progress.sewing = true;
      progress.spacing_m = result.mesh.cloth.spacing_m;
      progress.widest_gap_m = result.widest_gap_m;
      SettleRule rule = rule_for(energy, weight_n, kCoarseTolerance, progress);
      rule.on_step = [&](const SettleStep& step) {
        note_step(step, energy, weight_n, nullptr, result);
      };
      settle(energy, held, rule, result.position_m);
      measure_gaps(result);
      if (cancelled_) {
        result.state = GarmentState::cancelled;
        return false;
      }
    }
    measure_stretch(result);
    if (result.stretched_share <= kMostStretched) return true;
    result.state = GarmentState::too_tight;
    return false;
  }

  /// Returns the shape on a finer mesh. Its triangles cut the corners of folds that lie close
  /// together, so folds are first moved apart as far as fewest of them cross.
  Eigen::Matrix3Xd uncrossed(const GarmentMesh& fine, const Correspondence& places,
                             const Eigen::Matrix3Xd& coarse_m) const {
    Eigen::Matrix3Xd best_m = places.transfer(coarse_m);
    if (options_.self_distance_m == 0 || apart_.cols() != coarse_m.cols()) return best_m;
    GarmentEnergy energy = energy_of(fine, GarmentEnergy::Seams::sewn);
    set_contact(energy, fine.cloth.spacing_m);
    const auto crossings = [&](const Eigen::Matrix3Xd& vertex_m) {
      return energy.crossings(energy.particles_m(vertex_m));
    };
    int fewest = crossings(best_m);
    for (const double by_m : {0.001, 0.002, 0.003, 0.005, 0.008}) {
      if (fewest == 0) break;
      const Eigen::Matrix3Xd moved_m = places.transfer(coarse_m + by_m * apart_);
      if (const int count = crossings(moved_m); count < fewest) {
        fewest = count;
        best_m = moved_m;
      }
    }
    return best_m;
  }

  void refine(double spacing_m, GarmentDrape& result) const {
    GarmentMesh fine = mesh_garment(pattern_, spacing_m);
    const Correspondence places = correspond(fine, result.mesh);
    result.position_m = uncrossed(fine, places, result.position_m);
    for (GarmentShape& shape : result.shapes) shape.position_m = places.transfer(shape.position_m);
    result.mesh = std::move(fine);
  }

  MinimiseResult come_to_rest(GarmentEnergy& energy, const std::vector<bool>& held,
                              const SettleRule& rule, Eigen::Matrix3Xd& particle_m) const {
    constexpr double kStep_s = 1.0 / 60, kCalm_s = 0.2;
    switch (options_.method) {
      case GarmentOptions::Method::newton:
        break;
      case GarmentOptions::Method::conjugate_gradients:
        return settle_by_conjugate_gradients(energy, held, rule, particle_m);
      case GarmentOptions::Method::time_steps:
        return settle_by_time_steps(energy, held, rule, kStep_s, kCalm_s, particle_m);
    }
    return settle(energy, held, rule, particle_m);
  }

  /// Lets the sewn garment come to rest on its present mesh.
  void rest(double tolerance, GarmentDrape& result) {
    GarmentEnergy energy = energy_of(result.mesh, GarmentEnergy::Seams::sewn);
    set_contact(energy, result.mesh.cloth.spacing_m);
    result.weight_n = energy.weight_n();
    const std::vector<bool> held(static_cast<size_t>(energy.points()), false);
    Eigen::Matrix3Xd particle_m = energy.particles_m(result.position_m);
    GarmentProgress progress;
    progress.spacing_m = result.mesh.cloth.spacing_m;
    GarmentLevel level{result.mesh.cloth.spacing_m,
                       energy.points(),
                       static_cast<int>(result.mesh.cloth.triangles().cols()),
                       {},
                       {}};
    SettleRule rule = rule_for(energy, result.weight_n, tolerance, progress);
    rule.on_step = [&](const SettleStep& step) {
      note_step(step, energy, result.weight_n, &level.steps, result);
    };
    const MinimiseResult work = level.work = come_to_rest(energy, held, rule, particle_m);
    result.position_m = energy.vertices_m(particle_m);
    apart_ = energy.vertices_m(energy.pushed_apart(particle_m));
    result.imbalance = work.gradient_n / result.weight_n;
    result.levels.push_back(std::move(level));
    const Inside inside = energy.inside_body(particle_m);
    result.inside = inside.places;
    result.deepest_m = inside.deepest_m;
    result.crossings = energy.crossings(particle_m);
    result.state = cancelled_                                 ? GarmentState::cancelled
                   : result.inside > 0                        ? GarmentState::inside_body
                   : work.reason == MinimiseReason::converged ? GarmentState::at_rest
                                                              : GarmentState::not_at_rest;
  }

  const Pattern& pattern_;
  const std::vector<MeasuredFabric>& fabrics_;
  std::optional<BodyField> body_;
  const GarmentOptions& options_;
  std::vector<double> spacings_m_;  ///< coarsest first
  bool cancelled_ = false;
  Eigen::Matrix3Xd apart_;  ///< GarmentEnergy::pushed_apart() of the last mesh's vertices
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

void check_size(const Pattern& pattern, double spacing_m) {
  double particles = 0;
  for (const Panel& panel : pattern.panels) {
    particles += panel_area_m2(panel) / (spacing_m * spacing_m);
    for (int edge = 0; edge < panel.edge_count(); ++edge)
      particles += std::ceil(edge_length_m(panel, edge) / spacing_m);
  }
  if (particles > kMostParticles)
    throw InputError("GarmentOptions::spacing_m",
                     fmt::format("{:g} mm makes some {:.0f} particles", 1e3 * spacing_m, particles),
                     fmt::format("{:.0f} at most", kMostParticles), "a wider spacing");
}

void check_body(const Obstacle& body, double hold_off_m) {
  if (body.open_edges() > 0)
    throw InputError("body",
                     fmt::format("{} of its edges do not lie between two triangles that face the "
                                 "same way",
                                 body.open_edges()),
                     "a closed surface", "close its holes in a program for meshes");
  if (!(body.volume_m3() > 0))
    throw InputError("body", fmt::format("its volume is {:.3g} m3", body.volume_m3()),
                     "triangles counterclockwise as seen from outside", "turn its faces round");
  // The field's cells are a thousandth of the body: it cannot resolve what is much smaller.
  const auto [low_m, high_m] = body.bounds_m();
  const double least_m = (high_m - low_m).maxCoeff() / 4096;
  if (hold_off_m < least_m)
    throw InputError("GarmentOptions::hold_off_m", fmt::format("it is {:g}", hold_off_m),
                     fmt::format("{:.2g} or more for this body, a 4096th of its size", least_m));
}

}  // namespace

void GarmentOptions::validate() const {
  const auto check = [](bool good, const char* name, double value, const char* expected) {
    if (!good)
      throw InputError(std::string("GarmentOptions::") + name, fmt::format("it is {:g}", value),
                       expected);
  };
  check(spacing_m >= 1e-3 && spacing_m <= 0.1, "spacing_m", spacing_m, "metres, 0.001 to 0.1");
  check(coarsest_m >= spacing_m && coarsest_m <= 0.2, "coarsest_m", coarsest_m,
        "metres, from the spacing to 0.2");
  check(hold_off_m >= 1e-4 && hold_off_m <= 0.02, "hold_off_m", hold_off_m,
        "metres, 0.0001 to 0.02");
  check(self_distance_m == 0 || (self_distance_m >= 1e-4 && self_distance_m <= 0.02),
        "self_distance_m", self_distance_m, "metres, 0.0001 to 0.02, or 0");
  check(tolerance >= 1e-8 && tolerance <= 0.1, "tolerance", tolerance, "1e-8 to 0.1");
  if (springs) springs->validate();
  check(most_iterations >= 1, "most_iterations", most_iterations, "1 or more");
}

GarmentDrape drape_garment(const Pattern& pattern, const std::vector<MeasuredFabric>& fabrics,
                           const Obstacle* body, const GarmentOptions& options) {
  options.validate();
  check_pattern(pattern);
  check_size(pattern, options.spacing_m);
  if (!options.springs && fabrics.size() != pattern.fabrics.size())
    throw InputError("fabrics", fmt::format("{} are given", fabrics.size()),
                     fmt::format("the {} of the pattern", pattern.fabrics.size()));
  if (body) check_body(*body, options.hold_off_m);
  return GarmentDraping(pattern, fabrics, body, options).run();
}

}  // namespace clothfit
