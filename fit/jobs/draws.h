#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace clothfit {

/// Applies one round of splitmix64, a bijection: neighbouring inputs give unrelated outputs.
constexpr std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Returns the seed of one place under a seed, a function of the two alone: no two places share
/// one.
constexpr std::uint64_t derived_seed(std::uint64_t seed, int place) {
  return splitmix64(splitmix64(seed) + static_cast<std::uint64_t>(place));
}

/// The random numbers of one thing among many. They depend on (seed, series, place) alone, so that
/// no order of work and no number of workers changes them. The standard fixes the engine's numbers
/// but leaves the distributions to the library, so the mappings are written out here.
class Draws {
 public:
  Draws(std::uint64_t seed, int series, int place)
      : engine_(derived_seed(splitmix64(seed) + static_cast<std::uint64_t>(series), place)) {}

  /// Draws uniformly from [0, 1), on the grid of 2^-53.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  /// Draws uniformly from 0 ... count - 1, to 2^-53.
  int index(int count) { return static_cast<int>(uniform() * count); }

  /// Draws from the standard normal (Box and Muller; the second number is not used).
  double normal() {
    const double radius = std::sqrt(-2 * std::log1p(-uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace clothfit
