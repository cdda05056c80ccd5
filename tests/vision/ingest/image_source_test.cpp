// Checks sources of pictures and refusals. The content of the pictures is tested elsewhere.

#include "vision/ingest/image_source.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/temporary_folder.h"

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

TEST(ImageSource, GivesTheSamePicturesFromAVideo) {
  const TemporaryFolder folder;
  const std::string file = (folder / "film.avi").string();
  cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30, {64, 48}, false);
  if (!writer.isOpened()) {
    GTEST_SKIP() << "OpenCV writes no Motion JPEG here";
  }
  for (int i = 0; i < 5; ++i) writer.write(plain_picture(40 * (i + 1)));
  writer.release();

  const auto images = open_images(file);
  const std::vector<double> found = levels(*images);

  EXPECT_EQ(images->count(), 5);
  EXPECT_EQ(images->current_name(), "frame 4");
  ASSERT_EQ(found.size(), 5U);
  for (size_t i = 0; i < 5; ++i) EXPECT_NEAR(found[i], 40 * (static_cast<double>(i) + 1), 2);
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

TEST(ImageSource, RefusesBrokenPicturesAndAChangeOfSize) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.png").string(), plain_picture(10));
  folder.write("1.png", "no picture at all");
  cv::Mat grey;
  const auto broken = open_images(folder.path());
  ASSERT_TRUE(broken->next(grey));
  expect_refused(folder, "1.png: the picture cannot be decoded", [&] { broken->next(grey); });

  cv::imwrite((folder / "1.png").string(), plain_picture(10, {64, 50}));
  const auto changed = open_images(folder.path());
  ASSERT_TRUE(changed->next(grey));
  expect_refused(folder, "1.png: the picture is 64 x 50", [&] { changed->next(grey); });
}

}  // namespace
}  // namespace clothfit
