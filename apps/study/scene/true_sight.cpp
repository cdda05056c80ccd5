#include "apps/study/scene/true_sight.h"

#include <algorithm>
#include <cmath>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "fit/measurement_effects/registry.h"

namespace clothfit {
namespace {

/// Instants per frame interval of a motion that is looked at between frames. A cubic through four
/// of them, 2 ms apart at 60 frames per second, errs by micrometres.
constexpr int kBetween = 8;
constexpr double kBeyondS = 0.25;  ///< seconds after the last frame that can be looked at

}  // namespace

HiddenMeasurement::HiddenMeasurement(const SyntheticScene& scene, const Recording& recording)
    : size_m(scene.size_m), frame_rate_hz(scene.frame_rate_hz), frames(scene.frames) {
  for (const HiddenEffect& hidden : scene.hidden) {
    const MeasurementEffectEntry* entry = measurement_effect_named(hidden.name);
    if (entry == nullptr) continue;
    Hypothesis& term = terms.emplace_back();
    term.effect = entry->make();
    for (const double value : hidden.values) term.parameters.emplace_back(value);
    between_frames =
        between_frames || term.effect->shifts_time() || term.effect->mixes_neighbours();
    shifts_place = shifts_place || term.effect->shifts_place();
  }
  const std::vector<Marker>& markers = recording.markers.markers;
  stated_m.resize(2, static_cast<Eigen::Index>(markers.size()));
  for (size_t m = 0; m < markers.size(); ++m)
    stated_m.col(static_cast<Eigen::Index>(m)) << markers[m].s_m, markers[m].t_m;
}

Sighting HiddenMeasurement::sighting(int frame, int marker, const CameraParameters* camera,
                                     const Eigen::Vector3d& sheet_middle_m) const {
  return {.time_s = frame / frame_rate_hz,
          .first_time_s = 0,
          .frame_interval_s = 1 / frame_rate_hz,
          .sheet_middle_m = sheet_middle_m,
          .from_pattern_middle_m = stated_m.col(marker) - stated_m.rowwise().mean(),
          .camera = camera,
          .observed_row_px = 0};
}

Eigen::Matrix2Xd HiddenMeasurement::places_m(int frame) const {
  Eigen::Matrix2Xd place_m = stated_m;
  for (Eigen::Index m = 0; m < place_m.cols(); ++m) {
    const Sighting from = sighting(frame, static_cast<int>(m), nullptr, Eigen::Vector3d::Zero());
    MeasuredPair shift_m(MeasuredNumber(0.0), MeasuredNumber(0.0));
    for (const Hypothesis& term : terms) term.effect->shift_place(from, term.parameters, shift_m);
    place_m.col(m) += Eigen::Vector2d(shift_m[0].a, shift_m[1].a);
  }
  return place_m;
}

bool HiddenMeasurement::markers_stay_on_cloth() const {
  constexpr double kRounding_m = 1e-9;
  for (int frame = 0; shifts_place && frame < frames; ++frame) {
    const Eigen::Matrix2Xd place_m = places_m(frame);
    if (place_m.minCoeff() < -kRounding_m || place_m.maxCoeff() > size_m + kRounding_m)
      return false;
  }
  return true;
}

TrueSight::TrueSight(const SyntheticScene& scene, const Recording& recording, std::uint64_t seed)
    : scene_(scene), hidden_(scene, recording) {
  if (!hidden_.markers_stay_on_cloth())
    throw InputError("recover", "a hidden effect puts markers beside the cloth",
                     "places that are on it", "hide less of it, or another one");
  surface_ = make_surface(scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m,
                          hidden_.stated_m);

  std::vector<double> time_s = scene_frame_times_s(scene);
  if (hidden_.between_frames) {
    between_ = kBetween;
    const double apart_s = 1 / (scene.frame_rate_hz * between_);
    before_ = static_cast<int>(scene.before_s / apart_s);
    const int after = static_cast<int>(kBeyondS / apart_s);
    time_s.clear();
    for (int k = -before_; k <= (scene.frames - 1) * between_ + after; ++k) {
      const double since_release_s = scene.before_s + k * apart_s;
      time_s.push_back(since_release_s < 1e-9 ? 0 : since_release_s);
    }
  }
  motion_m_ = simulate_scene(scene, seed, time_s);
  sheet_middle_m_ = motion_m_[static_cast<size_t>(before_)].rowwise().mean();
}

Surface TrueSight::surface_seen(int frame) const {
  if (!hidden_.shifts_place) return surface_;
  return make_surface(scene_.truth_mesh, scene_.truth_mesh, scene_.size_m, scene_.size_m,
                      hidden_.places_m(frame));
}

/// Interpolates by the cubic through the four instants around.
Eigen::Vector3d TrueSight::at(double time_s, int marker, const Surface& surface,
                              Instants& known) const {
  const auto place_m = [&](int instant) -> Eigen::Vector3d {
    const int kept = std::clamp(instant, 0, static_cast<int>(motion_m_.size()) - 1);
    const auto [entry, is_new] = known.try_emplace(kept);
    if (is_new) entry->second = surface.evaluate(motion_m_[static_cast<size_t>(kept)]);
    return entry->second.col(marker);
  };
  const double instant = before_ + time_s * scene_.frame_rate_hz * between_;
  const double below = std::floor(instant + 1e-9);
  const double u = instant - below;
  const int k = static_cast<int>(below);
  if (std::abs(u) < 1e-9) return place_m(k);
  return -u * (u - 1) * (u - 2) / 6 * place_m(k - 1) +
         (u + 1) * (u - 1) * (u - 2) / 2 * place_m(k) - (u + 1) * u * (u - 2) / 2 * place_m(k + 1) +
         (u + 1) * u * (u - 1) / 6 * place_m(k + 2);
}

Eigen::Vector3d TrueSight::look(const Sighting& from, int marker, const Surface& surface,
                                Instants& known) const {
  MeasuredNumber seen_s(from.time_s), mixed(0.0);
  for (const HiddenMeasurement::Hypothesis& term : hidden_.terms) {
    term.effect->shift_time(from, term.parameters, seen_s);
    term.effect->mix_neighbours(from, term.parameters, mixed);
  }
  Eigen::Vector3d place_m = at(seen_s.a, marker, surface, known);
  if (mixed.a != 0)
    place_m +=
        mixed.a * (at(seen_s.a - from.frame_interval_s, marker, surface, known) - 2 * place_m +
                   at(seen_s.a + from.frame_interval_s, marker, surface, known));
  MeasuredPoint moved = place_m.cast<MeasuredNumber>();
  for (const HiddenMeasurement::Hypothesis& term : hidden_.terms)
    term.effect->move(from, term.parameters, moved);
  for (int c = 0; c < 3; ++c) place_m[c] = moved[c].a;
  return place_m;
}

Eigen::Matrix3Xd TrueSight::places(int frame) const {
  const Surface surface = surface_seen(frame);
  Instants known;
  Eigen::Matrix3Xd result(3, hidden_.stated_m.cols());
  for (int m = 0; m < result.cols(); ++m)
    result.col(m) = look(hidden_.sighting(frame, m, nullptr, sheet_middle_m_), m, surface, known);
  return result;
}

std::vector<std::optional<Eigen::Vector2d>> TrueSight::pixels(
    int frame, const CameraParameters& camera) const {
  const Surface surface = surface_seen(frame);
  Instants known;
  std::vector<std::optional<Eigen::Vector2d>> result;
  for (int m = 0; m < hidden_.stated_m.cols(); ++m) {
    Sighting from = hidden_.sighting(frame, m, &camera, sheet_middle_m_);
    std::optional<Eigen::Vector2d> pixel;
    // A row that is read later is seen later, elsewhere, and so in another row.
    const int looks = between_ > 1 ? 4 : 1;
    for (int n = 0; n < looks; ++n) {
      if (n > 0) from.observed_row_px = pixel->y();
      pixel = project(camera, camera_from_world(camera) * look(from, m, surface, known));
      if (!pixel) break;
    }
    if (pixel && !hidden_.terms.empty()) {
      MeasuredPair moved(MeasuredNumber(pixel->x()), MeasuredNumber(pixel->y()));
      for (const HiddenMeasurement::Hypothesis& term : hidden_.terms)
        term.effect->move_pixel(from, term.parameters, moved);
      pixel = Eigen::Vector2d(moved[0].a, moved[1].a);
    }
    result.push_back(pixel);
  }
  return result;
}

}  // namespace clothfit
