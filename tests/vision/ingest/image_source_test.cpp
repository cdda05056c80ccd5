// Checks sources of pictures and refusals. The content of the pictures is tested elsewhere.

#include "vision/ingest/image_source.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/temporary_folder.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

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

/// What a name in a folder may lead to in place of a picture.
struct NoPicture {
  const char* said;
  std::function<void(const fs::path&)> make;
};

void make_socket(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.string().copy(address.sun_path, sizeof address.sun_path - 1);
  const int descriptor = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(descriptor);
}

const std::vector<NoPicture>& no_pictures() {
  static const std::vector<NoPicture> all = {
      {"is a link that leads nowhere",
       [](const fs::path& path) { fs::create_symlink("/nonexistent", path); }},
      {"cannot be looked at", [](const fs::path& path) { fs::create_symlink(path, path); }},
      {"is a named pipe", [](const fs::path& path) { ASSERT_EQ(mkfifo(path.c_str(), 0600), 0); }},
      {"is a socket", make_socket},
      {"is a device", [](const fs::path& path) { fs::create_symlink("/dev/zero", path); }},
      {"is a folder", [](const fs::path& path) { fs::create_directory(path); }}};
  return all;
}

TEST(ImageSource, RefusesWhatStandsInThePlaceOfAPicture) {
  for (const NoPicture& other : no_pictures()) {
    const TemporaryFolder folder;
    cv::imwrite((folder / "1.png").string(), plain_picture(60));
    other.make(folder / "0.png");
    expect_refused(folder, std::string("0.png: ") + other.said,
                   [&] { open_images(folder.path()); });
    if (std::string(other.said) != "is a folder") {
      EXPECT_THROW(open_images(folder / "0.png"), InputError) << other.said;
    }
  }
}

/// Gives up the rights of root while it lives: root reads what nobody else may.
class Nobody {
 public:
  Nobody() : root_(geteuid() == 0) {
    constexpr uid_t kNobody = 65534;
    EXPECT_EQ(root_ ? seteuid(kNobody) : 0, 0);
  }
  ~Nobody() { EXPECT_EQ(root_ ? seteuid(0) : 0, 0); }
  Nobody(const Nobody&) = delete;
  Nobody& operator=(const Nobody&) = delete;

 private:
  bool root_;
};

TEST(ImageSource, SaysWhatMayNotBeRead) {
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms(0755));
  fs::create_directories(folder / "closed" / "inner");
  fs::create_directory(folder / "open");
  for (const char* name : {"open/0.png", "open/1.png"})
    cv::imwrite((folder / name).string(), plain_picture(60));
  fs::permissions(folder / "open/1.png", fs::perms::none);
  fs::permissions(folder / "closed", fs::perms::none);
  {
    const Nobody nobody;
    expect_refused(folder, "closed: the folder cannot be listed: Permission denied",
                   [&] { open_images(folder / "closed"); });
    expect_refused(folder, "closed/inner: cannot be looked at: Permission denied",
                   [&] { open_images(folder / "closed" / "inner"); });
    expect_refused(folder, "open/1.png: cannot be opened: Permission denied",
                   [&] { levels(*open_images(folder / "open")); });
  }
  fs::permissions(folder / "closed", fs::perms::owner_all);
}

TEST(ImageSource, RefusesAForeignPictureAmongOthersInsteadOfPassingItOver) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.jpg").string(), plain_picture(60));
  cv::imwrite((folder / "2.jpg").string(), plain_picture(60));
  folder.write("1.HEIC", std::string("\0\0\0\x18"
                                     "ftypheic\0\0\0\0mif1heic",
                                     24));
  expect_refused(folder, "1.HEIC: it holds HEIC data",
                 [&] { levels(*open_images(folder.path())); });
}

TEST(ImageSource, PassesOverTheRawPictureBesideEachJpeg) {
  const TemporaryFolder folder;
  for (const std::string name : {"0", "1"}) {
    cv::imwrite((folder / (name + ".JPG")).string(), plain_picture(60));
    folder.write(name + ".NEF", "a raw picture");
  }
  EXPECT_EQ(levels(*open_images(folder.path())).size(), 2U);
}

TEST(ImageSource, ReadsPicturesWhoseNamesSayNothing) {
  const TemporaryFolder folder;
  cv::imwrite((folder / "0.png").string(), plain_picture(60));
  for (const char* name : {"frame_000", "frame_001", "frame_002"})
    fs::copy_file(folder / "0.png", folder / name);
  fs::remove(folder / "0.png");
  folder.write("BMs of the day.txt", "BMs: none. P5 as well");
  EXPECT_EQ(open_images(folder.path())->count(), 3);
}

TEST(ImageSource, TakesAVideoForOneUnderThePicturesName) {
  const TemporaryFolder folder;
  folder.write("film.jpg", std::string("\0\0\0\x10"
                                       "ftypisom",
                                       12));
  expect_refused(folder, "film.jpg: no picture can be read",
                 [&] { open_images(folder / "film.jpg"); });
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
