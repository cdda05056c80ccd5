#include "model/kernels/spring_force.h"

#include <cmath>

// One source, compiled for several instruction sets and chosen when the program starts. Compiler
// flags of this file forbid contraction, so that all of them give the same bits. Sanitizers
// instrument the resolver that chooses before they are ready themselves, so they get the plain
// version. The tests define the macro themselves, to compile for one instruction set after another.
#if defined(CLOTHFIT_EVERY_INSTRUCTION_SET)
#elif defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CLOTHFIT_EVERY_INSTRUCTION_SET \
  __attribute__((target_clones("arch=skylake-avx512", "avx2", "default")))
#else
#define CLOTHFIT_EVERY_INSTRUCTION_SET
#endif

namespace clothfit {

CLOTHFIT_EVERY_INSTRUCTION_SET
void add_spring_forces(const SpringNet& springs, const LaneSprings& constants,
                       const LaneVectors& position_m, const LaneVectors& velocity_m_per_s,
                       LaneVectors& force_n) {
  const double* const px = position_m.x.data();
  const double* const py = position_m.y.data();
  const double* const pz = position_m.z.data();
  const double* const vx = velocity_m_per_s.x.data();
  const double* const vy = velocity_m_per_s.y.data();
  const double* const vz = velocity_m_per_s.z.data();
  double* const fx = force_n.x.data();
  double* const fy = force_n.y.data();
  double* const fz = force_n.z.data();

  for (size_t type = 0; type < kSpringTypes; ++type) {
    alignas(64) double l0[kLanes], k[kLanes], c[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      l0[l] = constants.natural_length_m[type][l];
      k[l] = constants.stiffness_n_per_m[type][l];
      c[l] = constants.damping_ns_per_m[type][l];
    }
    for (const Spring& spring : springs[type]) {
      const std::ptrdiff_t a = std::ptrdiff_t{spring.a} * kLanes;
      const std::ptrdiff_t b = std::ptrdiff_t{spring.b} * kLanes;
      alignas(64) double gx[kLanes], gy[kLanes], gz[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const double dx = px[b + l] - px[a + l];
        const double dy = py[b + l] - py[a + l];
        const double dz = pz[b + l] - pz[a + l];
        const double length2 = dx * dx + dy * dy + dz * dz;
        const double length = std::sqrt(length2);
        const double inverse = length > 0 ? 1.0 / length : 0.0;
        const double stretching = (dx * (vx[b + l] - vx[a + l]) + dy * (vy[b + l] - vy[a + l]) +
                                   dz * (vz[b + l] - vz[a + l])) *
                                  inverse;
        const double pull = (k[l] * (length - l0[l]) + c[l] * stretching) * inverse;
        gx[l] = pull * dx;
        gy[l] = pull * dy;
        gz[l] = pull * dz;
      }
      for (int l = 0; l < kLanes; ++l) fx[a + l] += gx[l];
      for (int l = 0; l < kLanes; ++l) fy[a + l] += gy[l];
      for (int l = 0; l < kLanes; ++l) fz[a + l] += gz[l];
      for (int l = 0; l < kLanes; ++l) fx[b + l] -= gx[l];
      for (int l = 0; l < kLanes; ++l) fy[b + l] -= gy[l];
      for (int l = 0; l < kLanes; ++l) fz[b + l] -= gz[l];
    }
  }
}

CLOTHFIT_EVERY_INSTRUCTION_SET
void integrate_euler(const Eigen::VectorXd& mass_kg, double time_step_s, const LaneVectors& force_n,
                     LaneVectors& velocity_m_per_s, LaneVectors& position_m) {
  const auto integrate = [&](const double* f, double* v, double* p) {
    for (Eigen::Index vertex = 0; vertex < mass_kg.size(); ++vertex) {
      const double h_over_m = time_step_s / mass_kg[vertex];
      for (std::ptrdiff_t n = vertex * kLanes; n < (vertex + 1) * kLanes; ++n) {
        v[n] += h_over_m * f[n];
        p[n] += time_step_s * v[n];
      }
    }
  };
  integrate(force_n.x.data(), velocity_m_per_s.x.data(), position_m.x.data());
  integrate(force_n.y.data(), velocity_m_per_s.y.data(), position_m.y.data());
  integrate(force_n.z.data(), velocity_m_per_s.z.data(), position_m.z.data());
}

}  // namespace clothfit
