// Checks sources of pictures and refusals. The content of the pictures is tested elsewhere.

#include "vision/ingest/image_source.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/temporary_folder.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

/// Makes a picture whose grey level tells which it is.
cv::Mat plain_picture(int level, cv::Size size = {64, 48}) {
  return cv::Mat(size, CV_8UC1, cv::Scalar(level));
}

std::vector<double> levels(ImageSource& images) {
  std::vector<double> result;
  cv::Mat grey;
  while (images.next(grey)) {
    EXPECT_EQ(grey.type(), CV_8UC1);
    result.push_back(cv::mean(grey)[0]);
  }
  EXPECT_FALSE(images.next(grey)) << "stays at its end";
  return result;
}

TEST(ImageSource, GivesPicturesOfAFolderByName) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "b.png").string(), plain_picture(20));
  cv::imwrite((folder / "a.JPG").string(), plain_picture(10));
  cv::Mat colour(48, 64, CV_8UC3, cv::Scalar(30, 30, 30));
  cv::imwrite((folder / "c.jpeg").string(), colour);
  folder.write("notes.txt", "not a picture");

  const auto images = open_images(folder.path());

  EXPECT_EQ(images->count(), 3);
  cv::Mat grey;
  ASSERT_TRUE(images->next(grey));
  EXPECT_EQ(images->current_name(), "a.JPG");
  const std::vector<double> rest = levels(*images);
  ASSERT_EQ(rest.size(), 2U);
  EXPECT_NEAR(rest[0], 20, 1);
  EXPECT_NEAR(rest[1], 30, 1);
}

TEST(ImageSource, RefusesWhatIsNotThere) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  folder.write("film.mp4", "");
  folder.write("text.mp4", "this is no film");

  expect_refused(folder, "missing: there is nothing at this path",
                 [&] { open_images(folder / "missing"); });
  expect_refused(folder, "empty: the folder holds no picture",
                 [&] { open_images(folder / "empty"); });
  expect_refused(folder, "film.mp4: no picture can be read",
                 [&] { open_images(folder / "film.mp4"); });
  expect_refused(folder, "text.mp4: no picture can be read",
                 [&] { open_images(folder / "text.mp4"); });
}

TEST(ImageSource, GivesDamagedPicturesAsSuchAndNamesThem) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.png").string(), plain_picture(60));
  folder.write("1.png", "no picture at all");
  cv::imwrite((folder / "2.png").string(), plain_picture(90));

  const auto images = open_images(folder.path());
  cv::Mat grey;
  ASSERT_TRUE(images->next(grey));
  EXPECT_EQ(images->damage(), "");
  ASSERT_TRUE(images->next(grey));
  EXPECT_NE(images->damage(), "");
  ASSERT_TRUE(images->next(grey));
  EXPECT_EQ(images->damage(), "");
  EXPECT_EQ(images->frame(), 2);
  ASSERT_EQ(images->findings().size(), 1U);
  EXPECT_THAT(images->findings()[0].found,
              testing::HasSubstr("1 of 3 pictures are damaged and left out: frames 1 (1.png"));
}

TEST(ImageSource, RefusesAFolderOfWhichMostIsDamaged) {
  const TemporaryFolder folder;
  for (const char* name : {"0.png", "1.png"}) folder.write(name, "no picture at all");
  cv::imwrite((folder / "2.png").string(), plain_picture(90));
  const auto images = open_images(folder.path());
  cv::Mat grey;
  expect_refused(folder, "1.png: the picture cannot be decoded", [&] { levels(*images); });
}

TEST(ImageSource, RefusesAChangeOfSize) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.png").string(), plain_picture(60));
  cv::imwrite((folder / "1.png").string(), plain_picture(60, {64, 50}));
  const auto images = open_images(folder.path());
  try {
    levels(*images);
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("1.png: the picture is 64 x 50; 64 x 48"));
  }
}

TEST(ImageSource, PassesOverCompanionsOfOtherSystems) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.png").string(), plain_picture(60));
  folder.write("._0.png", std::string(4096, '\0'));
  EXPECT_EQ(open_images(folder.path())->count(), 1);
}

TEST(ImageSource, StretchesLevelsOfTwelveBitsToTheFullRange) {
  const TemporaryFolder folder;
  for (const int n : {0, 1, 2})
    cv::imwrite((folder / fmt::format("{}.png", n)).string(),
                cv::Mat(48, 64, CV_16UC1, cv::Scalar(1000 * (n + 1))));
  const auto images = open_images(folder.path());
  EXPECT_THAT(levels(*images), testing::Pointwise(testing::DoubleNear(0.51),
                                                  {1000 / 16.06, 2000 / 16.06, 3000 / 16.06}));
  ASSERT_EQ(images->findings().size(), 1U);
  EXPECT_EQ(images->findings()[0].found, "levels of 12 bits, stored in 16, are read as such");
}

TEST(ImageSource, GivesPicturesTheFramesThatTheyAreTold) {
  const TemporaryFolder folder;
  for (const char* name : {"0.png", "1.png", "2.png"})
    cv::imwrite((folder / name).string(), plain_picture(60));
  const auto images = open_images(folder.path());
  images->number_frames({0, 2, 5});
  cv::Mat grey;
  std::vector<int> frames;
  while (images->next(grey)) frames.push_back(images->frame());
  EXPECT_THAT(frames, testing::ElementsAre(0, 2, 5));
}

}  // namespace
}  // namespace clothfit
