#include "apps/report/page/colour_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace clothfit {
namespace {

using Rgb = std::array<double, 3>;

std::string mix(const Rgb& a, const Rgb& b, double weight_of_b) {
  const auto channel = [&](size_t c) {
    return static_cast<int>(std::lround(a[c] + weight_of_b * (b[c] - a[c])));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", channel(0), channel(1), channel(2));
}

// These are ten even samples of matplotlib's viridis (CC0).
constexpr std::array<Rgb, 10> kViridis = {{{0x44, 0x01, 0x54},
                                           {0x48, 0x28, 0x78},
                                           {0x3e, 0x4a, 0x89},
                                           {0x31, 0x68, 0x8e},
                                           {0x26, 0x82, 0x8e},
                                           {0x1f, 0x9e, 0x89},
                                           {0x35, 0xb7, 0x79},
                                           {0x6d, 0xcd, 0x59},
                                           {0xb4, 0xde, 0x2c},
                                           {0xfd, 0xe7, 0x25}}};
constexpr Rgb kWhite = {0xff, 0xff, 0xff};
constexpr Rgb kBlue = {0x92, 0xbf, 0xe6};
constexpr Rgb kOrange = {0xf7, 0xb3, 0x77};

}  // namespace

std::string viridis(double fraction) {
  const double place = std::clamp(fraction, 0.0, 1.0) * (kViridis.size() - 1);
  const auto below = std::min(static_cast<size_t>(place), kViridis.size() - 2);
  return mix(kViridis[below], kViridis[below + 1], place - static_cast<double>(below));
}

std::string diverging(double value) {
  const double size = std::min(std::abs(value), 1.0);
  return mix(kWhite, value < 0 ? kBlue : kOrange, size);
}

}  // namespace clothfit
