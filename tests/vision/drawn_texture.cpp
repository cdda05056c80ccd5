#include "tests/vision/drawn_texture.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace clothfit {

DrawnTexture::DrawnTexture(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int k = 0; k < kWaves; ++k) {
    const double length_px = 5 * std::pow(5, uniform(generator));
    const double angle = 2 * M_PI * uniform(generator);
    const double per_px = 2 * M_PI / length_px;
    per_px_u_[k] = static_cast<float>(per_px * std::cos(angle));
    per_px_v_[k] = static_cast<float>(per_px * std::sin(angle));
    phase_[k] = static_cast<float>(2 * M_PI * uniform(generator));
  }
}

double DrawnTexture::level(const Eigen::Vector2d& place_px) const {
  const Eigen::Vector2f place = place_px.cast<float>();
  const float sum = (per_px_u_ * place.x() + per_px_v_ * place.y() + phase_).sin().sum();
  return std::clamp(130 + 6 * static_cast<double>(sum), 50.0, 210.0);
}

cv::Mat DrawnTexture::draw(
    const cv::Size& size,
    const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& first_from_picture,
    double noise_levels, std::uint64_t noise_seed,
    const std::function<double(const Eigen::Vector2d&, double)>& light) const {
  std::mt19937_64 generator(noise_seed);
  std::normal_distribution<double> normal;
  cv::Mat picture(size, CV_8UC1);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const Eigen::Vector2d here(u, v);
      double value = level(first_from_picture(here));
      if (light) value = light(here, value);
      if (noise_levels > 0) value += noise_levels * normal(generator);
      picture.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  return picture;
}

}  // namespace clothfit
