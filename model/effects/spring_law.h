#pragma once

#include <ceres/jet.h>

#include <array>

#include "model/cloth/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"
#include "model/effects/remembered.h"

namespace clothfit {

/// A spring as a law sees it.
template <class Real>
struct SpringSight {
  Real length_m, stretching_m_per_s;  ///< l and dl/dt
  Real natural_length_m, stiffness_n_per_m, damping_ns_per_m;
  SpringType type = structural_t;
  Real of_place;  ///< Law::of_place at its middle, where the law has that
  double time_step_s = 0;
};

/// Returns the middle of a spring in shares of the cloth's width and height.
inline std::array<double, 2> middle_of(const Mesh& mesh, const Spring& spring) {
  const auto middle = [](int a, int b, int count) { return 0.5 * (a + b) / (count - 1); };
  return {middle(spring.a % mesh.columns, spring.b % mesh.columns, mesh.columns),
          middle(spring.a / mesh.columns, spring.b / mesh.columns, mesh.rows)};
}

/// Calls `visit(number, spring, rate, direction, sight)` for every spring, type by type. `rate` is
/// the velocity of its end b relative to a (m/s), `direction` goes from a to b, zero where it has
/// no length (there it pulls at nothing).
template <class L, class Visit>
void for_springs(const EffectScene<L>& scene, const Visit& visit) {
  using Real = RealOf<L>;
  const Cloth& cloth = scene.cloth;
  SpringSight<Real> sight;
  sight.time_step_s = scene.time_step_s;
  int number = 0;
  for (int type = 0; type < kSpringTypes; ++type) {
    const auto t = static_cast<size_t>(type);
    sight.type = static_cast<SpringType>(type);
    sight.natural_length_m = real_of<L>(scene.springs.natural_length_m[t]);
    sight.stiffness_n_per_m = real_of<L>(scene.springs.stiffness_n_per_m[t]);
    sight.damping_ns_per_m = real_of<L>(scene.springs.damping_ns_per_m[t]);
    for (const Spring& spring : cloth.springs[t]) {
      const Vector3<Real> along =
          vector_at<L>(scene.position_m, spring.b) - vector_at<L>(scene.position_m, spring.a);
      const Vector3<Real> rate = vector_at<L>(scene.velocity_m_per_s, spring.b) -
                                 vector_at<L>(scene.velocity_m_per_s, spring.a);
      const Vector3<Real> u = direction(along);
      sight.length_m = dot(u, along);  // 0 where there is no direction, its derivatives too
      sight.stretching_m_per_s = dot(u, rate);
      visit(number++, spring, rate, u, sight);
    }
  }
}

/// Makes an effect inside the springs: tension (> 0 pulls) beyond k (l - l0) + c dl/dt. A Law has
///   static constexpr int kParameters, kMemory;   // kMemory numbers are remembered per spring
///   template <class Real> static Real tension(const SpringSight<Real>&,
///       const std::array<Real, kParameters>&, std::array<Real, kMemory>& memory);  // N
///   // may have, of a spring whose middle is at (s, t), shares of the cloth's width and height:
///   template <class Real> static Real of_place(double s, double t,
///                                              const std::array<Real, kParameters>&);
///   // and says with it that its parameters act through that alone, which saves most of the work:
///   static constexpr bool kThroughPlace = true;
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
/// Lanes, tangents and the adjoint follow from these.
template <class Law>
class SpringLawEffect final : public LawEffect<SpringLawEffect<Law>, Law> {
 public:
  int memory_size(const Cloth& cloth) const override {
    return Law::kMemory * static_cast<int>(cloth.spring_count());
  }

