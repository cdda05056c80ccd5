// Checks recordings through pictures: the renderer, the tracker, and a fit of both. The renderer
// alone is in tests/vision/render/render_cloth_test.cpp. `clothfit recover --render` prints
// statistics over many recordings. Pictures here are small and few.
#include "apps/study/scene/rendered_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "apps/study/trials/recover.h"
#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "model/topology/surface.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "vision/ingest/decode_picture.h"

namespace clothfit {
namespace {

constexpr std::uint64_t kSeed = 5;

SyntheticScene small_scene() {
  SyntheticScene scene;
  scene.truth_mesh = 7;
  scene.frames = 10;
  scene.frame_rate_hz = 30;
  return scene;
}

/// Makes tags of 36 px.
PictureOptions small_pictures() {
  return {.tags = 4, .width_px = 480, .height_px = 360, .instants = 1};
}

/// Computes pixels of the markers without renderer and sheets: markers x frames.
std::vector<std::vector<Eigen::Vector2d>> projected(const SyntheticScene& scene,
                                                    const FitInput& input) {
  const std::vector<Marker>& markers = input.recording.markers.markers;
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(markers.size()));
  for (size_t m = 0; m < markers.size(); ++m)
    places.col(static_cast<Eigen::Index>(m)) << markers[m].s_m, markers[m].t_m;
  const Surface surface =
      make_surface(scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m, places);
  std::vector<std::vector<Eigen::Vector2d>> pixels;
  for (const auto& shape : simulate_scene(scene, kSeed, scene_frame_times_s(scene))) {
    const Eigen::Matrix3Xd point_m = surface.evaluate(shape);
    auto& row = pixels.emplace_back();
    for (Eigen::Index m = 0; m < point_m.cols(); ++m) {
      const Eigen::Vector3d point = point_m.col(m);
      row.push_back(project(input.cameras[0], camera_from_world(input.cameras[0]) * point).value());
    }
  }
  return pixels;
}

std::vector<double> numbers_of(const RenderedRecording& rendered) {
  std::vector<double> numbers;
  for (const auto& [camera, tracks] : rendered.recording.input.tracks2d)
    for (const Position2d& row : tracks)
      for (const double number :
           {double(row.frame), double(row.marker), row.position_px.x(), row.position_px.y(),
            row.sigma_px, row.rejected.empty() ? 0.0 : 1.0})
        numbers.push_back(number);
  numbers.push_back(rendered.tracker.chi_squared);
  return numbers;
}

TEST(RenderedRecording, HasItsMarkersWhereTheyTrulyAreWithinTheStatedSigma) {
  SCOPED_TRACE(kSeed);
  const SyntheticScene scene = small_scene();

  const RenderedRecording rendered = make_rendered_recording(scene, small_pictures(), kSeed);

  const FitInput& input = rendered.recording.input;
  const auto truth_px = projected(scene, input);
  double chi_squared = 0;
  int accepted = 0;
  Eigen::Vector2d moved_px = Eigen::Vector2d::Zero();
  ASSERT_EQ(input.tracks2d.size(), 1u);
  for (const Position2d& row : input.tracks2d.at("camera1")) {
    if (!row.rejected.empty()) continue;
    const auto m = static_cast<size_t>(row.marker);
    const Eigen::Vector2d true_px = truth_px[static_cast<size_t>(row.frame)][m];
    const Eigen::Vector2d error_px = row.position_px - true_px;
    // The most of 1280 normal numbers are 3.4 sigma off; tags that bend add to it.
    EXPECT_LT(error_px.cwiseAbs().maxCoeff(), 6 * row.sigma_px)
        << "frame " << row.frame << ", marker " << row.marker;
    EXPECT_LT(row.sigma_px, 0.1);
    chi_squared += error_px.squaredNorm() / (row.sigma_px * row.sigma_px);
    ++accepted;
    moved_px = moved_px.cwiseMax((true_px - truth_px[0][m]).cwiseAbs());
  }
  EXPECT_EQ(rendered.tracker.pictures, 10);
  EXPECT_EQ(rendered.tracker.shown, 10 * 4 * 16);
  EXPECT_GE(accepted, 0.98 * rendered.tracker.shown);
  EXPECT_GT(moved_px.maxCoeff(), 10) << "it swings";
  // The report on the tracker agrees with what is seen from outside.
  EXPECT_EQ(rendered.tracker.accepted, accepted);
  EXPECT_NEAR(rendered.tracker.chi_squared, chi_squared, 1e-6 * chi_squared);
  EXPECT_GT(rendered.tracker.chi_squared_per_number(), 0.4);
  EXPECT_LT(rendered.tracker.chi_squared_per_number(), 2);
  EXPECT_NEAR(rendered.tracker.rms_error_px() / rendered.tracker.rms_sigma_px(), 1, 0.5);
}

TEST(RenderedRecording, IsTheSameForAnyNumberOfThreads) {
  SyntheticScene scene = small_scene();
  scene.cameras = 2;
  PictureOptions pictures = small_pictures();
  pictures.tags = 2;
  pictures.width_px = 200;
  pictures.height_px = 150;
  pictures.instants = 3;
  const auto with_threads = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return make_rendered_recording(scene, pictures, kSeed);
  };

  const RenderedRecording alone = with_threads(1);
  const RenderedRecording together = with_threads(2);

