// Sound recordings of other kinds than a light sheet that hangs by two corners, as closed forms of
// how sheets move, and the same with one thing wrong. Nothing sound may be refused.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fit/preflight/preflight.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

constexpr double kGravity = 9.81;
constexpr double kSize_m = 0.5;

/// A level sheet, s along x and t along -y, of 11 x 11 markers.
struct MadeSheet {
  double rate_hz = 60;
  int frames = 60;
  double noise_m = 3e-4;
  /// Returns how far the marker at (s, t) is from its place in the flat sheet at a time.
  std::function<Eigen::Vector3d(const Eigen::Vector2d& place_m, double time_s)> moved;
};

FitInput made(const MadeSheet& sheet) {
  constexpr int kSide = 11;
  FitInput input;
  Recording& recording = input.recording;
  recording.name = "made";
  recording.cloth.width_m = recording.cloth.height_m = kSize_m;
  recording.cloth.mass_kg = 0.05;
  recording.cloth.mesh_columns = recording.cloth.mesh_rows = 17;
  recording.gravity_m_per_s2 = {0, 0, -kGravity};
  recording.frame_rate_hz = sheet.rate_hz;
  recording.start = StartKind::released_flat;
  for (int m = 0; m < kSide * kSide; ++m)
    recording.markers.markers.push_back({.name = fmt::format("m{}", m),
                                         .s_m = kSize_m / (kSide - 1) * (m % kSide),
                                         .t_m = kSize_m / (kSide - 1) * (m / kSide)});
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, sheet.noise_m);
  for (int f = 0; f < sheet.frames; ++f)
    for (int m = 0; m < kSide * kSide; ++m) {
      const Marker& marker = recording.markers.markers[static_cast<size_t>(m)];
      const Eigen::Vector2d place_m(marker.s_m, marker.t_m);
      Eigen::Vector3d at_m =
          Eigen::Vector3d(marker.s_m, -marker.t_m, 1) + sheet.moved(place_m, f / sheet.rate_hz);
      for (double& coordinate : at_m) coordinate += noise(random);
      input.tracks3d.push_back(
          {.frame = f, .marker = m, .position_m = at_m, .sigma_m = sheet.noise_m});
    }
  return input;
}

std::vector<HeldPoint> edges(std::initializer_list<ClothEdge> held) {
  std::vector<HeldPoint> points;
  for (const ClothEdge edge : held) points.push_back({.edge = edge});
  return points;
}

std::string text_of(const FitInput& input, FindingState least = FindingState::warning) {
  std::string text;
  for (const Finding& finding : check_recording(input, ObservationKind::automatic))
    if (finding.state >= least)
      text += to_string(finding.state) + " " + finding.check + ": " + sentence(finding) + "\n";
  return text;
}

std::string refused(const FitInput& input) {
  return text_of(input, FindingState::refused);
}

/// The fundamental swing of a stiff sheet that two opposite edges hold: let go, its middle
/// accelerates by gravity, and springs soon turn it round.
MadeSheet stiff_sheet(double swing_hz, double rate_hz) {
  const double omega = 2 * std::numbers::pi * swing_hz;
  return {.rate_hz = rate_hz, .moved = [omega](const Eigen::Vector2d& place_m, double t_s) {
            const double sag_m = kGravity / (omega * omega) * (1 - std::cos(omega * t_s));
            return Eigen::Vector3d(0, 0,
                                   -sag_m * std::sin(std::numbers::pi * place_m.x() / kSize_m));
          }};
}

/// Free fall against the air: v = u tanh(g t / u).
MadeSheet falling(double most_m_per_s, double rate_hz) {
  return {.rate_hz = rate_hz,
          .frames = static_cast<int>(rate_hz),
          .moved = [u = most_m_per_s](const Eigen::Vector2d&, double t_s) {
            return Eigen::Vector3d(0, 0,
                                   -u * u / kGravity * std::log(std::cosh(kGravity * t_s / u)));
          }};
}

/// A cloth that rests for a second and is shaken then.
MadeSheet shaken_later(const std::function<Eigen::Vector3d(const Eigen::Vector2d&)>& rests) {
  return {.moved = [rests](const Eigen::Vector2d& place_m, double t_s) {
    const double shakes_s = std::max(0.0, t_s - 0.5);
    const Eigen::Vector3d shaken(0, 0.2 * shakes_s * shakes_s * place_m.x() / kSize_m, 0);
    return Eigen::Vector3d(rests(place_m) + shaken);
  }};
}

