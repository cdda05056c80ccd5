// Checks measured points of the surface.
#include "data/clouds.h"

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

TEST(PointClouds, AreThoseOfTheFramesThatHaveAFile) {
  const TemporaryFolder folder;
  folder.write("000003.csv", "# m\nx,y,z\n1,2,3\n4,5,6.5\n");
  folder.write("12.csv.gz", "z,x,y\n-1,0.25,0\n");
  folder.write("README.md", "not a table");

  const PointClouds clouds = read_point_clouds(folder.path());

  ASSERT_EQ(clouds.size(), 2u);
  EXPECT_EQ(clouds.at(3).cols(), 2);
  EXPECT_EQ(clouds.at(3).col(1), Eigen::Vector3d(4, 5, 6.5));
  EXPECT_EQ(clouds.at(12).col(0), Eigen::Vector3d(0.25, 0, -1));
}

TEST(PointClouds, AreRefusedWhereTheyCannotBeRead) {
  const auto expect = [](const std::string& file, const std::string& text,
                         const std::string& message) {
    const TemporaryFolder folder;
    folder.write("7.csv", "x,y,z\n0,0,0\n");
    folder.write(file, text);
    expect_refused(folder, message, [&] { read_point_clouds(folder.path()); });
  };
  expect("all.csv", "x,y,z\n0,0,0\n", "all.csv: is named by no frame");
  expect("-1.csv", "x,y,z\n0,0,0\n", "-1.csv: is named by no frame");
  expect("8.csv", "x,y\n0,0\n", "8.csv:1: ");
  expect("8.csv", "x,y,z\n0,nan,0\n", "8.csv:2: ");
  expect("8.csv", "x,y,z\n", "8.csv: ");
}

TEST(PointClouds, AreRefusedWhereAFrameHasTwo) {
  const TemporaryFolder folder;
  folder.write("7.csv", "x,y,z\n0,0,0\n");
  folder.write("007.csv", "x,y,z\n0,0,0\n");
  EXPECT_THROW(read_point_clouds(folder.path()), InputError);
}

}  // namespace
}  // namespace clothfit
