#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace clothfit {

/// What covers a sheet whose markers are of kind `texture`.
enum class TexturePattern {
  noise,  ///< blotches of several sizes, as a print has them
  weave   ///< threads over and under each other, each of a lightness that varies along it
};

struct ClothTextureOptions {
  TexturePattern pattern = TexturePattern::noise;
  std::uint64_t seed = 1;
  /// > 0; of noise the lattice of the finest octave, of a weave the distance between threads.
  double finest_m = 2.5e-3;
  int octaves = 4;         ///< 1 to 10; of noise, each twice as coarse as the one before
  double contrast = 0.25;  ///< 0 to 1; standard deviation of reflectance over its mean
  double mean = 0.5;       ///< mean reflectance, 0 to 1
  void validate() const;   ///< throws InputError
};

/// Reflectance of a textured cloth over material coordinates (s, t), metres.
///
/// Noise is a sum of octaves of normal values on lattices, each interpolated by a cubic B-spline,
/// so that each has hardly any detail below twice its lattice. An octave's amplitude grows with the
/// root of its lattice. A weave has normal values along its threads, and the checks that threads
/// over and under each other make, which fade where a footprint covers several. Values are sampled
/// at a fifth of `finest_m` and bilinear between, which is part of the texture.
class ClothTexture {
 public:
  /// Covers (0, 0) to (width, height), > 0. The same seed gives the same texture.
  ClothTexture(double width_m, double height_m, const ClothTextureOptions& options);

  /// Returns the mean over a parallelogram spanned by the columns of `footprint_m`, of 0 to 1.
  double reflectance(const Eigen::Vector2d& place_m, const Eigen::Matrix2d& footprint_m) const;

 private:
  double relief(const Eigen::Vector2d& place_m) const;

  ClothTextureOptions options_;
  double texel_m_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<float> relief_;  ///< row by row, mean 0 and variance 1
};

}  // namespace clothfit
