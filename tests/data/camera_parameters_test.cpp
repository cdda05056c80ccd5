// Checks camera files. The meaning of the numbers (projection) is checked in tests/calib/.

#include "data/camera_parameters.h"

#include <random>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

const std::string kCamera =
    "format: clothfit-camera/1\n"                                              // line 1
    "name: front\n"                                                            // 2
    "model: brown_conrady\n"                                                   // 3
    "image_size: [960, 720]\n"                                                 // 4
    "focal: [1012.3, 1012.1]\n"                                                // 5
    "centre: [479.7, 360.4]\n"                                                 // 6
    "distortion: [-0.11, 0.035, 0.0008, -0.0005, 0]\n"                         // 7
    "camera_from_world: {rotation: [0, 1, 0, 0], translation: [1, 2, 3.5]}\n"  // 8
    "readout_time: 0.01\n";                                                    // 9

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

void expect_same(const CameraParameters& a, const CameraParameters& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.image_width, b.image_width);
  EXPECT_EQ(a.image_height, b.image_height);
  EXPECT_EQ(a.focal_px, b.focal_px);
  EXPECT_EQ(a.centre_px, b.centre_px);
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(a.readout_time_s, b.readout_time_s);
  ASSERT_EQ(a.camera_from_world.has_value(), b.camera_from_world.has_value());
  if (!a.camera_from_world) return;
  EXPECT_EQ(a.camera_from_world->rotation.coeffs(), b.camera_from_world->rotation.coeffs());
  EXPECT_EQ(a.camera_from_world->translation_m, b.camera_from_world->translation_m);
  ASSERT_EQ(a.camera_from_world->covariance.has_value(),
            b.camera_from_world->covariance.has_value());
  if (a.camera_from_world->covariance) {
    EXPECT_EQ(*a.camera_from_world->covariance, *b.camera_from_world->covariance);
  }
}

TEST(CameraFile, HoldsWhatTheFormatSays) {
  const TemporaryFolder folder;

  const CameraParameters camera = read_camera(folder.write("front.yaml", kCamera));

  EXPECT_EQ(camera.name, "front");
  EXPECT_EQ(camera.model, CameraModel::brown_conrady);
  EXPECT_EQ(camera.image_width, 960);
  EXPECT_EQ(camera.image_height, 720);
  EXPECT_EQ(camera.focal_px, Eigen::Vector2d(1012.3, 1012.1));
  EXPECT_EQ(camera.centre_px, Eigen::Vector2d(479.7, 360.4));
  EXPECT_EQ(camera.distortion, (std::vector<double>{-0.11, 0.035, 0.0008, -0.0005, 0}));
  EXPECT_EQ(camera.camera_from_world->rotation.x(), 1);
  EXPECT_EQ(camera.camera_from_world->translation_m, Eigen::Vector3d(1, 2, 3.5));
  EXPECT_FALSE(camera.camera_from_world->covariance);
  EXPECT_EQ(camera.readout_time_s, 0.01);
}

TEST(CameraFile, ReadsBackToTheLastBit) {
  const TemporaryFolder folder;
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(rng); };
  const std::vector<std::pair<CameraModel, size_t>> models = {{CameraModel::pinhole, 0},
                                                              {CameraModel::brown_conrady, 4},
                                                              {CameraModel::brown_conrady, 5},
                                                              {CameraModel::brown_conrady, 8},
                                                              {CameraModel::kannala_brandt, 4}};
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE(round);
    const auto& [model, distortion_count] = models[static_cast<size_t>(round) % models.size()];
    CameraParameters camera;
    camera.name = "left: #2";
    camera.model = model;
    camera.image_width = 1 + round;
    camera.image_height = 720;
    camera.focal_px = {1000 * std::exp(draw()), 1000 * std::exp(draw())};
    camera.centre_px = {draw(), 1e5 * draw()};
    for (size_t i = 0; i < distortion_count; ++i)
      camera.distortion.push_back(draw() * std::exp(3 * draw()));
    camera.readout_time_s = std::abs(draw());
    if (round % 3 > 0) {
      CameraPose pose;
      pose.rotation = Eigen::Quaterniond(draw(), draw(), draw(), draw()).normalized();
      pose.translation_m = {draw(), draw(), draw()};
      if (round % 3 > 1) {
        const Eigen::Matrix<double, 6, 6> root =
            Eigen::Matrix<double, 6, 6>::NullaryExpr([&] { return 1e-3 * draw(); });
        const Eigen::Matrix<double, 6, 6> square = root * root.transpose();
        pose.covariance = square.selfadjointView<Eigen::Upper>();
      }
      camera.camera_from_world = pose;
    }

    write_camera(camera, folder / "camera.yaml");

    expect_same(read_camera(folder / "camera.yaml"), camera);
  }
}

TEST(CameraFile, NormalisesARotationThatRoundingShortened) {
  const TemporaryFolder folder;
  const std::string text = with_replaced(kCamera, "[0, 1, 0, 0]", "[0.7071, 0.7071, 0, 0]");

  const CameraParameters camera = read_camera(folder.write("front.yaml", text));

  EXPECT_NEAR(camera.camera_from_world->rotation.norm(), 1, 1e-15);
}

