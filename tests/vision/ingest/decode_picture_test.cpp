// Checks what is read of picture files: levels, bits, turns, damage, and kinds that are refused.

#include "vision/ingest/decode_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

/// A smooth ramp with a dark square: nothing that JPEG rounds by more than a level or two.
cv::Mat scene(int type = CV_8UC1, double white = 255) {
  cv::Mat picture(48, 64, type);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const double level = (x > 20 && x < 40 && y > 15 && y < 35) ? 0.1 * white : white * x / 80;
      if (type == CV_8UC1)
        picture.at<uchar>(y, x) = cv::saturate_cast<uchar>(level);
      else
        picture.at<ushort>(y, x) = cv::saturate_cast<ushort>(level);
    }
  return picture;
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

TEST(DecodePicture, GivesTheLevelsOfEveryKind) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.tif", "a.bmp", "a.pgm", "a.JPG"}) {
    const fs::path file = folder / name;
    cv::imwrite(file.string(), scene(), {cv::IMWRITE_JPEG_QUALITY, 100});
    const DecodedPicture picture = decode_picture(file);
    EXPECT_EQ(picture.damage, "") << name;
    EXPECT_EQ(picture.bits, 8) << name;
    ASSERT_EQ(picture.grey.type(), CV_8UC1) << name;
    EXPECT_LE(largest_difference(picture.grey, scene()), std::string(name) == "a.JPG" ? 2 : 0)
        << name;
  }
}

TEST(DecodePicture, TakesTheLumaOfColours) {
  const TemporaryFolder folder;
  for (const char* name : {"c.png", "c.jpg"}) {
    cv::imwrite((folder / name).string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(200, 100, 50)),
                {cv::IMWRITE_JPEG_QUALITY, 100});
    EXPECT_NEAR(cv::mean(decode_picture(folder / name).grey)[0],
                0.114 * 200 + 0.587 * 100 + 0.299 * 50, 1)
        << name;
  }
}

TEST(DecodePicture, KeepsSixteenBits) {
  const TemporaryFolder folder;
  for (const char* name : {"w.png", "w.tif"}) {
    cv::imwrite((folder / name).string(), scene(CV_16UC1, 4095));
    const DecodedPicture picture = decode_picture(folder / name);
    EXPECT_EQ(picture.bits, 16) << name;
    ASSERT_EQ(picture.grey.type(), CV_16UC1) << name;
    EXPECT_EQ(largest_difference(picture.grey, scene(CV_16UC1, 4095)), 0) << name;
  }
}

TEST(DecodePicture, NamesFilesThatAreCutShort) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.bmp"}) {
    const fs::path file = folder / name;
    cv::imwrite(file.string(), scene());
    const std::string bytes = file_bytes(file);
    write_bytes(bytes.substr(0, bytes.size() / 2), file);
    EXPECT_NE(decode_picture(file).damage, "") << name;
  }
  write_bytes("", folder / "empty.png");
  EXPECT_NE(decode_picture(folder / "empty.png").damage, "");
  write_bytes("no picture", folder / "text.jpg");
  EXPECT_THAT(decode_picture(folder / "text.jpg").damage, HasSubstr("no JPEG"));
}

TEST(DecodePicture, ReportsATurnThatIsAskedForAndAppliesNone) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "plain.jpg").string(), scene());
  const std::string bytes = file_bytes(folder / "plain.jpg");
  for (const int orientation : {1, 3, 6, 8, 2}) {
    // TIFF header and one entry: tag 0x0112, short, one value.
    std::string exif("Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", 25);
    exif += static_cast<char>(orientation);
    exif.append(6, '\0');
    std::string turned = bytes.substr(0, 2) + "\xff\xe1";
    turned += '\0';
    turned += static_cast<char>(exif.size() + 2);
    write_bytes(turned + exif + bytes.substr(2), folder / "turned.jpg");
    const DecodedPicture picture = decode_picture(folder / "turned.jpg");
    EXPECT_EQ(picture.damage, "");
    EXPECT_EQ(picture.turn_deg, orientation == 3   ? 180
                                : orientation == 6 ? 90
                                : orientation == 8 ? 270
                                                   : 0);
    EXPECT_EQ(picture.flipped, orientation == 2);
    EXPECT_EQ(picture.grey.size(), cv::Size(64, 48)) << "as the sensor read it";
  }
}

TEST(DecodePicture, RefusesTransparentPicturesAndReadsOpaqueOnes) {
  const TemporaryFolder folder;
  cv::Mat picture(48, 64, CV_8UC4, cv::Scalar(90, 90, 90, 255));
  cv::imwrite((folder / "a.png").string(), picture);
  EXPECT_NEAR(cv::mean(decode_picture(folder / "a.png").grey)[0], 90, 0.01);
  picture(cv::Rect(3, 4, 5, 6)).setTo(cv::Scalar(90, 90, 90, 128));
  cv::imwrite((folder / "a.png").string(), picture);
  try {
    decode_picture(folder / "a.png");
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("30 of its pixels are transparent"));
  }
}

TEST(DecodePicture, RefusesTheInksOfAPrint) {
  const TemporaryFolder folder;
  const std::vector<unsigned char> inks(size_t{64} * 48 * 4, 100);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const tjhandle encoder = tjInitCompress();
  ASSERT_EQ(
      tjCompress2(encoder, inks.data(), 64, 0, 48, TJPF_CMYK, &bytes, &size, TJSAMP_444, 90, 0), 0);
  write_bytes({reinterpret_cast<const char*>(bytes), size}, folder / "print.jpg");
  tjFree(bytes);
  tjDestroy(encoder);
  EXPECT_THROW(decode_picture(folder / "print.jpg"), InputError);
}

TEST(DecodePicture, SaysThatAFileIsAVideoOrEmpty) {
  const TemporaryFolder folder;
  folder.write("film.jpg", std::string("\0\0\0\030ftypmp42 and so on", 22));
  EXPECT_THAT(decode_picture(folder / "film.jpg").damage, testing::HasSubstr("holds a video"));
  folder.write("none.png", "");
  EXPECT_THAT(decode_picture(folder / "none.png").damage, testing::HasSubstr("empty"));
}

TEST(DecodePicture, TakesTheWhiteLevelThatAPgmStates) {
  const TemporaryFolder folder;
  std::string levels(size_t{2} * 64 * 32, '\0');
  levels[0] = '\x0f';
  levels[1] = '\xff';
  folder.write("a.pgm", "P5 64 32 4095\n" + levels);
  const DecodedPicture picture = decode_picture(folder / "a.pgm");
  ASSERT_EQ(picture.damage, "");
  EXPECT_TRUE(picture.white_stated);
  EXPECT_GE(picture.grey.at<std::uint16_t>(0, 0), 65530) << "4095 is white";
}

TEST(DecodePicture, PassesBytesThatAJpegHasBeforeItsEnd) {
  const TemporaryFolder folder;
  const cv::Mat grey(32, 32, CV_8UC1, cv::Scalar(90));
  std::vector<uchar> bytes;
  cv::imencode(".jpg", grey, bytes);
  bytes.insert(bytes.end() - 2, 3, 0x11);
  folder.write("a.jpg", std::string(bytes.begin(), bytes.end()));
  EXPECT_EQ(decode_picture(folder / "a.jpg").damage, "");
  bytes.erase(bytes.end() - 2, bytes.end());
  bytes.resize(bytes.size() - 8);
  folder.write("b.jpg", std::string(bytes.begin(), bytes.end()));
  EXPECT_NE(decode_picture(folder / "b.jpg").damage, "");
}

}  // namespace
}  // namespace clothfit