TEST(SoundRecordings, MayBeStiffSheetsBetweenTwoEdges) {
  for (const double swing_hz : {2.0, 4.0, 9.0})
    for (const double rate_hz : {10.0, 30.0, 120.0}) {
      FitInput input = made(stiff_sheet(swing_hz, rate_hz));
      input.recording.held = edges({ClothEdge::left, ClothEdge::right});
      EXPECT_EQ(refused(input), "") << swing_hz << " Hz at " << rate_hz;
    }
}

TEST(SoundRecordings, MayBeDampedSoThatTheyOnlySag) {
  // x'' + 2 z w x' + w^2 x = g by its closed form, overdamped.
  for (const double damping : {1.1, 2.0})
    for (const double rate_hz : {30.0, 60.0, 240.0}) {
      const double omega = 21, root = omega * std::sqrt(damping * damping - 1);
      FitInput input =
          made({.rate_hz = rate_hz, .moved = [=](const Eigen::Vector2d& place_m, double t_s) {
                  const double decay = damping * omega;
                  const double way =
                      1 - std::exp(-decay * t_s) *
                              (std::cosh(root * t_s) + decay / root * std::sinh(root * t_s));
                  return Eigen::Vector3d(0, 0,
                                         -kGravity / (omega * omega) * way *
                                             std::sin(std::numbers::pi * place_m.x() / kSize_m));
                }});
      input.recording.held = edges({ClothEdge::left, ClothEdge::right});
      EXPECT_EQ(refused(input), "") << damping << " at " << rate_hz;
    }
}

TEST(SoundRecordings, MayHaveAWrongRowInTheFirstFrame) {
  FitInput input = made(falling(30, 60));
  input.tracks3d[64].position_m.z() += 0.15;
  EXPECT_EQ(refused(input), "");
  EXPECT_THAT(text_of(input), HasSubstr("m64 by 15"));
}

TEST(SoundRecordings, MayBeSeenAtAHighRateByFewNoisyMarkers) {
  MadeSheet sheet = falling(30, 500);
  sheet.noise_m = 2e-3;
  EXPECT_EQ(refused(made(sheet)), "");
}

TEST(SoundRecordings, MayBeArchesAndHangInAWind) {
  FitInput arch = made(shaken_later([](const Eigen::Vector2d& place_m) {
    const double share = place_m.x() / kSize_m;
    return Eigen::Vector3d(-0.3 * place_m.x(), 0, 0.16 * std::sin(std::numbers::pi * share));
  }));
  arch.recording.start = StartKind::at_rest;
  arch.recording.held = edges({ClothEdge::left, ClothEdge::right});
  EXPECT_EQ(refused(arch), "");
  // A sheet upright in its plane, pushed along its normal as hard as its weight.
  FitInput wind = made({.frames = 14, .moved = [](const Eigen::Vector2d& place_m, double t_s) {
                          const double share = std::min(1.0, place_m.y() / (0.3 * kSize_m));
                          return Eigen::Vector3d(0, 0, -0.5 * kGravity * t_s * t_s * share);
                        }});
  wind.recording.gravity_m_per_s2 = {0, -kGravity, 0};
  wind.recording.held = edges({ClothEdge::top});
  EXPECT_EQ(refused(wind), "");
}

TEST(SoundRecordings, TellGravityOfAStiffSheetWhileItFalls) {
  FitInput input = made(stiff_sheet(2, 60));
  input.recording.held = edges({ClothEdge::left, ClothEdge::right});
  input.recording.gravity_m_per_s2 *= -1;
  EXPECT_THAT(refused(input), HasSubstr("gravity turned round"));
}

TEST(SoundRecordings, MayFallFreelyAndSlowly) {
  for (const double most_m_per_s : {1.0, 2.5, 30.0})
    for (const double rate_hz : {10.0, 30.0, 120.0})
      EXPECT_EQ(text_of(made(falling(most_m_per_s, rate_hz))), "")
          << most_m_per_s << " m/s at " << rate_hz;
}

TEST(SoundRecordings, TellTheRateOfAFall) {
  FitInput input = made(falling(30, 30));
  for (const double declared : {60.0, 120.0, 240.0}) {
    input.recording.frame_rate_hz = declared;
    EXPECT_THAT(refused(input), HasSubstr("30 Hz in place of")) << declared;
  }
}

