#include "model/garment/spring_cloth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "data/input_error.h"

namespace clothfit {
namespace {

using Side = std::array<int, 2>;

Side side_between(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

/// A triangle beside a side: its third corner, laid flat with the side's lower end at the origin
/// and the other on the x axis.
struct Beside {
  int corner = 0;
  Eigen::Vector2d place_m;
  double area_m2 = 0;
};

Beside beside(const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
              const Eigen::Vector2d& corner_m, int corner) {
  const Eigen::Vector2d along = (high_m - low_m).normalized(), to = corner_m - low_m;
  const double height_m = std::abs(along.x() * to.y() - along.y() * to.x());
  return {corner, {along.dot(to), height_m}, 0.5 * height_m * (high_m - low_m).norm()};
}

}  // namespace

void PaperSprings::validate() const {
  const auto check = [](const char* name, double value, double most) {
    if (!(value > 0 && value <= most))
      throw InputError(std::string("PaperSprings::") + name, fmt::format("it is {:g}", value),
                       fmt::format("above 0, {:g} at most", most));
  };
  check("tension_n_per_m", tension_n_per_m, 1e6);
  check("shear_n_per_m", shear_n_per_m, 1e6);
  check("bending_n_per_m", bending_n_per_m, 1e6);
  check("areal_density_kg_per_m2", areal_density_kg_per_m2, 10);
}

SpringCloth::SpringCloth(const GarmentMesh& mesh, const std::vector<int>& particle_of,
                         const PaperSprings& springs) {
  const ClothMesh& cloth = mesh.cloth;
  const auto particle = [&](int v) { return particle_of[static_cast<size_t>(v)]; };
  const auto flat_m = [&](int v) -> Eigen::Vector2d { return cloth.material_m.col(v); };
  const int particles = 1 + *std::ranges::max_element(particle_of);
  mass_kg_ = Eigen::VectorXd::Zero(particles);
  for (int v = 0; v < cloth.vertex_count(); ++v)
    mass_kg_[particle(v)] += springs.areal_density_kg_per_m2 * cloth.area_m2[v];

  // Of each side: the sum of its lengths in the flat cloth (two in a seam), how many, and its area.
  struct SideOf {
    double length_m = 0, area_m2 = 0;
    int times = 0;
  };
  std::map<Side, SideOf> tension, shear;
  const auto add = [&](std::map<Side, SideOf>& to, int v, int w, double area_m2) {
    if (particle(v) == particle(w)) return;
    SideOf& side = to[side_between(particle(v), particle(w))];
    side.length_m += (flat_m(v) - flat_m(w)).norm();
    side.area_m2 += area_m2;
    ++side.times;
  };
  for (const ClothCell& cell : cloth.cells) {
    const auto corners = static_cast<size_t>(cell.corners);
    const double share = corners == 4 ? 0.5 : 2.0 / 3;
    for (size_t k = 0; k < corners; ++k)
      add(tension, cell.vertex[k], cell.vertex[(k + 1) % corners], share * cell.area_m2);
    if (corners < 4) continue;
    add(shear, cell.vertex[0], cell.vertex[2], cell.area_m2);
    add(shear, cell.vertex[1], cell.vertex[3], cell.area_m2);
  }
  for (const auto& [side, of] : tension)
    add_spring(Type::tension, side[0], side[1], of.length_m / of.times,
               springs.tension_n_per_m * of.area_m2);
  for (const auto& [side, of] : shear)
    add_spring(Type::shear, side[0], side[1], of.length_m / of.times,
               springs.shear_n_per_m * of.area_m2);

  add_bending(cloth, particle_of, springs.bending_n_per_m);
  find_pairs();
}

void SpringCloth::add_bending(const ClothMesh& cloth, const std::vector<int>& particle_of,
                              double bending_n_per_m) {
  const auto particle = [&](int v) { return particle_of[static_cast<size_t>(v)]; };
  const auto flat_m = [&](int v) -> Eigen::Vector2d { return cloth.material_m.col(v); };
  std::set<Side> joined;
  for (const Spring& spring : springs_) joined.insert(side_between(spring.a, spring.b));
  std::map<Side, std::vector<Beside>> triangles_at;
  const Eigen::Matrix3Xi triangles = cloth.triangles();
  for (const auto& corner : triangles.colwise())
    for (int k = 0; k < 3; ++k) {
      int low = corner[k], high = corner[(k + 1) % 3];
      const int third = corner[(k + 2) % 3];
      if (particle(low) == particle(high)) continue;
      if (particle(low) > particle(high)) std::swap(low, high);
      triangles_at[{particle(low), particle(high)}].push_back(
          beside(flat_m(low), flat_m(high), flat_m(third), particle(third)));
    }
  for (const auto& [side, around] : triangles_at) {
    if (around.size() != 2 || around[0].corner == around[1].corner) continue;
    const Side ends = side_between(around[0].corner, around[1].corner);
    if (joined.contains(ends)) continue;
    const Eigen::Vector2d turned(around[1].place_m.x(), -around[1].place_m.y());
    add_spring(Type::bending, ends[0], ends[1], (around[0].place_m - turned).norm(),
               bending_n_per_m * (around[0].area_m2 + around[1].area_m2));
  }
}

void SpringCloth::find_pairs() {
  std::map<Side, int> number;
  for (int p = 0; p < points(); ++p) number[{p, p}] = 0;
  for (const Spring& spring : springs_) number[side_between(spring.a, spring.b)] = 0;
  for (auto& [pair, of] : number) {
    of = static_cast<int>(pairs_.size());
    pairs_.push_back({pair[0], pair[1]});
  }
  for (const Spring& spring : springs_)
    blocks_of_.push_back({number.at({spring.a, spring.a}), number.at({spring.b, spring.b}),
                          number.at(side_between(spring.a, spring.b))});
}

void SpringCloth::add_spring(Type type, int a, int b, double length_m, double stiffness_j) {
  if (length_m > 0) springs_.push_back({type, a, b, length_m, stiffness_j});
}

double SpringCloth::spring_error_m(const Eigen::Matrix3Xd& position_m) const {
  double sum_m = 0;
  for (const Spring& spring : springs_)
    sum_m +=
        std::abs((position_m.col(spring.a) - position_m.col(spring.b)).norm() - spring.length_m);
  return sum_m / static_cast<double>(springs_.size());
}

double SpringCloth::energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                        Eigen::Matrix3Xd& gradient_n) const {
  gradient_n = -gravity_m_per_s2_ * mass_kg_.transpose();
  double energy_j = -gravity_m_per_s2_.dot(position_m * mass_kg_);
  for (const Spring& spring : springs_) {
    const Eigen::Vector3d connection_m = position_m.col(spring.a) - position_m.col(spring.b);
    const double length_m = connection_m.norm();
    if (length_m == 0) continue;  // without a direction it pulls at nothing
    const double strain = length_m / spring.length_m - 1;
    energy_j += 0.5 * spring.stiffness_j * strain * strain;
    const Eigen::Vector3d pull_n =
        spring.stiffness_j * strain / (spring.length_m * length_m) * connection_m;
    gradient_n.col(spring.a) += pull_n;
    gradient_n.col(spring.b) -= pull_n;
  }
  return energy_j;
}

void SpringCloth::second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                                    std::vector<Eigen::Matrix3d>& blocks) const {
  blocks.assign(pairs_.size(), Eigen::Matrix3d::Zero());
  for (size_t s = 0; s < springs_.size(); ++s) {
    const Spring& spring = springs_[s];
    const Eigen::Vector3d connection_m = position_m.col(spring.a) - position_m.col(spring.b);
    const double length_m = connection_m.norm();
    if (length_m == 0) continue;
    const double stiffness = spring.stiffness_j / (spring.length_m * spring.length_m);
    double across = stiffness * (1 - spring.length_m / length_m);
    if (curvature == Curvature::clamped) across = std::max(across, 0.0);
    const Eigen::Vector3d u = connection_m / length_m;
    const Eigen::Matrix3d block =
        across * Eigen::Matrix3d::Identity() + (stiffness - across) * u * u.transpose();
    blocks[static_cast<size_t>(blocks_of_[s][0])] += block;
    blocks[static_cast<size_t>(blocks_of_[s][1])] += block;
    blocks[static_cast<size_t>(blocks_of_[s][2])] -= block;
  }
}

}  // namespace clothfit
