// Damages picture and video files at random places. Each is read, or refused: nothing else happens.

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/input_error.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/ingest/written_video.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

cv::Mat textured(int seed) {
  cv::Mat grey(32, 48, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(grey, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(grey, grey, {}, 1);
  return grey;
}

/// Overwrites, cuts, repeats or removes bytes.
std::string damaged(std::string bytes, std::mt19937& random) {
  const int changes = 1 + static_cast<int>(random() % 6);
  for (int i = 0; i < changes && !bytes.empty(); ++i) {
    const size_t at = random() % bytes.size(), length = 1 + random() % 12;
    switch (random() % 4) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes.erase(at, length);
        break;
      case 2:
        bytes.insert(at, bytes.substr(at, length));
        break;
      default:
        if (random() % 8 == 0) bytes.resize(at);
    }
  }
  return bytes;
}

/// Reads all pictures; returns how many were whole.
int whole_pictures(const fs::path& images) {
  int whole = 0;
  try {
    const auto source = open_images(images);
    cv::Mat grey;
    while (source->next(grey)) {
      if (!source->damage().empty()) continue;
      EXPECT_EQ(grey.type(), CV_8UC1);
      EXPECT_FALSE(grey.empty());
      ++whole;
    }
    source->findings();
  } catch (const InputError&) {
    return -1;
  }
  return whole;
}

class FuzzedFile : public testing::TestWithParam<const char*> {};

TEST_P(FuzzedFile, IsReadOrRefused) {
  constexpr int kTrials = 150;
  const TemporaryFolder folder;
  const std::string name = GetParam();
  const bool video = name.ends_with("mp4") || name.ends_with("mkv");
  fs::create_directory(folder / "in");
  const fs::path file = folder / "in" / name;
  if (video) {
    WrittenVideo film;
    for (int n = 0; n < 10; ++n) {
      film.pictures.push_back(textured(n));
      film.times_s.push_back(0.03 * n);
    }
    write_video(film, file);
  } else {
    cv::imwrite(file.string(), textured(0));
  }
  const std::string whole = file_bytes(file);
  std::mt19937 random(46);
  int read = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    write_bytes(damaged(whole, random), file);
    if (whole_pictures(video ? file : folder / "in") > 0) ++read;
  }
  EXPECT_GT(read, 0) << "harmless damage is read over";
}

INSTANTIATE_TEST_SUITE_P(Ingest, FuzzedFile,
                         testing::Values("a.jpg", "a.png", "a.tif", "a.bmp", "a.webp", "a.mp4",
                                         "a.mkv"));

}  // namespace
}  // namespace clothfit
