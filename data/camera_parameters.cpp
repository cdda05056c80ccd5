#include "data/camera_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"
#include "data/number_limits.h"
#include "data/reading.h"
#include "data/text_file.h"
#include "data/unit_quaternion.h"
#include "data/yaml_value.h"
#include "data/yaml_writer.h"

namespace clothfit {
namespace {

/// Numbers of a camera beyond these are slips in a unit or an exponent. What computes with pixels
/// would overflow on them, and a fit would take what comes out for a place.
constexpr int kMostSide_px = 1'000'000;
constexpr double kShortestFocal_px = 1e-3, kLongestFocal_px = 1e9;
constexpr double kMostDistortion = 1e6;
constexpr double kMostVariance = 1e12;  ///< rad^2, m^2
constexpr double kLongestReadout_s = 1e3;

std::vector<std::pair<std::string, CameraModel>> camera_model_words() {
  return {{"pinhole", CameraModel::pinhole},
          {"brown_conrady", CameraModel::brown_conrady},
          {"kannala_brandt", CameraModel::kannala_brandt}};
}

/// Returns how many distortion coefficients a model may have; the first count means "none given".
std::vector<size_t> distortion_counts(CameraModel model) {
  switch (model) {
    case CameraModel::pinhole:
      return {0};
    case CameraModel::brown_conrady:
      return {4, 5, 8};
    case CameraModel::kannala_brandt:
      return {4};
  }
  assert(false && "every model has its counts");
  return {0};
}

std::vector<double> read_distortion(const YamlValue* value, CameraModel model,
                                    const std::string& model_name) {
  const std::vector<size_t> counts = distortion_counts(model);
  std::vector<double> distortion;
  if (value != nullptr) distortion = value->numbers();
  if (distortion.empty()) distortion.assign(counts.front(), 0.0);
  if (std::find(counts.begin(), counts.end(), distortion.size()) == counts.end())
    value->refuse(fmt::format("{} distortion coefficients for {}", distortion.size(), model_name),
                  "brown_conrady has 4, 5 or 8, kannala_brandt 4, pinhole none");
  for (const double coefficient : distortion)
    if (std::abs(coefficient) > kMostDistortion)
      value->refuse(
          fmt::format("a distortion coefficient of {}", coefficient),
          fmt::format("coefficients from {:g} to {:g}", -kMostDistortion, kMostDistortion));
  return distortion;
}

constexpr int kPoseSize = 6;
constexpr size_t kTriangleSize = 21;  ///< of a symmetric 6 x 6 matrix

/// Says whether a matrix may be a covariance: singular, but without negative variance in any
/// direction. It is judged after scaling to correlations, since radians and metres differ in size.
bool is_covariance(const Eigen::Matrix<double, 6, 6>& matrix) {
  if (matrix.diagonal().minCoeff() < 0) return false;
  const Eigen::Matrix<double, 6, 1> scale =
      matrix.diagonal().unaryExpr([](double v) { return v > 0 ? 1 / std::sqrt(v) : 1.0; });
  const Eigen::Matrix<double, 6, 6> correlation = scale.asDiagonal() * matrix * scale.asDiagonal();
  if (!correlation.allFinite()) return false;
  constexpr double kRounding = 1e-6;
  return symmetric_eigenvalues(correlation).minCoeff() >= -kRounding;
}

Eigen::Matrix<double, 6, 6> read_covariance(const YamlValue& value) {
  const std::array<double, kTriangleSize> triangle = value.numbers_between<kTriangleSize>(
      -kMostVariance, kMostVariance, "variances and covariances in rad2 and m2");
  Eigen::Matrix<double, 6, 6> covariance;
  size_t next = 0;
  for (int row = 0; row < kPoseSize; ++row)
    for (int column = row; column < kPoseSize; ++column)
      covariance(row, column) = covariance(column, row) = triangle[next++];
  if (!is_covariance(covariance))
    value.refuse(value.name() + " has a negative variance",
                 "the upper triangle of a positive semi-definite matrix, row by row");
  return covariance;
}

CameraPose read_pose(const YamlValue& value) {
  const YamlMap map = value.map({"rotation", "translation", "covariance"});
  CameraPose pose;
  const YamlValue& rotation = map.at("rotation");
  const auto [w, x, y, z] = rotation.numbers<4>();
  const std::optional<Eigen::Quaterniond> unit = unit_quaternion(w, x, y, z);
  if (!unit)
    rotation.refuse(fmt::format("{} = [{}, {}, {}, {}]", rotation.name(), w, x, y, z),
                    "a quaternion [w, x, y, z] of norm 1, off by 0.001 at most");
  pose.rotation = *unit;
  const auto [tx, ty, tz] =
      map.at("translation").numbers_between<3>(-kFarthest_m, kFarthest_m, "metres along each axis");
  pose.translation_m = {tx, ty, tz};
  if (const YamlValue* covariance = map.find("covariance"))
    pose.covariance = read_covariance(*covariance);
  return pose;
}

CameraParameters parsed_camera(const std::filesystem::path& file) {
  const YamlMap map =
      read_yaml(file).map({"format", "name", "model", "image_size", "focal", "centre", "distortion",
                           "camera_from_world", "readout_time"});
  map.at("format").one_of<int>({{"clothfit-camera/1", 0}});
  CameraParameters camera;
  camera.name = map.at("name").text();
  const YamlValue& model = map.at("model");
  camera.model = model.one_of(camera_model_words());

  const YamlValue& size = map.at("image_size");
  const std::vector<YamlValue> sides = size.items();
  if (sides.size() != 2)
    size.refuse(fmt::format("image_size has {} items", sides.size()), "[width, height] in pixels");
  camera.image_width = sides[0].whole_number(1, kMostSide_px);
  camera.image_height = sides[1].whole_number(1, kMostSide_px);

  const YamlValue& focal = map.at("focal");
  const auto [fx, fy] = focal.numbers<2>();
  if (fx <= 0 || fy <= 0)
    focal.refuse(fmt::format("focal = [{}, {}]", fx, fy), "[fx, fy] in pixels, both > 0");
  for (const double length : {fx, fy})
    if (length < kShortestFocal_px || length > kLongestFocal_px)
      focal.refuse(fmt::format("focal = [{}, {}]", fx, fy),
                   fmt::format("pixels, {:g} to {:g}", kShortestFocal_px, kLongestFocal_px));
  camera.focal_px = {fx, fy};
  const auto [cx, cy] = map.at("centre").numbers_between<2>(-kFarthest_px, kFarthest_px, "pixels");
  camera.centre_px = {cx, cy};
  camera.distortion = read_distortion(map.find("distortion"), camera.model, model.text());
  if (const YamlValue* pose = map.find("camera_from_world"))
    camera.camera_from_world = read_pose(*pose);
  if (const YamlValue* readout = map.find("readout_time")) {
    camera.readout_time_s = readout->number();
    if (camera.readout_time_s < 0 || camera.readout_time_s > kLongestReadout_s)
      readout->refuse(
          fmt::format("readout_time = {}", camera.readout_time_s),
          fmt::format("seconds from the first to the last row, 0 to {:g}", kLongestReadout_s));
  }
  return camera;
}

}  // namespace

CameraParameters read_camera(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_camera(file); });
}

