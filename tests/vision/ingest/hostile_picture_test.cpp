// Checks pictures that would mislead or overwhelm a decoder: sizes, formats, damage. Levels of
// whole pictures are checked in decode_picture_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/ingest/picture_headers.h"
#include "vision/ingest/decode_picture.h"
#include "vision/ingest/open_images.h"
#include "vision/ingest/picture_limits.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

/// Returns the most memory that the process has held so far, MB.
double most_memory_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::string refusal(const fs::path& file) {
  try {
    return "damaged: " + decode_picture(file).damage;
  } catch (const InputError& error) {
    return error.what();
  }
}

/// Something to decode, of levels that no damage leaves as they are.
cv::Mat busy_picture() {
  cv::Mat grey(48, 64, CV_8UC1);
  cv::RNG random(7);
  random.fill(grey, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(grey, grey, {}, 1);
  return grey;
}

TEST(HostilePicture, IsRefusedByItsStatedSizeInEveryFormat) {
  struct Sides {
    std::uint32_t width, height;
  };
  const TemporaryFolder folder;
  const double before_MB = most_memory_MB();
  for (const auto& [width, height] : {Sides{1, 1},
                                      {4, 4},
                                      {10, 1},
                                      {31, 4000},
                                      {4000, 31},
                                      {16384, 1},
                                      {16000, 16000},
                                      {30000, 30000},
                                      {20000, 20000},
                                      {16385, 64},
                                      {64, 16385},
                                      {8192, 8193},
                                      {65500, 65500},
                                      {2'000'000'000, 2'000'000'000}})
    for (const StatedPicture& picture : pictures_of_size(width, height)) {
      SCOPED_TRACE(picture.name);
      write_bytes(picture.bytes, folder / picture.name);
      EXPECT_THAT(
          refusal(folder / picture.name),
          testing::AllOf(HasSubstr(picture.name),
                         HasSubstr(std::to_string(width) + " x " + std::to_string(height)),
                         HasSubstr("32 to 16384 px a side"),
                         HasSubstr(std::min(width, height) < 32 ? "not reduced" : "shrink")));
    }
  EXPECT_LT(most_memory_MB() - before_MB, 50) << "nothing was made of the stated size";
}

TEST(HostilePicture, CutBehindAnyByteIsReadOrRefused) {
  const TemporaryFolder folder;
  std::vector<StatedPicture> files = pictures_of_size(40, 40);
  files.push_back({"video.avi", std::string("RIFF\x10\0\0\0AVI LIST", 16)});
  files.push_back({"video.mp4", std::string("\0\0\0\x18"
                                            "ftypisom\0\0\0\0",
                                            16)});
  for (const StatedPicture& file : files)
    for (size_t length = 0; length <= std::min<size_t>(file.bytes.size(), 64); ++length) {
      SCOPED_TRACE(std::string(file.name) + " of " + std::to_string(length) + " bytes");
      write_bytes(file.bytes.substr(0, length), folder / "picture");
      EXPECT_NO_THROW(refusal(folder / "picture"));
      try {
        open_images(folder / "picture");
      } catch (const InputError&) {
        // Anything else fails the test.
      }
    }
}

TEST(HostilePicture, MayHaveTheLeastAndTheGreatestSize) {
  for (const auto& [width, height] :
       {std::pair(32, 32), std::pair(32, 16384), std::pair(16384, 32), std::pair(8192, 8192)})
    EXPECT_NO_THROW(require_possible_size("a picture", width, height)) << width << " x " << height;
}

TEST(HostilePicture, HasCompressedTextsThatAreNotUnfolded) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "a.png").string(), busy_picture());
  std::string bytes = file_bytes(folder / "a.png");
  const std::string text = deflated(std::string(100'000'000, 'a'));
  constexpr size_t kAfterHeader = 33;  // bytes
  for (const std::string& chunk : {png_chunk("zTXt", std::string("a\0\0", 3) + text),
                                   png_chunk("iTXt", std::string("a\0\1\0\0\0", 6) + text),
                                   png_chunk("iCCP", std::string("a\0\0", 3) + text)})
    bytes.insert(kAfterHeader, chunk);
  write_bytes(bytes, folder / "a.png");
  const double before_MB = most_memory_MB();
  const DecodedPicture picture = decode_picture(folder / "a.png");
  EXPECT_EQ(picture.damage, "");
  EXPECT_EQ(cv::norm(picture.grey, busy_picture(), cv::NORM_INF), 0);
  EXPECT_LT(most_memory_MB() - before_MB, 50);
}

