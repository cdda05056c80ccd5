// Checks the order and the frames that names of pictures give.

#include "vision/ingest/picture_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "data/input_error.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

NumberedPictures number(const std::vector<std::string>& names) {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : names) files.push_back("folder/" + name);
  return number_pictures(std::move(files));
}

std::vector<std::string> names_of(const NumberedPictures& pictures) {
  std::vector<std::string> names;
  for (const auto& file : pictures.files) names.push_back(file.filename().string());
  return names;
}

TEST(NaturalOrder, ComparesDigitsAsNumbers) {
  EXPECT_TRUE(natural_order("img2.jpg", "img10.jpg"));
  EXPECT_FALSE(natural_order("img10.jpg", "img2.jpg"));
  EXPECT_TRUE(natural_order("a9b2", "a10b1"));
  EXPECT_TRUE(natural_order("x007", "x8"));
  EXPECT_TRUE(natural_order("a99999999999999999999998", "a99999999999999999999999"));
  EXPECT_TRUE(natural_order("a", "b"));
  EXPECT_FALSE(natural_order("same1", "same1"));
}

TEST(NaturalOrder, IsAStrictWeakOrder) {
  std::mt19937 random(46);
  std::vector<std::string> names;
  for (int i = 0; i < 60; ++i) {
    std::string name;
    for (int c = 0; c < 4; ++c) name += "0012ab."[random() % 7];
    names.push_back(name);
  }
  for (const auto& a : names)
    for (const auto& b : names) {
      EXPECT_FALSE(natural_order(a, b) && natural_order(b, a)) << a << " " << b;
      EXPECT_TRUE(a == b || natural_order(a, b) || natural_order(b, a)) << a << " " << b;
      for (const auto& c : names)
        if (natural_order(a, b) && natural_order(b, c)) {
          EXPECT_TRUE(natural_order(a, c)) << a << " " << b << " " << c;
        }
    }
}

TEST(NumberPictures, TakesNumbersWithoutLeadingZerosInTheirOrder) {
  const NumberedPictures pictures = number({"img10.jpg", "img2.jpg", "img1.jpg"});
  EXPECT_THAT(names_of(pictures), ElementsAre("img1.jpg", "img2.jpg", "img10.jpg"));
  EXPECT_THAT(pictures.frames, ElementsAre(0, 1, 9));
}

TEST(NumberPictures, LeavesTheFrameOfAMissingNumberEmptyAndSaysSo) {
  const NumberedPictures pictures = number({"c1_0007.png", "c1_0008.png", "c1_0011.png"});
  EXPECT_THAT(pictures.frames, ElementsAre(0, 1, 4));
  ASSERT_EQ(pictures.findings.size(), 1U);
  EXPECT_EQ(pictures.findings[0].state, FindingState::warning);
  EXPECT_THAT(pictures.findings[0].found, HasSubstr("2 of 5 frames have no picture: 2 to 3"));
}

TEST(NumberPictures, CountsEveryTenthPictureAsOneFrameEach) {
  const NumberedPictures pictures = number({"0030.png", "0010.png", "0020.png", "0050.png"});
  EXPECT_THAT(pictures.frames, ElementsAre(0, 1, 2, 4));
}

TEST(NumberPictures, TakesTheNumberThatChangesAndNotThatOfTheCamera) {
  const NumberedPictures pictures = number({"cam2_1_left8.png", "cam2_3_left8.png"});
  EXPECT_THAT(pictures.frames, ElementsAre(0, 1)) << "steps of two";
  EXPECT_THAT(number({"GX01_1.png", "GX01_2.png", "GX01_4.png"}).frames, ElementsAre(0, 1, 3));
}

TEST(NumberPictures, CountsPicturesWhoseNamesTellNoFrameAndSaysSo) {
  for (const auto& names :
       {std::vector<std::string>{"a.png", "b.png", "c.png"},
        {"2024_1_001.png", "2024_2_002.png", "2024_3_003.png"},
        {"1403636579763555584.png", "1403636579813555456.png", "1403636579863555584.png"}}) {
    const NumberedPictures pictures = number(names);
    EXPECT_THAT(pictures.frames, ElementsAre(0, 1, 2));
    ASSERT_EQ(pictures.findings.size(), 1U) << names[0];
    EXPECT_THAT(pictures.findings[0].found, HasSubstr("counted in the order of their names"));
  }
  EXPECT_THAT(number({"only.png"}).findings, IsEmpty());
}

TEST(NumberPictures, RefusesTwoPicturesOfOneNumber) {
  EXPECT_THROW(number({"img1.png", "img01.png", "img2.png"}), InputError);
  EXPECT_THROW(number({"1.jpg", "1.png"}), InputError);
}

TEST(NumberPictures, CountsOnWhereACamerasCounterBeginsAgain) {
  const NumberedPictures pictures =
      number({"IMG_0002.jpg", "IMG_9998.jpg", "IMG_0001.jpg", "IMG_9999.jpg"});
  EXPECT_THAT(names_of(pictures),
              ElementsAre("IMG_9998.jpg", "IMG_9999.jpg", "IMG_0001.jpg", "IMG_0002.jpg"));
  EXPECT_THAT(pictures.frames, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(pictures.findings, IsEmpty());
}

}  // namespace
}  // namespace clothfit