/// Replaces tracks in space by those of cameras that stand at these places and look at the sheet.
FitInput in_pictures(FitInput input, const std::vector<Eigen::Vector3d>& stands_m) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.1);
  for (const Eigen::Vector3d& stand_m : stands_m) {
    const Eigen::Vector3d forward =
        (Eigen::Vector3d(kSize_m / 2, -kSize_m / 2, 1) - stand_m).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d camera_from_world;
    camera_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    CameraParameters camera{.name = fmt::format("camera{}", input.cameras.size()),
                            .image_width = 960,
                            .image_height = 720,
                            .focal_px = {900, 900},
                            .centre_px = {479.5, 359.5}};
    camera.camera_from_world = {.rotation = Eigen::Quaterniond(camera_from_world),
                                .translation_m = -camera_from_world * stand_m};
    Tracks2d& tracks = input.tracks2d[camera.name];
    for (const Position3d& row : input.tracks3d) {
      const Eigen::Vector3d at = camera_from_world * (row.position_m - stand_m);
      tracks.push_back({.frame = row.frame,
                        .marker = row.marker,
                        .position_px = camera.centre_px + 900 * at.head<2>() / at.z() +
                                       Eigen::Vector2d(noise(random), noise(random)),
                        .sigma_px = 0.1});
    }
    input.recording.cameras.push_back({.name = camera.name});
    input.cameras.push_back(camera);
  }
  input.tracks3d.clear();
  return input;
}

/// A sheet out of the level by so much, in axes in which it is level. It falls along itself by half
/// of what its weight would make it.
FitInput tilted_fall(double tilt_rad) {
  const Eigen::Vector3d gravity =
      kGravity * Eigen::Vector3d(0, -std::sin(tilt_rad), -std::cos(tilt_rad));
  const Eigen::Vector3d falls = gravity.cwiseProduct(Eigen::Vector3d(0, 0.5, 1));
  FitInput input = made({.frames = 20, .noise_m = 1e-5, .moved = [falls](const auto&, double t_s) {
                           return Eigen::Vector3d(falls * t_s * t_s / 2);
                         }});
  input.recording.gravity_m_per_s2 = gravity;
  return input;
}

// What moves along a sheet looks in a picture as if it moved across, too.
TEST(SoundRecordings, TellTheFallAcrossThemFromThatAlongThem) {
  for (const std::vector<Eigen::Vector3d>& stands_m :
       {std::vector<Eigen::Vector3d>{{1.2, -1.2, 1.9}},
        std::vector<Eigen::Vector3d>{{0.25, -1.4, 2}, {1.3, -0.9, 1.8}}}) {
    FitInput input = in_pictures(tilted_fall(1.1), stands_m);
    EXPECT_EQ(text_of(input), "") << stands_m.size();
    input.recording.frame_rate_hz = 30;
    EXPECT_THAT(refused(input), HasSubstr("60 Hz in place of 30")) << stands_m.size();
  }
}

TEST(SoundRecordings, MayStickOutOrBeHeldAtTheirSide) {
  // A stiff sheet that rests level, clamped at its left edge.
  FitInput sticks_out = made(shaken_later([](const Eigen::Vector2d& place_m) {
    return Eigen::Vector3d(0, 0, -0.1 * std::pow(place_m.x(), 2));
  }));
  sticks_out.recording.start = StartKind::at_rest;
  sticks_out.recording.held = edges({ClothEdge::left});
  EXPECT_EQ(refused(sticks_out), "");
  // A flag: its left edge stands upright.
  FitInput flag = made(shaken_later([](const Eigen::Vector2d& place_m) {
    return Eigen::Vector3d(0, place_m.y(), -place_m.y());
  }));
  flag.recording.start = StartKind::at_rest;
  flag.recording.held = edges({ClothEdge::left});
  EXPECT_EQ(text_of(flag), "");
}

TEST(SoundRecordings, DoNotStandOnWhatHoldsThem) {
  // It hangs from its bottom edge.
  FitInput input = made(shaken_later([](const Eigen::Vector2d& place_m) {
    return Eigen::Vector3d(0, place_m.y(), -place_m.y());
  }));
  input.recording.start = StartKind::at_rest;
  input.recording.held = edges({ClothEdge::bottom});
  EXPECT_THAT(refused(input), HasSubstr("above what holds the cloth"));
}

TEST(SoundRecordings, MayBeNoisierThanTheirMarkersAreApart) {
  MadeSheet sheet = falling(30, 60);
  sheet.noise_m = 0.012;  // markers are 50 mm apart
  EXPECT_EQ(refused(made(sheet)), "");
}