TEST(HostilePicture, OfAnotherFormatIsRefusedByThatUnderAnyName) {
  struct Other {
    const char* format;
    std::string bytes;
  };
  const auto dicom = std::string(128, '\0') + "DICM";
  const std::vector<Other> others = {
      {"HEIC", std::string("\0\0\0\x18"
                           "ftypheic\0\0\0\0mif1heic",
                           24)},
      {"HEIC", std::string("\0\0\0\x18"
                           "ftypmif1\0\0\0\0mif1heic",
                           24)},
      {"AVIF", std::string("\0\0\0\x18"
                           "ftypavif\0\0\0\0mif1miaf",
                           24)},
      {"OpenEXR", "\x76\x2f\x31\x01\x02"},
      {"JPEG 2000", std::string("\0\0\0\x0cjP  \r\n\x87\n", 12)},
      {"JPEG 2000", "\xff\x4f\xff\x51"},
      {"JPEG XL", "\xff\x0a\x00"},
      {"Radiance HDR", "#?RADIANCE\n"},
      {"DICOM", dicom},
      {"Photoshop", "8BPS"},
      {"GIF", "GIF89a"},
      {"raw camera", std::string("II*\0\x10\0\0\0CR\x02\0", 12)},
      {"raw camera", "FUJIFILMCCD-RAW 0201"},
      {"raw camera", std::string("\0\0\0\x18"
                                 "ftypcrx \0\0\0\0crx isom",
                                 24)},
      // A DNG: a TIFF with one entry, its version.
      {"raw camera", std::string("II*\0\x08\0\0\0\x01\0\x12\xc6\1\0\4\0\0\0\1\4\0\0\0\0\0\0", 26)},
      {"PBM, PPM or PAM", "P6 64 64 255\n"},
  };
  const TemporaryFolder folder;
  for (const Other& other : others)
    for (const char* name : {"a.jpg", "a.png", "a.tif", "a.heic", "a"}) {
      SCOPED_TRACE(other.format);
      write_bytes(other.bytes, folder / name);
      const auto read = [&] {
        cv::Mat grey;
        open_images(folder / name)->next(grey);
      };
      expect_refused(folder, std::string(name) + ": it holds " + other.format, read);
      EXPECT_THAT(refusal(folder / name), HasSubstr("convert the pictures to PNG or JPEG"));
      fs::remove(folder / name);
    }
}

TEST(HostilePicture, IsReadByItsContentWhateverItsExtension) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "written");
  for (const char* from : {"a.png", "a.tif", "a.bmp", "a.pgm", "a.jpg", "a.webp"}) {
    cv::imwrite((folder / "written" / from).string(), busy_picture(),
                {cv::IMWRITE_WEBP_QUALITY, 101});
    for (const char* to : {"b.png", "b.tif", "b.bmp", "b.pgm", "b.jpg", "b.webp", "b.HEIC"}) {
      fs::copy_file(folder / "written" / from, folder / to, fs::copy_options::overwrite_existing);
      const DecodedPicture picture = decode_picture(folder / to);
      EXPECT_EQ(picture.damage, "") << from << " as " << to;
      EXPECT_EQ(picture.grey.size(), busy_picture().size());
    }
  }
}

/// Every format and kind of compression that is written here.
std::vector<std::pair<std::string, std::vector<int>>> written_kinds() {
  return {{"a.png", {}},
          {"a.bmp", {}},
          {"a.pgm", {}},
          {"a.jpg", {}},
          {"progressive.jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
          {"restarts.jpg", {cv::IMWRITE_JPEG_RST_INTERVAL, 1}},
          {"lossy.webp", {cv::IMWRITE_WEBP_QUALITY, 90}},
          {"lossless.webp", {cv::IMWRITE_WEBP_QUALITY, 101}},
          {"plain.tif", {cv::IMWRITE_TIFF_COMPRESSION, 1}},
          {"lzw.tif", {cv::IMWRITE_TIFF_COMPRESSION, 5}},
          {"deflate.tif", {cv::IMWRITE_TIFF_COMPRESSION, 8}},
          {"packbits.tif", {cv::IMWRITE_TIFF_COMPRESSION, 32773}}};
}

TEST(HostilePicture, CutShortAnywhereIsDamagedOrWholeAndNothingIsPrinted) {
  const TemporaryFolder folder;
  testing::internal::CaptureStderr();
  for (const auto& [name, how] : written_kinds()) {
    const fs::path file = folder / name;
    cv::imwrite(file.string(), busy_picture(), how);
    const std::string bytes = file_bytes(file);
    const cv::Mat whole = decode_picture(file).grey;
    ASSERT_FALSE(whole.empty()) << name;
    constexpr size_t kCuts = 60;
    for (size_t cut = 1; cut < kCuts; ++cut) {
      // Most cuts lie evenly; the last ones take off a byte more each.
      const size_t even = cut * bytes.size() / (kCuts - 10);
      const size_t length = even < bytes.size() ? even : bytes.size() - (cut - (kCuts - 11));
      fs::remove(file);  // a new file is far quicker than a shortened one
      write_bytes(bytes.substr(0, length), file);
      try {
        const DecodedPicture picture = decode_picture(file);
        if (!picture.damage.empty()) continue;
        EXPECT_EQ(cv::norm(picture.grey, whole, cv::NORM_INF), 0)
            << name << " of " << length << " of " << bytes.size() << " bytes";
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(name));
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(HostilePicture, WithAFlippedBitInAPngIsDamaged) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.png";
  cv::imwrite(file.string(), busy_picture());
  const std::string bytes = file_bytes(file);
  for (size_t at = 8; at < bytes.size(); at += 37) {
    std::string flipped = bytes;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    fs::remove(file);
    write_bytes(flipped, file);
    const std::string said = refusal(file);
    EXPECT_THAT(said, testing::Not(testing::StrEq("damaged: "))) << at;
  }
}

}  // namespace
}  // namespace clothfit