void write_camera(const CameraParameters& camera, const std::filesystem::path& file) {
  YamlWriter out;
  out.begin_map();
  out.key("format").value("clothfit-camera/1");
  out.key("name").value(camera.name);
  for (const auto& [word, model] : camera_model_words())
    if (model == camera.model) out.key("model").value(word);
  out.key("image_size").begin_flow_list();
  out.value(camera.image_width).value(camera.image_height).end_list();
  out.key("focal").value(std::array{camera.focal_px.x(), camera.focal_px.y()});
  out.key("centre").value(std::array{camera.centre_px.x(), camera.centre_px.y()});
  out.key("distortion").value(camera.distortion);
  if (camera.camera_from_world) {
    const CameraPose& pose = *camera.camera_from_world;
    const Eigen::Quaterniond& q = pose.rotation;
    const Eigen::Vector3d& t = pose.translation_m;
    assert(std::abs(q.norm() - 1) < 1e-9);
    out.key("camera_from_world").begin_flow_map();
    out.key("rotation").value(std::array{q.w(), q.x(), q.y(), q.z()});
    out.key("translation").value(std::array{t.x(), t.y(), t.z()});
    if (pose.covariance) {
      std::vector<double> triangle;
      for (int row = 0; row < kPoseSize; ++row)
        for (int column = row; column < kPoseSize; ++column)
          triangle.push_back((*pose.covariance)(row, column));
      out.key("covariance").value(triangle);
    }
    out.end_map();
  }
  out.key("readout_time").value(camera.readout_time_s);
  out.end_map();
  write_text(out.text(), file);
}

}  // namespace clothfit
