#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "model/topology/mesh.h"

namespace clothfit {

/// Keeps numbers that follow from an effect's parameters and the mesh alone. Simulations need the
/// same ones at every step; derivatives need those of several parameter sets in turn. The last
/// `most` are kept.
template <class Number, size_t count, size_t most>
class Remembered {
 public:
  using Parameters = std::array<double, count>;

  /// Returns the numbers; `compute()` makes them.
  template <class Compute>
  const std::vector<Number>& at(const Mesh& mesh, const Parameters& p, const Compute& compute) {
    const std::array<double, 4> sheet = {mesh.width_m, mesh.height_m,
                                         static_cast<double>(mesh.columns),
                                         static_cast<double>(mesh.rows)};
    const auto known = std::ranges::find_if(
        kept_, [&](const Kept& one) { return one.parameters == p && one.sheet == sheet; });
    if (known != kept_.end()) return known->numbers;
    if (kept_.size() < most) kept_.emplace_back();
    Kept& replaced = kept_[next_];
    next_ = (next_ + 1) % most;
    replaced = {.parameters = p, .sheet = sheet, .numbers = compute()};
    return replaced.numbers;
  }

 private:
  struct Kept {
    Parameters parameters{};
    std::array<double, 4> sheet{};
    std::vector<Number> numbers{};
  };
  std::vector<Kept> kept_;
  size_t next_ = 0;
};

}  // namespace clothfit
