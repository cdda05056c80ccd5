#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>
#include <optional>

#include "vision/detect/blurred_pattern.h"
#include "vision/detect/picture_blur.h"
#include "vision/detect/tag_kernels.h"
#include "vision/detect/tag_pattern.h"
#include "vision/detect/tag_samples.h"

namespace clothfit {

/// The unknowns of a tag's fit to a picture, in this order: bending along x and along y
/// (polynomials up to degree 3 in tag coordinates), blur, light (offset and contrast, each linear).
struct TagUnknowns {
  static constexpr int kTerms = 10;
  static constexpr int kBendX = 0;
  static constexpr int kBendY = kTerms;
  static constexpr int kBlur = 2 * kTerms;
  static constexpr int kBlurSlope = kBlur + 3;
  static constexpr int kLight = kBlurSlope + 6;
  static constexpr int kCount = kLight + 6;
  /// Ratio of each degree's coefficients to those of the degree before: the bending is smooth.
  static constexpr double kDegreeRatio = 0.2;

  using Terms = Eigen::Matrix<double, kTerms, 1>;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;

  /// Returns the polynomials, and their derivatives by x and y.
  static Terms polynomials(double x, double y);
  static Eigen::Matrix<double, kTerms, 2> polynomial_slopes(double x, double y);
  /// Returns the precision (1 / sd^2) of bending and blur before the picture is seen, 0 for light.
  /// Lengths are in half tags.
  static Vector prior_precision();
};

/// The fit of a tag's printed pattern to the grey levels of its pixels; tag_refine.h has the model.
/// Pixels are those of the samples' window.
class TagFit {
 public:
  /// Starts without bending, with that blur, and with light from the extremes. `pixel_by_tag` maps
  /// small steps from tag coordinates to pixels at the middle of the tag. Keeps references to the
  /// pattern and to the samples, of which there must be some.
  TagFit(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag, const TagSamples& samples,
         const PictureBlur::Unknowns& start);

  /// Starts from a light that is known to 15 % of the contrast: grey levels of black, and of white
  /// above it.
  void expect_light(double black_levels, double contrast_levels);
  /// Bounds what noise and roughness are taken for. Their estimates are medians over the tag, which
  /// are too large once half of it is hidden.
  void bound_noise(double noise_levels, double roughness_px);
  /// When a fit ends: seen, that is after a step below 0.3 of a standard deviation; or predicted,
  /// that is too where the next step would be below 0.2. The latter takes one evaluation less. It
  /// wants a start near the end, since fits that wander may make a short step.
  enum class Ending { kSeen, kPredicted };
  /// Steps until the end; false where it is not reached within `most_steps`, or the blur leaves no
  /// cells.
  bool converge(int most_steps, Ending ending = Ending::kSeen);

  const TagSamples& samples() const { return *samples_; }
  const TagRows& rows() const { return rows_; }
  /// Returns what the rows were evaluated with, without its grid.
  const TagModel& model() const { return model_; }
  const TagUnknowns::Vector& unknowns() const { return unknowns_; }
  /// Returns the precision of each unknown before the picture is seen.
  const TagUnknowns::Vector& prior() const { return prior_; }
  const TagUnknowns::Matrix& covariance() const { return covariance_; }
  /// Returns the robust weights, 0 to 1, of the samples.
  auto robust() const { return rows_.robust.head(samples_->count); }
  /// Returns the brightness of white above black in the middle of the tag; negative where inverted.
  double contrast() const { return unknowns_[TagUnknowns::kLight + 3]; }
  double black() const { return unknowns_[TagUnknowns::kLight]; }  ///< in the middle of the tag
  /// Returns by how much edges are off where the pattern puts them, one standard deviation, px.
  double roughness_px() const { return roughness_px_; }
  /// Returns the noise of flat places, one standard deviation, grey levels.
  double noise_levels() const { return noise_levels_; }

 private:
  double cell_px() const;
  bool leaves_cells(const PictureBlur::Unknowns& unknowns) const;
  void blur_pattern();
  void evaluate();
  void weigh();
  double stretch() const;
  double step();

  const TagPattern* pattern_;
  const TagSamples* samples_;
  Eigen::Matrix2d pixel_by_tag_, tag_by_pixel_;
  TagUnknowns::Vector unknowns_ = TagUnknowns::Vector::Zero();
  TagUnknowns::Vector prior_mean_, prior_;
  TagUnknowns::Matrix covariance_ = TagUnknowns::Matrix::Zero();
  Eigen::LDLT<TagUnknowns::Matrix> solver_;
  std::optional<BlurredPattern> blurred_;
  PictureBlur::Unknowns blurred_for_ = PictureBlur::Unknowns::Zero();   ///< when it was made
  PictureBlur::Unknowns blurred_with_ = PictureBlur::Unknowns::Zero();  ///< what it has
  TagModel model_;
  TagRows rows_;
  double noise_levels_ = 0, roughness_px_ = 0;
  double most_noise_levels_ = std::numeric_limits<double>::infinity();
  double most_roughness_px_ = std::numeric_limits<double>::infinity();
};

}  // namespace clothfit