  EXPECT_EQ(alone.recording.input.tracks2d.size(), 2u);
  EXPECT_EQ(numbers_of(alone), numbers_of(together));
  EXPECT_NE(numbers_of(alone), numbers_of(make_rendered_recording(scene, pictures, kSeed + 1)));
}

TEST(RenderedRecording, BlursWhatMovesWhileTheShutterIsOpen) {
  SyntheticScene scene = small_scene();
  PictureOptions still = small_pictures();
  still.noise_levels = 0;
  PictureOptions open = still;
  open.exposure_s = 0.03;
  open.instants = 5;
  const TemporaryFolder folder;
  const auto differ = [&](int frame) {
    const auto decoded = [&](const PictureOptions& options) {
      write_bytes(rendered_picture_png(scene, options, kSeed, 0, frame), folder / "a.png");
      return decode_picture(folder / "a.png").grey;
    };
    return cv::norm(decoded(still), decoded(open), cv::NORM_L1);
  };

  // At the first frame the cloth has been held for half the exposure and has fallen since: in the
  // last of five instants by 0.7 mm, a third of a pixel. Four frames on it swings, by pixels.
  EXPECT_GT(differ(0), 0);
  EXPECT_GT(differ(4), 2 * differ(0));
}

TEST(RenderedRecording, RefusesWhatCannotBeRendered) {
  const auto expect_refused = [](const std::string& beginning,
                                 const std::function<void(RecoverOptions&)>& spoil) {
    SCOPED_TRACE(beginning);
    RecoverOptions options;
    options.scene = small_scene();
    options.pictures = small_pictures();
    spoil(options);
    try {
      options.validate();
      ADD_FAILURE() << "was accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(std::string(error.what()), testing::StartsWith(beginning));
    }
  };
  expect_refused("--tags: is out", [](RecoverOptions& o) { o.pictures->tags = 25; });
  expect_refused("--tags: tags would be 14.4 px wide",
                 [](RecoverOptions& o) { o.pictures->tags = 10; });
  expect_refused("--picture", [](RecoverOptions& o) { o.pictures->width_px = 0; });
  expect_refused("--exposure-ms", [](RecoverOptions& o) { o.pictures->exposure_s = 0.04; });
  expect_refused("--instants", [](RecoverOptions& o) { o.pictures->instants = 2; });
  expect_refused("--samples", [](RecoverOptions& o) { o.pictures->samples = 0; });
  expect_refused("--blur-px", [](RecoverOptions& o) { o.pictures->blur_px = 5.1; });
  expect_refused("--grey-noise", [](RecoverOptions& o) { o.pictures->noise_levels = -1; });
  expect_refused("--shot-noise", [](RecoverOptions& o) { o.pictures->shot_levels = NAN; });
  expect_refused("--missing", [](RecoverOptions& o) { o.scene.missing = 0.1; });
  expect_refused("--hand", [](RecoverOptions& o) { o.scene.hand = true; });
  expect_refused("--outliers", [](RecoverOptions& o) { o.scene.outliers = 0.1; });
  expect_refused("--observations",
                 [](RecoverOptions& o) { o.fit.observations = ObservationKind::tracks3d; });
}

TEST(RenderedRecording, GivesTheFabricBackWithinItsIntervals) {
  RecoverOptions options;
  options.scene = small_scene();
  options.scene.frames = 12;
  options.pictures = small_pictures();
  options.fit.mesh_columns = options.fit.mesh_rows = 7;
  options.fit.observations = ObservationKind::tracks2d;
  options.fit.loss = Loss::squared;
  options.start_factor = 2;
  options.trials = 3;
  options.seed = 3;
  SCOPED_TRACE("seed 3");

  const RecoverResult result = recover(options, nullptr, {});

  ASSERT_EQ(result.stop, ExecuteStop::finished);
  EXPECT_EQ(result.failures, 0);
  ASSERT_TRUE(result.tracker.has_value());
  EXPECT_EQ(result.tracker->pictures, 3 * 12);
  ASSERT_EQ(result.parameters.size(), 7u);
  int held = 0, count = 0;
  for (const RecoverTrial& trial : result.trials) {
    for (const RecoveredParameter& p : trial.parameters) {
      if (p.undetermined) continue;
      ++count;
      held += p.interval_90.lower <= p.truth && p.truth <= p.interval_90.upper ? 1 : 0;
    }
    for (const char* stiffness : {"tension_warp", "tension_weft", "shear"}) {
      const auto p = std::ranges::find(trial.parameters, stiffness, &RecoveredParameter::name);
      ASSERT_NE(p, trial.parameters.end());
      EXPECT_FALSE(p->undetermined) << stiffness;
      // The fit started off by a factor of 2.
      EXPECT_NEAR(p->estimate / p->truth, 1, 0.05) << stiffness;
    }
  }
  // There are 21 intervals of 90 %, those of a trial dependent on each other.
  EXPECT_GE(count, 15);
  EXPECT_GE(held, 0.7 * count);
}

TEST(RenderedRecording, HasAJournalOfItsOwn) {
  RecoverOptions plain;
  RecoverOptions rendered = plain;
  rendered.pictures = small_pictures();
  RecoverOptions noisier = rendered;
  noisier.pictures->noise_levels += 1;

  EXPECT_NE(plain.key(), rendered.key());
  EXPECT_NE(rendered.key(), noisier.key());
}

}  // namespace
}  // namespace clothfit
