#include "model/laboratory/cusick.h"

#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

#include "data/parallel.h"
#include "model/laboratory/check_option.h"
#include "model/laboratory/shadow.h"
#include "model/sheet/settle.h"
#include "model/sheet/sheet_energy.h"
#include "model/topology/correspondence.h"

namespace clothfit {
namespace {

/// The weight grows by doubling from 1/128, which leaves the softest fabrics flat. Fewer stages
/// give more nodes; more give the same (docs/theory/drape.md).
constexpr int kStages = 8;
/// Balance that ends a stage but the last, as a share of its weight.
constexpr double kStageTolerance = 0.03;
constexpr int kMostIterations = 2000;
constexpr double kUnevenness_m = 1e-4;
/// Folds of a rim that a person would count stand out by this, as a share of the overhang.
constexpr double kProminence = 0.03;

/// The part of the specimen that hangs over the disc's rim, where it is clamped.
struct Overhang {
  ClothMesh mesh;
  std::vector<bool> held;

  Overhang(const CusickOptions& options, double spacing_m) {
    const double disc_radius_m = 0.5 * options.disc_diameter_m;
    mesh = mesh_cloth({.border_m = {circle_m(0.5 * options.specimen_diameter_m, spacing_m),
                                    circle_m(disc_radius_m, spacing_m)},
                       .line_m = {}},
                      spacing_m);
    for (const auto& vertex : mesh.material_m.colwise())
      held.push_back(vertex.norm() <= disc_radius_m * (1 + 1e-9));
  }
};

/// Returns the flat specimen with an unevenness of random waves around it beyond the disc.
Eigen::Matrix3Xd uneven_start(const Overhang& overhang, const CusickOptions& options, int start) {
  constexpr int kMostWaves = 16;
  std::seed_seq seed{options.seed, static_cast<unsigned>(start)};
  std::mt19937 random(seed);
  // The standard's distributions differ between libraries; these draws do not.
  const auto draw = [&] { return static_cast<double>(random()) / 0x1p31 - 1; };
  std::array<Eigen::Vector2d, kMostWaves + 1> wave;
  for (Eigen::Vector2d& w : wave) w = {draw(), draw()};
  const double disc_m = 0.5 * options.disc_diameter_m,
               overhang_m = 0.5 * options.specimen_diameter_m - disc_m;
  Eigen::Matrix3Xd position(3, overhang.mesh.vertex_count());
  for (int v = 0; v < overhang.mesh.vertex_count(); ++v) {
    const Eigen::Vector2d at = overhang.mesh.material_m.col(v);
    const double angle = std::atan2(at.y(), at.x());
    double height = 0;
    for (size_t n = 2; n < wave.size(); ++n)
      height += wave[n].x() * std::cos(static_cast<double>(n) * angle) +
                wave[n].y() * std::sin(static_cast<double>(n) * angle);
    const double out = overhang.held[static_cast<size_t>(v)] ? 0 : at.norm() - disc_m;
    position.col(v) << at, kUnevenness_m * height * out / overhang_m;
  }
  return position;
}

class Draping {
 public:
  Draping(const MeasuredFabric& fabric, const CusickOptions& options)
      : options_(options),
        coarse_(options, 2 * options.spacing_m),
        fine_(options, options.spacing_m),
        coarse_energy_(coarse_.mesh, fabric, coarse_.held),
        fine_energy_(fine_.mesh, fabric, fine_.held),
        fine_in_coarse_(
            correspond(fine_.mesh.material_m, coarse_.mesh.material_m, coarse_.mesh.triangles())) {}

  const Overhang& fine() const { return fine_; }

  Drape drape(int start) {
    Drape result;
    Eigen::Matrix3Xd coarse = uneven_start(coarse_, options_, start);
    SheetEnergy energy = coarse_energy_;
    for (int stage = 0; stage < kStages; ++stage) {
      energy.set_gravity({0, 0, -kGravity_m_per_s2 * std::exp2(stage + 1 - kStages)});
      if (!add(settle(energy, coarse_.held, rule(energy, kStageTolerance, 1), coarse), result))
        return result;
    }
    result.position_m = fine_in_coarse_.transfer(coarse);
    for (int v = 0; v < fine_.mesh.vertex_count(); ++v)
      if (fine_.held[static_cast<size_t>(v)])
        result.position_m.col(v) << fine_.mesh.material_m.col(v), 0;
    if (add(settle(fine_energy_, fine_.held, rule(fine_energy_, options_.tolerance, 100),
                   result.position_m),
            result))
      measure(result);
    return result;
  }

 private:
  double overhang_m() const {
    return 0.5 * (options_.specimen_diameter_m - options_.disc_diameter_m);
  }

