#include "model/garment/self_contact.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "model/garment/contact_pressure.h"

namespace clothfit {
namespace {

/// Of two edges that turn towards each other: how much they press, 1 from an angle of 6 degrees on
/// and 0 where they are parallel, and the derivative of that by the four places.
struct Turned {
  double share = 1;
  FourPlaces derivative_per_m = FourPlaces::Zero();
};

Turned turned(const FourPlaces& x) {
  constexpr double kFull = 0.01;  // of the sine's square
  const Eigen::Vector3d a = x.col(1) - x.col(0), b = x.col(3) - x.col(2);
  const double aa = a.squaredNorm(), bb = b.squaredNorm(), ab = a.dot(b);
  const double square = 1 - ab * ab / (aa * bb);
  if (square >= kFull) return {};
  const double part = std::max(square, 0.0) / kFull;
  Turned result{.share = part * (2 - part)};
  const double slope = 2 * (1 - part) / kFull;
  const Eigen::Vector3d by_a = -2 * slope * ab / (aa * bb) * (b - ab / aa * a),
                        by_b = -2 * slope * ab / (aa * bb) * (a - ab / bb * b);
  result.derivative_per_m << -by_a, by_a, -by_b, by_b;
  return result;
}

FourPlaces places_of(const PartPair& pair, const Eigen::Matrix3Xd& position_m) {
  FourPlaces places;
  for (size_t k = 0; k < 4; ++k)
    places.col(static_cast<Eigen::Index>(k)) = position_m.col(pair.point[k]);
  return places;
}

}  // namespace

SelfContact::SelfContact(SurfaceParts parts, Eigen::VectorXd area_m2, Eigen::VectorXd beta_m)
    : parts_(std::move(parts)), area_m2_(std::move(area_m2)), beta_m_(std::move(beta_m)) {}

double SelfContact::open_way(const Eigen::Matrix3Xd& from_m, const Eigen::Matrix3Xd& move_m) {
  constexpr double kKept = 0.2;
  double share = 1;
  near_ = parts_.near(from_m, move_m, beta_m_.maxCoeff());
  std::erase_if(near_, [&](const PartPair& pair) {
    const FreeWay way =
        free_way(pair.kind, places_of(pair, from_m), share * places_of(pair, move_m), kKept);
    share *= way.share;
    return way.least_distance_m > beta_of(pair);
  });
  return share;
}

double SelfContact::area_of(const PartPair& pair) const {
  const auto of = [&](size_t first, size_t last) {
    double sum_m2 = 0;
    for (size_t k = first; k < last; ++k) sum_m2 += area_m2_[pair.point[k]];
    return sum_m2 / static_cast<double>(last - first);
  };
  const size_t second = pair.kind == PartPair::point_triangle ? 1 : 2;
  return 0.25 * (of(0, second) + of(second, 4));
}

double SelfContact::beta_of(const PartPair& pair) const {
  double least_m = beta_m_[pair.point[0]];
  for (const int point : pair.point) least_m = std::min(least_m, beta_m_[point]);
  return least_m;
}

SelfContact::Contact SelfContact::contact_of(const PartPair& pair,
                                             const Eigen::Matrix3Xd& position_m) const {
  const FourPlaces places_m = places_of(pair, position_m);
  const Connection connection = shortest_connection(pair.kind, places_m);
  constexpr double kTouching_m = 1e-12;  // no direction
  const double beta_m = beta_of(pair);
  if (connection.distance_m >= beta_m || connection.distance_m < kTouching_m) return {};
  const double area_m2 = area_of(pair);
  const ContactPressure press = contact_pressure(connection.distance_m, beta_m);
  const Turned turn = pair.kind == PartPair::edge_edge ? turned(places_m) : Turned{};
  return {.energy_j = area_m2 * turn.share * press.energy_j_per_m2,
          .force_n = area_m2 * turn.share * press.pressure_pa,
          .stiffness_n_per_m = area_m2 * turn.share * press.stiffness_n_per_m3,
          .weight = connection.weight,
          .direction = connection.connection_m / connection.distance_m,
          .by_turning_n = area_m2 * press.energy_j_per_m2 * turn.derivative_per_m};
}

double SelfContact::add_energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                            Eigen::Matrix3Xd& gradient_n) const {
  double energy_j = 0;
  for (const PartPair& pair : near_) {
    const Contact contact = contact_of(pair, position_m);
    if (contact.energy_j == 0) continue;
    energy_j += contact.energy_j;
    for (size_t k = 0; k < 4; ++k) {
      const auto n = static_cast<Eigen::Index>(k);
      gradient_n.col(pair.point[k]) +=
          contact.by_turning_n.col(n) - contact.force_n * contact.weight[n] * contact.direction;
    }
  }
  return energy_j;
}

void SelfContact::add_pairs(const Eigen::Matrix3Xd& position_m,
                            std::vector<BlockEnergy::Pair>& pairs) const {
  for (const PartPair& pair : near_) {
    const Contact contact = contact_of(pair, position_m);
    if (contact.stiffness_n_per_m == 0) continue;
    for (size_t a = 0; a < 4; ++a)
      for (size_t b = 0; b < a; ++b) {
        const auto [low, high] = std::minmax(pair.point[a], pair.point[b]);
        pairs.push_back({low, high});
      }
  }
}

}  // namespace clothfit
