#include "model/garment/garment_energy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "model/garment/seam_bending.h"

namespace clothfit {
namespace {

BlockEnergy::Pair pair_of(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

/// Returns the weights of a triangle's corners at the middles of the parts^2 equal ones in it.
std::vector<std::vector<double>> middles_of_triangle(int parts) {
  std::vector<std::vector<double>> middles;
  const auto add = [&](double s, double t) {
    middles.push_back({1 - (s + t) / parts, s / parts, t / parts});
  };
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j) {
      add(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < parts) add(i + 2.0 / 3, j + 2.0 / 3);
    }
  return middles;
}

/// Returns the same for the parts^2 equal squares in a square.
std::vector<std::vector<double>> middles_of_square(int parts) {
  std::vector<std::vector<double>> middles;
  for (int i = 0; i < parts; ++i)
    for (int j = 0; j < parts; ++j) {
      const double s = (i + 0.5) / parts, t = (j + 0.5) / parts;
      middles.push_back({(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t});
    }
  return middles;
}

/// Makes one of the points that are single points of the mesh, of all their cells.
std::vector<ContactPoint> merged(const std::vector<ContactPoint>& points) {
  std::vector<ContactPoint> result;
  std::map<int, size_t> single;
  for (const ContactPoint& point : points) {
    if (point.count == 1) {
      const auto [at, is_new] = single.emplace(point.point[0], result.size());
      if (!is_new) {
        result[at->second].area_m2 += point.area_m2;
        continue;
      }
    }
    result.push_back(point);
  }
  return result;
}

}  // namespace

GarmentEnergy::GarmentEnergy(const GarmentMesh& mesh, Seams seams)
    : mesh_(mesh), particle_of_(mesh.particle_of) {
  if (seams == Seams::sewn) return;
  std::iota(particle_of_.begin(), particle_of_.end(), 0);
  add_threads();
}

GarmentEnergy::GarmentEnergy(const GarmentMesh& mesh, const std::vector<MeasuredFabric>& fabrics,
                             Seams seams)
    : GarmentEnergy(mesh, seams) {
  take_cloth(std::make_unique<SheetEnergy>(
                 mesh.cloth, fabrics, mesh.fabric_of, std::vector<bool>(),
                 seams == Seams::sewn ? seam_bending(mesh, fabrics) : BendingMatrix()),
             particle_of_);
}

GarmentEnergy::GarmentEnergy(const GarmentMesh& mesh, const PaperSprings& springs, Seams seams)
    : GarmentEnergy(mesh, seams) {
  auto net = std::make_unique<SpringCloth>(mesh, particle_of_, springs);
  std::vector<int> same(static_cast<size_t>(net->points()));
  std::iota(same.begin(), same.end(), 0);
  take_cloth(std::move(net), std::move(same));
}

void GarmentEnergy::take_cloth(std::unique_ptr<ClothEnergy> cloth,
                               std::vector<int> particle_of_point) {
  cloth_ = std::move(cloth);
  particle_of_point_ = std::move(particle_of_point);
  mass_kg_ = Eigen::VectorXd::Zero(1 + *std::ranges::max_element(particle_of_point_));
  for (size_t p = 0; p < particle_of_point_.size(); ++p)
    mass_kg_[particle_of_point_[p]] += cloth_->mass_kg()[static_cast<Eigen::Index>(p)];
  find_targets();
}

void GarmentEnergy::add_threads() {
  for (size_t n = 0; n < mesh_.seams.size(); ++n)
    for (size_t k = 0; k < mesh_.seams[n].size(); ++k) {
      const auto [a, b] = mesh_.seams[n][k];
      if (a == b) continue;  // the tip of a dart
      threads_.push_back({.a = a, .b = b, .length_m = mesh_.seam_length_m[n][k], .block = {}});
    }
}

void GarmentEnergy::find_targets() {
  const auto particle = [&](int point) { return particle_of_point_[static_cast<size_t>(point)]; };
  for (const Pair& pair : cloth_->pairs())
    pairs_.push_back(pair_of(particle(pair.low), particle(pair.high)));
  for (const Thread& thread : threads_) pairs_.push_back(pair_of(thread.a, thread.b));
  std::ranges::sort(pairs_);
  const auto repeated = std::ranges::unique(pairs_);
  pairs_.erase(repeated.begin(), repeated.end());
  pairs_of_mesh_ = pairs_.size();
  for (const Pair& pair : cloth_->pairs()) {
    const int low = particle(pair.low), high = particle(pair.high);
    // Two points of one particle depend on each other both ways.
    const bool folded = low == high && pair.low != pair.high;
    target_.push_back({block_of(low, high), low <= high, folded || low > high});
  }
  for (Thread& thread : threads_)
    thread.block = {block_of(thread.a, thread.a), block_of(thread.b, thread.b),
                    block_of(thread.a, thread.b)};
}

int GarmentEnergy::block_of(int a, int b) const {
  const Pair pair = pair_of(a, b);
  const auto end_of_mesh = pairs_.begin() + static_cast<std::ptrdiff_t>(pairs_of_mesh_);
  const auto of_mesh = std::lower_bound(pairs_.begin(), end_of_mesh, pair);
  const auto found = of_mesh != end_of_mesh && *of_mesh == pair
                         ? of_mesh
                         : std::lower_bound(end_of_mesh, pairs_.end(), pair);
  return static_cast<int>(found - pairs_.begin());
}

void GarmentEnergy::add_contact_point(const std::vector<int>& vertices,
                                      const std::vector<double>& weights, double area_m2,
                                      std::vector<ContactPoint>& points) const {
  ContactPoint point;
  point.area_m2 = area_m2;
  const auto known = [&] { return point.point.begin() + point.count; };
  for (size_t k = 0; k < vertices.size(); ++k) {
    const int particle = particle_of_[static_cast<size_t>(vertices[k])];
    const auto at = std::find(point.point.begin(), known(), particle);
    if (at == known()) point.point[static_cast<size_t>(point.count++)] = particle;
    point.weight[static_cast<size_t>(at - point.point.begin())] += weights[k];
  }
  size_t next = 0;
  for (size_t a = 0; a < static_cast<size_t>(point.count); ++a)
    for (size_t b = 0; b <= a; ++b) point.block[next++] = block_of(point.point[a], point.point[b]);
  points.push_back(point);
}

std::vector<ContactPoint> GarmentEnergy::contact_points() const {
  constexpr double kFarthest_m = 0.01;
  std::vector<ContactPoint> points;
  for (const ClothCell& cell : mesh_.cloth.cells) {
    const std::vector<int> vertices(cell.vertex.begin(), cell.vertex.begin() + cell.corners);
    double longest_m = 0;
    for (size_t k = 0; k < vertices.size(); ++k)
      longest_m =
          std::max(longest_m, (mesh_.cloth.material_m.col(vertices[k]) -
                               mesh_.cloth.material_m.col(vertices[(k + 1) % vertices.size()]))
                                  .norm());
    const int parts = std::max(1, static_cast<int>(std::ceil(longest_m / kFarthest_m - 1e-6)));
    // Corners and inner points share the cell's area as if the corners stood for one part of it.
    const double area_m2 = cell.area_m2 / (1 + parts * parts);
    for (const int v : vertices)
      add_contact_point({v}, {1}, area_m2 / static_cast<double>(vertices.size()), points);
    for (const std::vector<double>& weights :
         cell.corners == 3 ? middles_of_triangle(parts) : middles_of_square(parts))
      add_contact_point(vertices, weights, area_m2, points);
  }
  return merged(points);
}

Inside GarmentEnergy::inside_body(const Eigen::Matrix3Xd& position_m) const {
  return contact_ ? contact_->inside(position_m) : Inside();
}

void GarmentEnergy::set_body(const BodyField& body, double hold_off_m) {
  contact_.emplace(body, hold_off_m, contact_points());
}

void GarmentEnergy::set_self_contact(double beta_m) {
  // Parts beside a common corner are nearer than a wide mesh's beta where its edges are short.
  constexpr double kOfShortestEdge = 0.25;
  const Eigen::Matrix3Xi triangles = mesh_.cloth.triangles();
  Eigen::Matrix3Xi of_particles = triangles;
  Eigen::Matrix3Xd centre_m = Eigen::Matrix3Xd::Zero(3, triangles.cols());
  Eigen::VectorXd joined_beta_m = Eigen::VectorXd::Constant(mesh_.particles, beta_m);
  for (Eigen::Index t = 0; t < triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int v = triangles(k, t), next = triangles((k + 1) % 3, t);
      const Eigen::Vector2d side_m =
          mesh_.cloth.material_m.col(next) - mesh_.cloth.material_m.col(v);
      for (const int end : {v, next}) {
        double& beta = joined_beta_m[mesh_.particle_of[static_cast<size_t>(end)]];
        beta = std::min(beta, kOfShortestEdge * side_m.norm());
      }
      centre_m.col(t).head<2>() += mesh_.cloth.material_m.col(v) / 3;
      of_particles(k, t) = particle_of_[static_cast<size_t>(v)];
    }
  std::vector<int> joined(static_cast<size_t>(points()));
  Eigen::VectorXd area_m2 = Eigen::VectorXd::Zero(points()), beta(points());
  for (size_t v = 0; v < particle_of_.size(); ++v) {
    const int particle = particle_of_[v];
    joined[static_cast<size_t>(particle)] = mesh_.particle_of[v];
    area_m2[particle] += mesh_.cloth.area_m2[static_cast<Eigen::Index>(v)];
    beta[particle] = joined_beta_m[mesh_.particle_of[v]];
  }
  self_contact_.emplace(SurfaceParts(of_particles, centre_m, joined), area_m2, beta);
}

Eigen::Matrix3Xd GarmentEnergy::pushed_apart(const Eigen::Matrix3Xd& position_m) const {
  Eigen::Matrix3Xd gradient_n = Eigen::Matrix3Xd::Zero(3, position_m.cols());
  if (self_contact_) self_contact_->add_energy_and_gradient(position_m, gradient_n);
  for (auto push : gradient_n.colwise())
    if (push.norm() > 0) push *= -1 / push.norm();
  return gradient_n;
}

bool GarmentEnergy::update_pairs(const Eigen::Matrix3Xd& position_m) {
  if (!self_contact_) return false;
  std::vector<Pair> touching;
  self_contact_->add_pairs(position_m, touching);
  std::ranges::sort(touching);
  const auto of_mesh = pairs_.begin(),
             end_of_mesh = of_mesh + static_cast<std::ptrdiff_t>(pairs_of_mesh_);
  std::vector<Pair> added;
  for (const Pair& pair : touching)
    if ((added.empty() || added.back() != pair) && !std::binary_search(of_mesh, end_of_mesh, pair))
      added.push_back(pair);
  if (std::equal(end_of_mesh, pairs_.end(), added.begin(), added.end())) return false;
  pairs_.resize(pairs_of_mesh_);
  pairs_.insert(pairs_.end(), added.begin(), added.end());
  return true;
}

double GarmentEnergy::energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                          Eigen::Matrix3Xd& gradient_n) const {
  Eigen::Matrix3Xd of_points_n;
  double energy_j =
      cloth_->energy_and_gradient(position_m(Eigen::all, particle_of_point_), of_points_n);
  gradient_n.setZero(3, position_m.cols());
  for (size_t p = 0; p < particle_of_point_.size(); ++p)
    gradient_n.col(particle_of_point_[p]) += of_points_n.col(static_cast<Eigen::Index>(p));
  for (const Thread& thread : threads_) {
    const double stiffness = thread_n_per_m2_ * thread.length_m;
    const Eigen::Vector3d gap_m = position_m.col(thread.a) - position_m.col(thread.b);
    energy_j += 0.5 * stiffness * gap_m.squaredNorm();
    gradient_n.col(thread.a) += stiffness * gap_m;
    gradient_n.col(thread.b) -= stiffness * gap_m;
  }
  if (contact_) energy_j += contact_->add_energy_and_gradient(position_m, gradient_n);
  if (self_contact_) energy_j += self_contact_->add_energy_and_gradient(position_m, gradient_n);
  return energy_j;
}

void GarmentEnergy::second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                                      std::vector<Eigen::Matrix3d>& blocks) const {
  std::vector<Eigen::Matrix3d> of_cloth;
  cloth_->second_derivative(position_m(Eigen::all, particle_of_point_), curvature, of_cloth);
  blocks.assign(pairs_.size(), Eigen::Matrix3d::Zero());
  for (size_t p = 0; p < of_cloth.size(); ++p) {
    const Target& target = target_[p];
    Eigen::Matrix3d& block = blocks[static_cast<size_t>(target.block)];
    if (target.plain) block += of_cloth[p];
    if (target.turned) block += of_cloth[p].transpose();
  }
  for (const Thread& thread : threads_) {
    const double stiffness = thread_n_per_m2_ * thread.length_m;
    for (const int end : {0, 1})
      blocks[static_cast<size_t>(thread.block[static_cast<size_t>(end)])].diagonal().array() +=
          stiffness;
    blocks[static_cast<size_t>(thread.block[2])].diagonal().array() -= stiffness;
  }
  if (contact_) contact_->add_second_derivative(position_m, curvature, blocks);
  if (self_contact_)
    self_contact_->add_second_derivative(position_m,
                                         [&](int a, int b, const Eigen::Matrix3d& block) {
                                           blocks[static_cast<size_t>(block_of(a, b))] += block;
                                         });
}

Eigen::Matrix3Xd GarmentEnergy::vertices_m(const Eigen::Matrix3Xd& particle_m) const {
  return particle_m(Eigen::all, particle_of_);
}

Eigen::Matrix3Xd GarmentEnergy::particles_m(const Eigen::Matrix3Xd& vertex_m) const {
  Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, points());
  Eigen::VectorXd count = Eigen::VectorXd::Zero(points());
  for (size_t v = 0; v < particle_of_.size(); ++v) {
    sum.col(particle_of_[v]) += vertex_m.col(static_cast<Eigen::Index>(v));
    count[particle_of_[v]] += 1;
  }
  return sum * count.cwiseInverse().asDiagonal();
}

}  // namespace clothfit
