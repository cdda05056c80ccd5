#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace clothfit {

/// The loops over a dot's pixels that cost the time, compiled for several instruction sets. Sums
/// run over 16 lanes and nothing is fused, so that all of them give the same bits.

/// Number of unknowns of a dot's fit (dot_refine.cpp).
inline constexpr int kDotUnknowns = 12;
/// Number of pixels that a dot's fit looks at.
inline constexpr int kMostDotPixels = 700;
/// One number per pixel, with room for a vector that goes on behind the last. Vectors that lie in
/// two lines of the cache take twice as long.
inline constexpr std::size_t kRowPixels = kMostDotPixels + 36;
struct alignas(64) DotRow : std::array<float, kRowPixels> {};

/// The pixels around a dot. The first is repeated up to a multiple of 16, with no weight.
struct DotPixels {
  DotRow x, y;  ///< px from the window's origin
  DotRow grey;  ///< grey levels
  int count = 0;
  float darkest = 0, brightest = 0;

  int padded() const { return (count + 15) / 16 * 16; }
};

/// Every `stride`-th pixel of a box in a picture.
struct PixelBox {
  const std::uint8_t* first = nullptr;  ///< its top left pixel
  std::ptrdiff_t row_bytes = 0;         ///< from one pixel to the one `stride` rows below
  int stride = 1;
  int columns = 0;  ///< of pixels that are looked at, <= kMostDotPixels
  int rows = 0;
  float left = 0, top = 0;  ///< of its top left pixel, px from the window's origin
};

/// An outline, and how far from it pixels are looked at.
struct DotReach {
  float x = 0, y = 0;              ///< centre, px from the window's origin
  std::array<float, 3> inverse{};  ///< xx, xy, yy of B: |B p| = 1 on the outline
  float beyond_px = 0;             ///< past the outline
  float ratio = 0;                 ///< largest |B p|
};

/// Gathers the pixels of a box that are within reach, row by row from the first to the last.
void gather_dot(const PixelBox& box, const DotReach& reach, DotPixels& pixels);

/// How much darker than a level the pixels within an outline are.
struct DarkSums {
  float weight = 0;    ///< sum of how much
  float x = 0, y = 0;  ///< the same times the place from the outline's centre, px
};
/// Adds up over the pixels of a box with |B p| <= `ratio`; how much brighter where `bright`.
DarkSums dark_sums(const PixelBox& box, const DotReach& reach, float level, bool bright);

/// The unknowns of a dot's fit in single precision.
struct DotShape {
  float x = 0, y = 0;
  std::array<float, 3> inverse{};  ///< xx, xy, yy
  std::array<float, 3> blur{};     ///< covariance: xx, xy, yy, px^2
  float across = 0;                ///< square blur across the line of sight, units of q
  float contrast = 0;
  std::array<float, 3> light{};  ///< at the origin, and by x and y over `light_scale_px`
  float per_light_scale = 0;     ///< 1 / light_scale_px
};

/// What the model says of each pixel.
struct DotRows {
  std::array<DotRow, kDotUnknowns> jacobian;  ///< of the grey level by the unknowns
  DotRow residual;                            ///< grey levels
  DotRow slope;                               ///< of the model, grey levels per px
  DotRow weight;                              ///< inverse variance times robust weight
  float steepest = 0;                         ///< largest slope
};

/// Sets residuals, slopes and derivatives. The derivative of d by A leaves out how |grad |q||
/// changes, which vanishes on the outline; c is not affected, as the rest is even about it.
void evaluate_dot(const DotShape& shape, const DotPixels& pixels, DotRows& rows);

/// What residuals say of the noise.
struct DotResiduals {
  int flat = 0, steep = 0;  ///< number of pixels where the picture is flat, and steep
  float flat_levels = 0;    ///< median size where it is flat
  float steep_px = 0;       ///< median size over the slope where it is steep
  float square_slopes = 0;  ///< sum of 1 / slope^2 where it is steep
};
/// Returns medians right to a thousandth.
DotResiduals dot_residuals(const DotPixels& pixels, const DotRows& rows);

/// How pixels are weighed.
struct DotWeights {
  float square_noise = 0, square_roughness = 0;  ///< variance: noise^2 + (roughness slope)^2
  float square_loss = 0;  ///< of the scale of a Cauchy loss, in standard deviations
};
/// A dot's normal equations, without a prior.
struct DotEquations {
  /// J' W J; only what stands at and below the diagonal is set.
  std::array<std::array<double, kDotUnknowns>, kDotUnknowns> information;
  std::array<double, kDotUnknowns> gradient;  ///< J' W r
  double explained = 0;                       ///< mean robust weight
};
/// Weighs the pixels and adds up.
DotEquations dot_equations(const DotPixels& pixels, const DotWeights& weights, DotRows& rows);

/// Sums over pixels of products with cos k a and sin k a, a being the angle around the dot in units
/// of q, for k = 3, 4 and 5.
struct DotWaves {
  struct Wave {
    float score = 0, information = 0;              ///< of weight residual slope, weight slope^2
    float plain_score = 0, plain_information = 0;  ///< the same without weights
  };
  std::array<std::array<Wave, 2>, 3> waves{};
  float square_residuals = 0;  ///< their sum
};
DotWaves dot_waves(const DotShape& shape, const DotPixels& pixels, const DotRows& rows);

}  // namespace clothfit