TEST(CameraFile, WithoutDistortionHasNone) {
  const TemporaryFolder folder;
  const std::string text =
      with_replaced(kCamera, "distortion: [-0.11, 0.035, 0.0008, -0.0005, 0]\n", "");

  const CameraParameters camera = read_camera(folder.write("front.yaml", text));

  EXPECT_EQ(camera.distortion, (std::vector<double>{0, 0, 0, 0}));
}

TEST(CameraFile, IsRefusedWithFileAndLine) {
  struct Case {
    std::string from, to;
    std::string message;
  };
  const std::string covariance = "translation: [1, 2, 3.5], covariance: ";
  const std::vector<Case> cases = {
      {"camera/1", "camera/2", "c.yaml:1: format = clothfit-camera/2; did you mean"},
      {"name: front\n", "", "c.yaml:1: `name` is missing"},
      {"name: front", "name:", "c.yaml:2: name is empty"},
      {"brown_conrady", "brown", "c.yaml:3: model = brown; known are `pinhole`, `brown_conrady`"},
      {"brown_conrady", "pinhol", "c.yaml:3: model = pinhol; did you mean `pinhole`?"},
      {"brown_conrady", "pinhole", "c.yaml:7: 5 distortion coefficients for pinhole"},
      {"brown_conrady", "kannala_brandt", "c.yaml:7: 5 distortion coefficients for kannala_brandt"},
      {"0.0008, -0.0005, 0]", "0.0008]", "c.yaml:7: 3 distortion coefficients for brown_conrady"},
      {"[960, 720]", "[960]", "c.yaml:4: image_size has 1 items; [width, height]"},
      {"[960, 720]", "960", "c.yaml:4: image_size = 960; a list"},
      {"[960, 720]", "[960, 0]", "c.yaml:4: image_size[1] = 0; a whole number, 1 to 1000000"},
      {"[960, 720]", "[960.5, 720]", "c.yaml:4: image_size[0] = 960.5; a whole number"},
      {"[1012.3, 1012.1]", "[1012.3, -1]", "c.yaml:5: focal = [1012.3, -1]; [fx, fy] in pixels"},
      {"[1012.3, 1012.1]", "[.inf, 1]", "c.yaml:5: focal[0] = .inf; a finite number"},
      {"[479.7, 360.4]", "[479.7, .nan]", "c.yaml:6: centre[1] = .nan; a finite number"},
      {"[479.7, 360.4]", "{x: 1}", "c.yaml:6: centre is a map; a list of 2 numbers"},
      {"focal", "foca", "c.yaml:5: unknown key `foca`; did you mean `focal`?"},
      {"[0, 1, 0, 0]", "[0, 1.002, 0, 0]",
       "c.yaml:8: camera_from_world.rotation = [0, 1.002, 0, 0]; a quaternion"},
      {"[0, 1, 0, 0]", "[0, 0, 0, 0]", "c.yaml:8: camera_from_world.rotation = [0, 0, 0, 0]; a q"},
      {"[0, 1, 0, 0]", "[0, 1, 0]",
       "c.yaml:8: camera_from_world.rotation has 3 items; a list of 4"},
      {", translation: [1, 2, 3.5]", "", "c.yaml:8: `translation` is missing in camera_from_world"},
      {"translation: [1, 2, 3.5]", covariance + "[1, 2]",
       "c.yaml:8: camera_from_world.covariance has 2 items; a list of 21 numbers"},
      {"translation: [1, 2, 3.5]", covariance + "[1,2,0,0,0,0, 1,0,0,0,0, 1,0,0,0, 1,0,0, 1,0, 1]",
       "c.yaml:8: camera_from_world.covariance has a negative variance"},
      {"translation: [1, 2, 3.5]", covariance + "[-1,0,0,0,0,0, 1,0,0,0,0, 1,0,0,0, 1,0,0, 1,0, 1]",
       "c.yaml:8: camera_from_world.covariance has a negative variance"},
      {"0.01", "-0.01", "c.yaml:9: readout_time = -0.01; seconds"},
      {"readout_time: 0.01", "name: side", "c.yaml:9: `name` stands on line 2 already"},
      {"format:", ",format:", "c.yaml:1: the YAML document ends here but the file goes on"},
      {"readout_time: 0.01", "readout_time: [0.01", "c.yaml:10: not YAML: "},
      {"readout_time: 0.01", "readout_time: 0.01\n---\nname: other",
       "c.yaml:9: the YAML document ends here but"},
  };
  const TemporaryFolder folder;
  for (const Case& test : cases) {
    const auto file = folder.write("c.yaml", with_replaced(kCamera, test.from, test.to));
    expect_refused(folder, test.message, [&] { read_camera(file); });
  }
  for (const std::string text : {"", "# nothing\n"}) {
    const auto file = folder.write("c.yaml", text);
    expect_refused(folder, "c.yaml:1: holds no keys", [&] { read_camera(file); });
  }
  expect_refused(folder, "c.yaml:1: the file is a list",
                 [&] { read_camera(folder.write("c.yaml", "- format: clothfit-camera/1\n")); });
}

}  // namespace
}  // namespace clothfit
