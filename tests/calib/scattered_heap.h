#pragma once

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

namespace clothfit {

/// While it lives, what is allocated comes to lie in holes between other blocks, in an order that
/// the seed decides.
class ScatteredHeap {
 public:
  explicit ScatteredHeap(unsigned seed) {
    std::mt19937_64 rng(seed);
    std::uniform_int_distribution<size_t> size(1, 128);
    for (int n = 0; n < 4000; ++n) blocks_.push_back(std::make_unique<double[]>(size(rng)));
    std::shuffle(blocks_.begin(), blocks_.end(), rng);
    blocks_.resize(blocks_.size() / 2);
  }

 private:
  std::vector<std::unique_ptr<double[]>> blocks_;
};

}  // namespace clothfit