  // Left to itself GCC calls a function for each vector, and lanes pass through memory.
  template <class L>
  [[gnu::flatten]] static void add(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                                   EffectMemory<L>& memory, LaneVectors<L>& force_n) {
    using Real = RealOf<L>;
    const auto p = reals_of<L, Law::kParameters>(parameters);
    const std::vector<Real>* places = nullptr;
    if constexpr (kHasPlaces) {
      constexpr size_t kKept = L::kCount == 1 ? 64 : 1;  // shapes that are scored together
      thread_local Remembered<Real, Law::kParameters * L::kCount, kKept> remembered;
      places = &remembered.at(scene.cloth.mesh, numbers_in<L>(parameters),
                              [&] { return places_of(scene.cloth, p); });
    }
    for_springs<L>(scene, [&](int number, const Spring& spring, const Vector3<Real>&,
                              const Vector3<Real>& u, SpringSight<Real>& sight) {
      if constexpr (kHasPlaces) sight.of_place = (*places)[static_cast<size_t>(number)];
      std::array<Real, Law::kMemory> remembered;
      for (int m = 0; m < Law::kMemory; ++m)
        remembered[static_cast<size_t>(m)] =
            real_of<L>(LaneValue<L>(memory.col(number * Law::kMemory + m)));
      const Vector3<Real> pull = Law::tension(sight, p, remembered) * u;
      for (int m = 0; m < Law::kMemory; ++m)
        set_real<L>(memory, number * Law::kMemory + m, remembered[static_cast<size_t>(m)]);
      add_at<L>(force_n, spring.a, pull);
      set_at<L>(force_n, spring.b, vector_at<L>(force_n, spring.b) - pull);
    });
  }

  void linearise_force(const EffectScene<SingleLane>& scene,
                       const EffectValues<SingleLane>& parameters,
                       const EffectMemory<SingleLane>& memory,
                       EffectLinearisation& derivatives) const override {
    // A tension depends on five numbers of the spring, the parameters and the memory.
    // Where these act through its place alone, that one number stands for them.
    constexpr int kOwn = 5, kInner = kThroughPlace ? 1 : Law::kParameters, kMemory = kOwn + kInner,
                  kCount = kMemory + Law::kMemory;
    using Dual = ceres::Jet<double, kCount>;
    using OfPlace = ceres::Jet<double, Law::kParameters>;
    std::array<Dual, Law::kParameters> p;
    for (int n = 0; n < Law::kParameters; ++n) {
      const double value = parameters[static_cast<size_t>(n)][0];
      p[static_cast<size_t>(n)] = kThroughPlace ? Dual(value) : Dual(value, kOwn + n % kInner);
    }
    const std::vector<OfPlace>* places = nullptr;
    if constexpr (kHasPlaces) {
      thread_local Remembered<OfPlace, Law::kParameters, 1> remembered;
      places =
          &remembered.at(scene.cloth.mesh, reals_of<SingleLane, Law::kParameters>(parameters), [&] {
            std::array<OfPlace, Law::kParameters> of;
            for (int n = 0; n < Law::kParameters; ++n)
              of[static_cast<size_t>(n)] = OfPlace(parameters[static_cast<size_t>(n)][0], n);
            return places_of(scene.cloth, of);
          });
    }
    for_springs<SingleLane>(
        scene, [&](int number, const Spring& spring, const Vector3<double>& rate_m_per_s,
                   const Vector3<double>& direction, const SpringSight<double>& sight) {
          SpringSight<Dual> at;
          at.length_m = Dual(sight.length_m, 0);
          at.stretching_m_per_s = Dual(sight.stretching_m_per_s, 1);
          at.natural_length_m = Dual(sight.natural_length_m, 2);
          at.stiffness_n_per_m = Dual(sight.stiffness_n_per_m, 3);
          at.damping_ns_per_m = Dual(sight.damping_ns_per_m, 4);
          at.type = sight.type;
          if constexpr (kHasPlaces) {
            const OfPlace& place = (*places)[static_cast<size_t>(number)];
            at.of_place = Dual(place.a);
            if constexpr (kThroughPlace)
              at.of_place.v[kOwn] = 1;
            else
              at.of_place.v.template segment<Law::kParameters>(kOwn) = place.v;
          }
          at.time_step_s = sight.time_step_s;
          std::array<Dual, Law::kMemory> remembered;
          const int first = number * Law::kMemory;
          for (int m = 0; m < Law::kMemory; ++m)
            remembered[static_cast<size_t>(m)] = Dual(memory(0, first + m), kMemory + m);
          const Dual tension = Law::tension(at, p, remembered);

          // dl = u . dL,  d(dl/dt) = u . dV + (V - u (u . V)) . dL / l,  du = (dL - u u . dL) / l
          const Eigen::Vector3d u(direction.x, direction.y, direction.z);
          const Eigen::Vector3d rate(rate_m_per_s.x, rate_m_per_s.y, rate_m_per_s.z);
          const double inverse_length = sight.length_m > 0 ? 1 / sight.length_m : 0;
          const Eigen::Vector3d turning = (rate - u * u.dot(rate)) * inverse_length;
          const auto by_position = [&](const Dual& of) -> Eigen::Vector3d {
            return of.v[0] * u + of.v[1] * turning;
          };
          const double ratio = tension.a * inverse_length;
          const int a = spring.a, b = spring.b;
          const auto here = static_cast<int>(derivatives.by_spring.size());
          derivatives.by_spring.push_back({.a = a,
                                           .b = b,
                                           .direction = u,
                                           .w_n_per_m = by_position(tension) - ratio * u,
                                           .tension_ratio_n_per_m = ratio,
                                           .damping_ns_per_m = tension.v[1]});

          const int type = sight.type;
          const auto parameter_number = [&](int n) {
            return n == 0   ? ParameterNumber::natural_length(type)
                   : n == 1 ? ParameterNumber::stiffness(type)
                   : n == 2 ? ParameterNumber::damping(type)
                            : ParameterNumber::own(n - 3);
          };
          const auto by_parameter = [&](const Dual& of, int n) {
            if constexpr (kThroughPlace)
              return n < 3 ? of.v[2 + n]
                           : of.v[kOwn] * (*places)[static_cast<size_t>(number)].v[n - 3];
            else
              return of.v[2 + n];
          };
          for (int n = 0; n < 3 + Law::kParameters; ++n)
            if (const double by = by_parameter(tension, n);
                by != 0 && derivatives.asks_for(parameter_number(n)))
              derivatives.tension_by_parameter.push_back({here, parameter_number(n), by});
          for (int m = 0; m < Law::kMemory; ++m) {
            derivatives.tension_by_memory.push_back({here, first + m, tension.v[kMemory + m]});
            const Dual& next = remembered[static_cast<size_t>(m)];
            derivatives.memory_by_motion.push_back(
                {first + m, b, by_position(next).transpose(), next.v[1] * u.transpose()});
            derivatives.memory_by_motion.push_back(
                {first + m, a, -by_position(next).transpose(), -next.v[1] * u.transpose()});
            for (int n = 0; n < 3 + Law::kParameters; ++n)
              if (const double by = by_parameter(next, n);
                  by != 0 && derivatives.asks_for(parameter_number(n)))
                derivatives.memory_by_parameter.push_back({first + m, parameter_number(n), by});
            for (int of = 0; of < Law::kMemory; ++of)
              derivatives.memory_by_memory.push_back({first + m, first + of, next.v[kMemory + of]});
          }
        });
  }