TEST(SoundRecordings, MayDeclareThatFramesAreLostOrSupportsMove) {
  FitInput lost = made(falling(30, 60));
  for (Position3d& row : lost.tracks3d)
    if (row.frame > 20) row.position_m.z() -= 0.06;
  ASSERT_THAT(text_of(lost), HasSubstr("between frames 20 and 21"));
  lost.recording.declared = {{.name = "dropped_frames"}};
  EXPECT_EQ(text_of(lost), "");

  FitInput moves = made(stiff_sheet(2, 60));
  moves.recording.held = {{.at_m = {0.25, 0.25}}};
  ASSERT_THAT(refused(moves), HasSubstr("(0.25, 0.25) is fixed"));
  moves.recording.declared = {{.name = "support_move"}};
  EXPECT_EQ(refused(moves), "");
}

/// A box around the origin of the x and y axes, from `low_m` up, its faces outwards.
SurfaceMesh box(double half_m, double low_m, double high_m) {
  SurfaceMesh surface;
  surface.vertex_m.resize(3, 8);
  for (int v = 0; v < 8; ++v)
    surface.vertex_m.col(v) << ((v & 1) != 0 ? half_m : -half_m), ((v & 2) != 0 ? half_m : -half_m),
        ((v & 4) != 0 ? high_m : low_m);
  surface.triangle.resize(3, 12);
  surface.triangle << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                  //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return surface;
}

TEST(SoundRecordings, MayFallInABoxButNotBesideOne) {
  FitInput input = made(falling(30, 60));
  SurfaceMesh inwards = box(2, -6, 3);
  inwards.triangle.row(1).swap(inwards.triangle.row(2));
  input.recording.obstacle = inwards;
  EXPECT_EQ(refused(input), "");
  input.recording.obstacle = box(2, -6, 3);
  EXPECT_THAT(refused(input), HasSubstr("inside it at the start"));

  SurfaceMesh below = box(0.6, 0.2, 0.5);
  below.triangle.row(1).swap(below.triangle.row(2));
  input.recording.obstacle = below;
  EXPECT_THAT(refused(input), HasSubstr("inwards"));
}

TEST(SoundRecordings, MayLieOnAnObstacleByNoise) {
  FitInput input = made({.noise_m = 1e-3, .moved = [](const Eigen::Vector2d& place_m, double t_s) {
                           const double slides_m = 0.3 * t_s * t_s * place_m.x();
                           return Eigen::Vector3d(slides_m, 0, 0);
                         }});
  input.recording.obstacle = box(3, 0, 1);
  EXPECT_EQ(refused(input), "");
}

TEST(SoundRecordings, AreLookedAtAboveAFloorFarBelow) {
  FitInput input = made(stiff_sheet(2, 60));
  input.recording.held = edges({ClothEdge::left, ClothEdge::right});
  input.recording.obstacle = box(3, -5, -4);
  input.recording.gravity_m_per_s2 *= -1;
  EXPECT_THAT(refused(input), HasSubstr("gravity turned round"));
}

/// Puts copies of the frame before in the place of some.
FitInput with_copies(const std::function<bool(int frame)>& is_copy) {
  FitInput input = made(stiff_sheet(1.2, 60));
  input.recording.held = edges({ClothEdge::left, ClothEdge::right});
  for (size_t row = 0; row < input.tracks3d.size(); ++row)
    if (is_copy(input.tracks3d[row].frame))
      input.tracks3d[row].position_m = input.tracks3d[row - 121].position_m;
  return input;
}

TEST(SoundRecordings, HaveNoCopiesInPlaceOfFrames) {
  EXPECT_EQ(text_of(with_copies([](int) { return false; })), "");
  // A lost frame leaves a halt and a jump, every second one nothing but halts.
  EXPECT_THAT(text_of(with_copies([](int frame) { return frame == 17; })),
              HasSubstr("stand still in frame 17"));
  EXPECT_THAT(text_of(with_copies([](int frame) { return frame % 2 == 1; })),
              HasSubstr("at a lower rate"));
  EXPECT_THAT(text_of(with_copies([](int frame) { return frame % 3 != 0; })),
              HasSubstr("at a lower rate"));
}

TEST(SoundRecordings, HaveNoFrozenMarkerBelowAHeldEdge) {
  FitInput input = made(stiff_sheet(2, 60));
  input.recording.held = edges({ClothEdge::left});
  for (Position3d& row : input.tracks3d)
    if (row.marker == 60 && row.frame > 10)
      row.position_m = input.tracks3d[10 * 121 + 60].position_m;
  EXPECT_THAT(text_of(input), HasSubstr("m60 (50 frames)"));
}

TEST(SoundRecordings, StretchLittle) {
  FitInput input = made(falling(30, 60));
  input.recording.start = StartKind::unknown;
  for (Position3d& row : input.tracks3d) row.position_m *= 1.1;
  EXPECT_THAT(text_of(input), HasSubstr("print's scale"));
}

}  // namespace
}  // namespace clothfit
