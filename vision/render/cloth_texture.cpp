#include "vision/render/cloth_texture.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr double kTexelsPerFinest = 5;

/// Returns the weights of the uniform cubic B-spline at x, 0 to 1, past the second of four values.
Eigen::Vector4d spline_weights(double x) {
  const double y = 1 - x;
  return Eigen::Vector4d(y * y * y, 3 * x * x * x - 6 * x * x + 4, 3 * y * y * y - 6 * y * y + 4,
                         x * x * x) /
         6;
}

/// Normal values on a lattice, smooth between them.
class NoiseLattice {
 public:
  NoiseLattice(double width_m, double height_m, double across_m, double down_m,
               std::mt19937_64& generator)
      : across_m_(across_m), down_m_(down_m) {
    columns_ = static_cast<int>(std::ceil(width_m / across_m)) + 4;
    const int rows = static_cast<int>(std::ceil(height_m / down_m)) + 4;
    std::normal_distribution<double> normal;
    values_.resize(static_cast<size_t>(columns_ * rows));
    for (double& value : values_) value = normal(generator);
  }
  double at(double s_m, double t_m) const {
    const double x = s_m / across_m_, y = t_m / down_m_;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const Eigen::Vector4d across = spline_weights(x - column), down = spline_weights(y - row);
    double value = 0;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c)
        value +=
            down[r] * across[c] * values_[static_cast<size_t>((row + r) * columns_ + column + c)];
    return value;
  }

 private:
  double across_m_, down_m_;
  int columns_ = 0;
  std::vector<double> values_;
};

void to_unit_variance(std::vector<float>& values) {
  double sum = 0, squares = 0;
  for (const float value : values) {
    sum += double{value};
    squares += double{value} * double{value};
  }
  const auto count = static_cast<double>(values.size());
  const double mean = sum / count;
  const double spread = std::sqrt(std::max(squares / count - mean * mean, 1e-12));
  for (float& value : values) value = static_cast<float>((double{value} - mean) / spread);
}

}  // namespace

void ClothTextureOptions::validate() const {
  if (!(finest_m > 0 && std::isfinite(finest_m)))
    throw InputError("finest_m", fmt::format("{}", finest_m), "metres, > 0");
  if (octaves < 1 || octaves > 10)
    throw InputError("octaves", fmt::format("{}", octaves), "1 to 10");
  if (!(contrast >= 0 && contrast <= 1))
    throw InputError("contrast", fmt::format("{}", contrast), "0 to 1");
  if (!(mean >= 0 && mean <= 1))
    throw InputError("mean", fmt::format("{}", mean), "a reflectance, 0 to 1");
}

ClothTexture::ClothTexture(double width_m, double height_m, const ClothTextureOptions& options)
    : options_(options), texel_m_(options.finest_m / kTexelsPerFinest) {
  options.validate();
  constexpr double kMostTexels = 1e8;
  if (width_m * height_m / (texel_m_ * texel_m_) > kMostTexels)
    throw InputError("finest_m", fmt::format("{}", options.finest_m),
                     "a texture of at most 100 million samples on the whole sheet");
  std::mt19937_64 generator(options.seed);
  columns_ = static_cast<int>(std::ceil(width_m / texel_m_)) + 2;
  rows_ = static_cast<int>(std::ceil(height_m / texel_m_)) + 2;
  relief_.assign(static_cast<size_t>(columns_ * rows_), 0);
  const double whole_width_m = columns_ * texel_m_, whole_height_m = rows_ * texel_m_;
  const auto add = [&](const NoiseLattice& lattice, double amplitude) {
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        relief_[static_cast<size_t>(row * columns_ + column)] +=
            static_cast<float>(amplitude * lattice.at(column * texel_m_, row * texel_m_));
  };
  if (options.pattern == TexturePattern::noise) {
    double lattice_m = options.finest_m;
    for (int octave = 0; octave < options.octaves; ++octave, lattice_m *= 2)
      add({whole_width_m, whole_height_m, lattice_m, lattice_m, generator},
          std::sqrt(lattice_m / options.finest_m));
  } else {
    constexpr double kAlong = 12;  // threads; the length over which a thread changes
    const double thread_m = options.finest_m;
    add({whole_width_m, whole_height_m, thread_m, kAlong * thread_m, generator}, 1);
    add({whole_width_m, whole_height_m, kAlong * thread_m, thread_m, generator}, 1);
  }
  to_unit_variance(relief_);
}

double ClothTexture::relief(const Eigen::Vector2d& place_m) const {
  const double x = std::clamp(place_m.x() / texel_m_, 0.0, columns_ - 1.001);
  const double y = std::clamp(place_m.y() / texel_m_, 0.0, rows_ - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const double right = x - column, down = y - row;
  const float* corner = &relief_[static_cast<size_t>(row * columns_ + column)];
  const double above = double{corner[0]} * (1 - right) + double{corner[1]} * right;
  const double below =
      double{corner[columns_]} * (1 - right) + double{corner[columns_ + 1]} * right;
  return above * (1 - down) + below * down;
}

double ClothTexture::reflectance(const Eigen::Vector2d& place_m,
                                 const Eigen::Matrix2d& footprint_m) const {
  double value = relief(place_m);
  if (options_.pattern == TexturePattern::weave) {
    // Threads alternate, so that checks repeat every second one. A footprint has the second moments
    // of its sides over 12, and blurs a wave by the Gaussian of these moments.
    const double wave_per_m = M_PI / options_.finest_m;
    const double blur_m2 = footprint_m.squaredNorm() / 12;
    const double left = std::exp(-0.5 * wave_per_m * wave_per_m * blur_m2);
    value += left * std::cos(wave_per_m * place_m.x()) * std::cos(wave_per_m * place_m.y());
  }
  return std::clamp(options_.mean * (1 + options_.contrast * value), 0.0, 1.0);
}

}  // namespace clothfit