 private:
  static constexpr bool kHasPlaces = requires(const std::array<double, Law::kParameters>& p) {
    Law::of_place(0.0, 0.0, p);
  };
  static constexpr bool kThroughPlace = [] {
    if constexpr (requires { Law::kThroughPlace; })
      return Law::kThroughPlace;
    else
      return false;
  }();

  /// Returns the parameters of all lanes, one after the other.
  template <class L>
  static std::array<double, Law::kParameters * L::kCount> numbers_in(
      const EffectValues<L>& parameters) {
    std::array<double, Law::kParameters * L::kCount> numbers;
    auto next = numbers.begin();
    for (size_t p = 0; p < Law::kParameters; ++p)
      for (int lane = 0; lane < L::kCount; ++lane)
        *next++ = static_cast<double>(parameters[p][lane]);
    return numbers;
  }

  /// Returns Law::of_place of every spring.
  template <class Real>
  static std::vector<Real> places_of(const Cloth& cloth,
                                     const std::array<Real, Law::kParameters>& p) {
    std::vector<Real> places;
    for (const auto& of_type : cloth.springs)
      for (const Spring& spring : of_type) {
        const auto [s, t] = middle_of(cloth.mesh, spring);
        places.push_back(Law::of_place(s, t, p));
      }
    return places;
  }
};

}  // namespace clothfit
