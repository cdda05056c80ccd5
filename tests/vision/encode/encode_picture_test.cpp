// Checks that written pictures hold the levels that they were given, by OpenCV's decoders. Our own
// decoder: ingest/decode_picture_test.cpp.

#include "vision/encode/encode_picture.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

cv::Mat decoded(const std::string& bytes) {
  return cv::imdecode(std::vector<unsigned char>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
}

/// Random levels, of which no two rows or channels are alike.
cv::Mat noise(int type, int white) {
  cv::RNG rng(1);
  cv::Mat picture(37, 53, type);
  rng.fill(picture, cv::RNG::UNIFORM, 0, white + 1);
  return picture;
}

TEST(EncodePicture, PngKeepsEveryLevelOfGreyAndColour) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    const cv::Mat picture = noise(type, CV_MAT_DEPTH(type) == CV_8U ? 255 : 65535);
    const cv::Mat read = decoded(encode_png(picture));
    ASSERT_EQ(read.type(), type);
    EXPECT_EQ(cv::norm(read, picture, cv::NORM_INF), 0) << type;
  }
}

TEST(EncodePicture, PngOfAPartOfAPictureHoldsThatPart) {
  const cv::Mat part = noise(CV_8UC1, 255)(cv::Rect(7, 5, 20, 11));
  EXPECT_EQ(cv::norm(decoded(encode_png(part)), part, cv::NORM_INF), 0);
}

TEST(EncodePicture, JpegLosesLessAtAHigherQuality) {
  const cv::Mat picture = noise(CV_8UC1, 255);
  const auto loss = [&](int quality) {
    return cv::norm(decoded(encode_jpeg(picture, quality)), picture, cv::NORM_L2);
  };
  EXPECT_GT(loss(30), 2 * loss(80));
  EXPECT_GT(loss(80), 2 * loss(100));
}

TEST(WritePng, RefusesAFolderThatIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_png(noise(CV_8UC1, 255), folder / "none/a.png"), InputError);
  write_png(noise(CV_8UC1, 255), folder / "a.png");
  EXPECT_EQ(cv::norm(cv::imread((folder / "a.png").string(), cv::IMREAD_UNCHANGED),
                     noise(CV_8UC1, 255), cv::NORM_INF),
            0);
}

}  // namespace
}  // namespace clothfit
