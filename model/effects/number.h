#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "model/cloth/effect.h"
#include "model/kernels/lanes.h"

/// The numbers over which effects write their forces, once for all: `double`, a number in every
/// lane, or a dual number that carries derivatives (ceres::Jet).
namespace clothfit {

/// A yes or no in every lane.
template <class L>
struct LaneMask {
  Eigen::Array<bool, L::kCount, 1> lanes;
};

/// A number in every lane, with the arithmetic of a number.
template <class L>
struct LaneNumber {
  LaneValue<L> lanes;

  LaneNumber() = default;
  LaneNumber(const LaneValue<L>& values) : lanes(values) {}
  LaneNumber(double value)
      : lanes(LaneValue<L>::Constant(static_cast<typename L::Number>(value))) {}

  friend LaneNumber operator+(const LaneNumber& a, const LaneNumber& b) {
    return LaneValue<L>(a.lanes + b.lanes);
  }
  friend LaneNumber operator-(const LaneNumber& a, const LaneNumber& b) {
    return LaneValue<L>(a.lanes - b.lanes);
  }
  friend LaneNumber operator*(const LaneNumber& a, const LaneNumber& b) {
    return LaneValue<L>(a.lanes * b.lanes);
  }
  friend LaneNumber operator/(const LaneNumber& a, const LaneNumber& b) {
    return LaneValue<L>(a.lanes / b.lanes);
  }
  friend LaneNumber operator-(const LaneNumber& a) { return LaneValue<L>(-a.lanes); }
  friend LaneMask<L> operator<(const LaneNumber& a, const LaneNumber& b) {
    return {a.lanes < b.lanes};
  }
  friend LaneMask<L> operator>(const LaneNumber& a, const LaneNumber& b) {
    return {a.lanes > b.lanes};
  }
  friend LaneNumber sqrt(const LaneNumber& a) { return LaneValue<L>(a.lanes.sqrt()); }
  friend LaneNumber select(const LaneMask<L>& where, const LaneNumber& a, const LaneNumber& b) {
    return LaneValue<L>(where.lanes.select(a.lanes, b.lanes));
  }
};

/// Returns `a` where the condition holds, else `b`. Laws do not branch, so that every lane takes
/// the same path.
template <class Real>
Real select(bool where, const Real& a, const Real& b) {
  return where ? a : b;
}

/// The number that a law computes with in lanes of kind L.
template <class L>
using RealOf = std::conditional_t<L::kCount == 1, typename L::Number, LaneNumber<L>>;

template <class Real>
struct Vector3 {
  Real x, y, z;

  friend Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend Vector3 operator*(const Real& s, const Vector3& v) { return {s * v.x, s * v.y, s * v.z}; }
};

template <class Real>
Real dot(const Vector3<Real>& a, const Vector3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Real>
Vector3<Real> cross(const Vector3<Real>& a, const Vector3<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Returns the vector's direction, or nothing where it is shorter than 1e-15. A search that tries
/// poor parameters meets surfaces that are folded to nothing, and needs to carry on.
template <class Real>
Vector3<Real> direction(const Vector3<Real>& v) {
  using std::sqrt;
  const Real square = dot(v, v);
  // Where the root's derivative is infinite it must not be taken.
  const auto some = square > Real(1e-30);
  const Real inverse = select(some, Real(1.0) / sqrt(select(some, square, Real(1.0))), Real(0.0));
  return inverse * v;
}

/// Returns the nearest whole number.
inline double nearest_whole(double x) {
  return std::round(x);
}
template <class L>
LaneNumber<L> nearest_whole(const LaneNumber<L>& x) {
  return LaneValue<L>(x.lanes.round());
}
/// Returns that of a dual number; constant almost everywhere.
template <class Dual>
requires requires(Dual x) {
  x.a;
}
Dual nearest_whole(const Dual& x) {
  return Dual(std::round(x.a));
}

/// Returns sin(2 pi turns) to 1e-13, by plain arithmetic. The C library's own differs in its last
/// bits from processor to processor.
template <class Real>
Real sine_of_turns(const Real& turns) {
  const Real rest = turns - nearest_whole(turns);  // within half a turn
  Real quarter = select(rest > Real(0.25), Real(0.5) - rest, rest);
  quarter = select(quarter < Real(-0.25), Real(-0.5) - quarter, quarter);
  const Real x = Real(6.283185307179586) * quarter;
  const Real square = x * x;
  Real sum(0.0);
  for (int n = 18; n >= 2; n -= 2)  // Taylor's series from its small end
    sum = Real(1.0) - square * sum / Real(static_cast<double>(n * (n + 1)));
  return x * sum;
}
/// Returns that of a dual number, by the chain rule.
template <class Dual>
requires requires(Dual x) {
  x.a;
}
Dual sine_of_turns(const Dual& turns) {
  const double slope = 6.283185307179586 * sine_of_turns(turns.a + 0.25);
  return Dual(sine_of_turns(turns.a), slope * turns.v);
}

// These functions turn lanes into numbers and back.

template <class L>
Vector3<RealOf<L>> vector_at(const LaneVectors<L>& vectors, int k) {
  if constexpr (L::kCount == 1)
    return {vectors.x(0, k), vectors.y(0, k), vectors.z(0, k)};
  else
    return {LaneValue<L>(vectors.x.col(k)), LaneValue<L>(vectors.y.col(k)),
            LaneValue<L>(vectors.z.col(k))};
}

template <class L>
void set_at(LaneVectors<L>& vectors, int k, const Vector3<RealOf<L>>& value) {
  if constexpr (L::kCount == 1) {
    vectors.x(0, k) = value.x;
    vectors.y(0, k) = value.y;
    vectors.z(0, k) = value.z;
  } else {
    vectors.x.col(k) = value.x.lanes;
    vectors.y.col(k) = value.y.lanes;
    vectors.z.col(k) = value.z.lanes;
  }
}

template <class L>
void add_at(LaneVectors<L>& vectors, int k, const Vector3<RealOf<L>>& value) {
  set_at(vectors, k, vector_at(vectors, k) + value);
}

template <class L>
RealOf<L> real_of(const LaneValue<L>& value) {
  if constexpr (L::kCount == 1)
    return value[0];
  else
    return value;
}

template <class L>
Vector3<RealOf<L>> real_of(const LaneVector<L>& v) {
  return {real_of<L>(v.x), real_of<L>(v.y), real_of<L>(v.z)};
}

template <class L, int count>
std::array<RealOf<L>, count> reals_of(const EffectValues<L>& values) {
  std::array<RealOf<L>, count> reals;
  for (size_t p = 0; p < count; ++p) reals[p] = real_of<L>(values[p]);
  return reals;
}

template <class L>
void set_real(LaneArray<L>& array, int column, const RealOf<L>& value) {
  if constexpr (L::kCount == 1)
    array(0, column) = value;
  else
    array.col(column) = value.lanes;
}

}  // namespace clothfit