  /// `haste` is the first shift in units of the overhang's pendulum.
  SettleRule rule(const SheetEnergy& energy, double tolerance, double haste) const {
    SettleRule rule;
    rule.stop.gradient_n = tolerance * energy.weight_n();
    rule.stop.most_iterations = kMostIterations;
    rule.stop.lowest_energy_j = -std::numeric_limits<double>::infinity();
    rule.load_n = energy.weight_n();
    rule.first_shift_per_s2 = haste * kGravity_m_per_s2 / overhang_m();
    if (options_.go_on)
      rule.stop.go_on = [this](int, double) {
        return options_.go_on(static_cast<double>(stages_done_) /
                              ((kStages + 1) * options_.starts));
      };
    return rule;
  }

  bool add(const MinimiseResult& work, Drape& result) {
    ++stages_done_;
    result.reason = work.reason;
    result.iterations += work.iterations;
    result.energy_j = work.energy_j;
    return work.reason == MinimiseReason::converged;
  }

  void measure(Drape& result) const {
    // Both circles are polygons, in the flat cloth as in its shadow. No shadow falls inside the
    // disc.
    const double flat_m2 = fine_.mesh.total_area_m2();
    result.coefficient = shadow_area_m2(result.position_m, fine_.mesh.triangles()) / flat_m2;
    const std::vector<int>& rim = fine_.mesh.border.front();
    Eigen::VectorXd radius_m(static_cast<Eigen::Index>(rim.size()));
    for (size_t k = 0; k < rim.size(); ++k)
      radius_m[static_cast<Eigen::Index>(k)] = result.position_m.col(rim[k]).head<2>().norm();
    result.nodes = count_nodes(radius_m, kProminence * overhang_m());
  }

  CusickOptions options_;
  Overhang coarse_, fine_;
  SheetEnergy coarse_energy_, fine_energy_;
  Correspondence fine_in_coarse_;
  std::atomic<int> stages_done_ = 0;
};

}  // namespace

void CusickOptions::validate() const {
  check_option(specimen_diameter_m >= 0.05 && specimen_diameter_m <= 2,
               "CusickOptions::specimen_diameter_m", specimen_diameter_m,
               "metres, 0.05 to 2; the standards have 0.24, 0.30 and 0.36");
  check_option(disc_diameter_m >= 0.02 && disc_diameter_m < specimen_diameter_m - 0.01,
               "CusickOptions::disc_diameter_m", disc_diameter_m,
               "metres, at least a centimetre less than the specimen's; 0.18");
  check_option(spacing_m >= 5e-4 && spacing_m <= (specimen_diameter_m - disc_diameter_m) / 8,
               "CusickOptions::spacing_m", spacing_m,
               "metres, from 0.0005 to an eighth of the difference of both diameters");
  check_option(starts >= 1 && starts <= 1000, "CusickOptions::starts", starts, "1 to 1000");
  check_option(tolerance >= 1e-9 && tolerance <= 1e-2, "CusickOptions::tolerance", tolerance,
               "1e-9 to 1e-2");
}

int count_nodes(const Eigen::VectorXd& rim_radius_m, double prominence_m) {
  // From the lowest place on, every fall by the prominence ends a node.
  Eigen::Index lowest = 0;
  double low = rim_radius_m.minCoeff(&lowest), high = low;
  bool rising = true;
  int nodes = 0;
  const Eigen::Index count = rim_radius_m.size();
  for (Eigen::Index k = 1; k <= count; ++k) {
    const double radius = rim_radius_m[(lowest + k) % count];
    low = std::min(low, radius);
    high = std::max(high, radius);
    if (rising && high - radius >= prominence_m) {
      ++nodes;
      rising = false;
      low = radius;
    } else if (!rising && radius - low >= prominence_m) {
      rising = true;
      high = radius;
    }
  }
  return nodes;
}

CusickResult drape_cusick(const MeasuredFabric& fabric, const CusickOptions& options) {
  options.validate();
  Draping draping(fabric, options);
  CusickResult result{.mesh = draping.fine().mesh,
                      .drapes = std::vector<Drape>(static_cast<size_t>(options.starts))};
  for_each_index(result.drapes.size(), [&](size_t start) {
    result.drapes[start] = draping.drape(static_cast<int>(start));
  });
  double sum = 0, nodes = 0;
  for (const Drape& drape : result.drapes)
    if (drape.usable()) {
      ++result.usable;
      sum += drape.coefficient;
      nodes += drape.nodes;
    }
  result.mean_coefficient = sum / result.usable;
  result.mean_nodes = nodes / result.usable;
  double squares = 0;
  for (const Drape& drape : result.drapes)
    if (drape.usable()) squares += std::pow(drape.coefficient - result.mean_coefficient, 2);
  result.spread_coefficient = std::sqrt(squares / (result.usable - 1));
  return result;
}

}  // namespace clothfit
