// Checks the tables of a recording: markers, tracks, reference points, paths of held points and
// bodies. Not checked here: times.csv and how tables hang together (recording_test.cpp), the tables
// of the bundled recordings (bundled_recordings_test.cpp), damaged bytes (corruption_test.cpp).

#include <cmath>
#include <fstream>
#include <iterator>

#include "data/body_path.h"
#include "data/markers.h"
#include "data/recording.h"
#include "data/tracks.h"
#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

MarkerSet two_markers() {
  MarkerSet set;
  set.markers = {{.name = "a"}, {.name = "b", .s_m = 0.1}};
  set.index = {{"a", 0}, {"b", 1}};
  return set;
}

std::string file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

TEST(Tracks3d, AreFoundByTheNamesOfTheirColumnsAndSorted) {
  const TemporaryFolder folder;
  const auto file = folder.write("tracks3d.csv",
                                 "z,marker,sigma,x,frame,y\n"
                                 "3.5,b,0.001,-1e-3,1,+2\n"
                                 "0,b,0.001,0,0,0\n"
                                 "6,a,,4,1,5\n");

  const Tracks3d tracks = read_tracks3d(file, two_markers());

  ASSERT_EQ(tracks.size(), 3u);
  EXPECT_EQ(tracks[0].frame, 0);
  EXPECT_EQ(tracks[1].marker, 0);
  EXPECT_EQ(tracks[1].position_m, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(tracks[1].sigma_m, 0);
  EXPECT_EQ(tracks[2].marker, 1);
  EXPECT_EQ(tracks[2].position_m, Eigen::Vector3d(-1e-3, 2, 3.5));
  EXPECT_EQ(tracks[2].sigma_m, 0.001);
}

TEST(Tracks3d, ReadBackToTheLastBit) {
  const TemporaryFolder folder;
  Tracks3d tracks;
  tracks.push_back({.frame = 0, .marker = 0, .position_m = {0.1, 1.0 / 3, -5e-324}});
  tracks.push_back({.frame = 0, .marker = 1, .position_m = {1e6, -0.0, 4}, .sigma_m = 0.1 + 0.2});
  for (const std::string name : {"plain.csv", "packed.csv.gz"}) {
    SCOPED_TRACE(name);

    write_tracks3d(tracks, two_markers(), folder / name);
    const Tracks3d again = read_tracks3d(folder / name, two_markers());

    ASSERT_EQ(again.size(), tracks.size());
    for (size_t i = 0; i < tracks.size(); ++i) {
      EXPECT_EQ(again[i].frame, tracks[i].frame);
      EXPECT_EQ(again[i].marker, tracks[i].marker);
      EXPECT_EQ(again[i].position_m, tracks[i].position_m);
      EXPECT_EQ(again[i].sigma_m, tracks[i].sigma_m);
    }
    EXPECT_TRUE(std::signbit(again[1].position_m.y()));
  }
}

TEST(Tracks3d, AreTheSameBytesWhenWrittenTwice) {
  const TemporaryFolder folder;
  const Tracks3d tracks = {{.frame = 0, .marker = 0, .position_m = {1, 2, 3}}};

  write_tracks3d(tracks, two_markers(), folder / "one.csv.gz");
  write_tracks3d(tracks, two_markers(), folder / "two.csv.gz");

  EXPECT_EQ(file_bytes(folder / "one.csv.gz"), file_bytes(folder / "two.csv.gz"));
}

TEST(Tracks2d, KeepTheReasonWhyARowWasRejected) {
  const TemporaryFolder folder;
  const Tracks2d tracks = {
      {.frame = 0, .marker = 0, .position_px = {10.5, 20}, .sigma_px = 0.3},
      {.frame = 0, .marker = 1, .position_px = {11, 21}, .rejected = "blurred"},
  };

  write_tracks2d(tracks, two_markers(), folder / "front.csv");
  const Tracks2d again = read_tracks2d(folder / "front.csv", two_markers());

  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].rejected, "");
  EXPECT_EQ(again[0].sigma_px, 0.3);
  EXPECT_EQ(again[1].rejected, "blurred");
  EXPECT_EQ(again[1].position_px, Eigen::Vector2d(11, 21));
  EXPECT_EQ(again[1].sigma_px, 0);
}

TEST(Tracks2d, NeedNeitherSigmaNorStatus) {
  const TemporaryFolder folder;

  const Tracks2d plain =
      read_tracks2d(folder.write("a.csv", "frame,marker,u,v\n0,a,1,2\n"), two_markers());
  const Tracks2d with_status = read_tracks2d(
      folder.write("b.csv", "frame,marker,u,v,status\n0,a,1,2,ok\n1,a,1,2,rejected:far\n"),
      two_markers());
  const Tracks2d none = read_tracks2d(folder.write("c.csv", "frame,marker,u,v\n"), two_markers());

  EXPECT_EQ(plain.size(), 1u);
  EXPECT_EQ(with_status[1].rejected, "far");
  EXPECT_TRUE(none.empty());
}

TEST(Tables, AcceptCommentsEmptyLinesWindowsLineEndsAndAByteOrderMark) {
  const TemporaryFolder folder;
  const auto file = folder.write("tracks3d.csv",
                                 "\xef\xbb\xbf# made by hand\r\n"
                                 "frame, marker,x ,y,z\r\n"
                                 "\r\n"
                                 "  # a comma, here\r\n"
                                 " 0,\ta, 1,2,3 ");

  const Tracks3d tracks = read_tracks3d(file, two_markers());

  ASSERT_EQ(tracks.size(), 1u);
  EXPECT_EQ(tracks[0].position_m, Eigen::Vector3d(1, 2, 3));
}

TEST(Tables, RefuseWhatTheFormatDoesNotAllowWithFileAndLine) {
  struct Case {
    std::string text;
    std::string message;
  };
  const std::string header = "# tracks\nframe,marker,u,v,sigma,status\n";
  const std::vector<Case> cases = {
      {"", "t.csv:1: the table is empty"},
      {"# only a comment\n", "t.csv:1: the table is empty"},
      {"frame,marker,u\n", "t.csv:1: column `v` is missing"},
      {"frame,marker,u,v,w\n", "t.csv:1: unknown column `w`"},
      {"frame,marker,u,v,sigam\n", "t.csv:1: unknown column `sigam`; did you mean `sigma`?"},
      {"\nframe,u,marker,u,v\n", "t.csv:2: column `u` appears twice"},
      {header + "0,a,1,2,0.3\n", "t.csv:3: 5 fields; 6 fields"},
      {header + "0,a,1,2,0.3,ok\n0,b,1,2,0.3,ok,\n", "t.csv:4: 7 fields; 6 fields"},
      {header + "0\n", "t.csv:3: 1 field; 6 fields"},
      {header + "0,a,one,2,0.3,ok\n", "t.csv:3: u = `one`; a finite number"},
      {header + "0,a,1,,0.3,ok\n", "t.csv:3: v = ``; a finite number"},
      {header + "0,a,nan,2,0.3,ok\n", "t.csv:3: u = `nan`; a finite number"},
      {header + "0,a,1,-inf,0.3,ok\n", "t.csv:3: v = `-inf`; a finite number"},
      {header + "0,a,1e999,2,0.3,ok\n", "t.csv:3: u = `1e999`; a finite number"},
      {header + "0,a,1 2,2,0.3,ok\n", "t.csv:3: u = `1 2`; a finite number"},
      {header + "0,a,0x1p3,2,0.3,ok\n", "t.csv:3: u = `0x1p3`; a finite number"},
      {header + "-1,a,1,2,0.3,ok\n", "t.csv:3: frame = `-1`; a whole number, 0 or more"},
      {header + "1.5,a,1,2,0.3,ok\n", "t.csv:3: frame = `1.5`; a whole number, 0 or more"},
      {header + "0,a,1,2,0.3,ok\n10001,a,1,2,0.3,ok\n",
       "t.csv:4: frame 10001 comes next after frame 0; 10000 frames without any row at most"},
      {header + "99999999999,a,1,2,0.3,ok\n", "t.csv:3: frame = `99999999999`; a whole number"},
      {header + "0,c,1,2,0.3,ok\n", "t.csv:3: unknown marker `c`; a marker that markers.csv"},
      {header + "0,,1,2,0.3,ok\n", "t.csv:3: marker = ``; a name"},
      {header + "0,a,1,2,-0.3,ok\n", "t.csv:3: sigma = -0.3; one standard deviation"},
      {header + "0,a,1,2,0,ok\n", "t.csv:3: sigma = 0; one standard deviation"},
      {header + "0,a,1,2,1e300,ok\n", "t.csv:3: sigma = 1e+300; one standard deviation"},
      {header + "0,a,1,2,0.3,good\n", "t.csv:3: status = `good`; `ok` or `rejected:REASON`"},
      {header + "0,a,1,2,0.3,rejected:\n", "t.csv:3: status = `rejected:`; `ok` or"},
      {header + "0,a,1,2,,\n0,b,1,2,,\n\n0,a,3,4,,\n",
       "t.csv:6: marker `a` in frame 0 stands on line 3 already; one row per frame and marker"},
  };
  const TemporaryFolder folder;
  for (const Case& test : cases) {
    const auto file = folder.write("t.csv", test.text);
    expect_refused(folder, test.message, [&] { read_tracks2d(file, two_markers()); });
  }
}

TEST(Tables, RefuseAFileThatCannotBeRead) {
  const TemporaryFolder folder;
  const MarkerSet markers = two_markers();

  expect_refused(folder, "none.csv: there is no such file",
                 [&] { read_tracks3d(folder / "none.csv", markers); });
  std::filesystem::create_directory(folder / "a_folder.csv");
  expect_refused(folder, "a_folder.csv: is a folder",
                 [&] { read_tracks3d(folder / "a_folder.csv", markers); });
}

TEST(Tables, RefuseCompressedDataCutShortAtEveryPlace) {
  const TemporaryFolder folder;
  Tracks3d tracks;
  for (int frame = 0; frame < 30; ++frame)
    tracks.push_back({.frame = frame, .marker = 0, .position_m = {frame * 0.1, frame / 7.0, 1}});
  write_tracks3d(tracks, two_markers(), folder / "whole.csv.gz");
  const std::string whole = file_bytes(folder / "whole.csv.gz");

  for (size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE(size);
    write_bytes(folder / "cut.csv.gz", whole.substr(0, size));
    EXPECT_THROW(read_tracks3d(folder / "cut.csv.gz", two_markers()), InputError);
  }
  write_bytes(folder / "cut.csv.gz", whole.substr(0, whole.size() - 8));
  expect_refused(folder, "cut.csv.gz:32: the compressed data end too early; a whole gzip file",
                 [&] { read_tracks3d(folder / "cut.csv.gz", two_markers()); });
}

TEST(Tables, RefuseDamagedCompressedData) {
  const TemporaryFolder folder;
  write_tracks3d({{.frame = 0, .marker = 0, .position_m = {1, 2, 3}}}, two_markers(),
                 folder / "t.csv.gz");
  std::string bytes = file_bytes(folder / "t.csv.gz");
  bytes[bytes.size() - 6] = static_cast<char>(~bytes[bytes.size() - 6]);  // in the checksum

  write_bytes(folder / "t.csv.gz", bytes);

  expect_refused(folder, "t.csv.gz:1: the compressed data are damaged",
                 [&] { read_tracks3d(folder / "t.csv.gz", two_markers()); });
}

TEST(Tables, RefuseANameThatHidesWhetherTheContentIsCompressed) {
  const TemporaryFolder folder;
  write_bytes(folder / "plain.csv.gz", "frame,marker,x,y,z\n");
  folder.write("packed.csv.gz", "frame,marker,x,y,z\n");
  std::filesystem::rename(folder / "packed.csv.gz", folder / "packed.csv");

  expect_refused(folder, "plain.csv.gz: the content is not gzip-compressed",
                 [&] { read_tracks3d(folder / "plain.csv.gz", two_markers()); });
  expect_refused(folder, "packed.csv: the content is gzip-compressed",
                 [&] { read_tracks3d(folder / "packed.csv", two_markers()); });
}

TEST(Markers, ReadBackAsWrittenWithAndWithoutTags) {
  const TemporaryFolder folder;
  const std::vector<Marker> markers = {
      {.name = "t00_0", .s_m = 0.1 + 0.2, .t_m = 0, .tag = 0, .corner = 3},
      {.name = "ü 1", .s_m = 0, .t_m = 0.4},
  };

  write_markers(markers, folder / "tags.csv");
  const std::vector<Marker> again = read_markers(folder / "tags.csv", 0.4, 0.4);
  write_markers({markers[1]}, folder / "plain.csv");
  const std::vector<Marker> plain = read_markers(folder / "plain.csv", 0.4, 0.4);

  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].s_m, markers[0].s_m);
  EXPECT_EQ(again[0].tag, 0);
  EXPECT_EQ(again[0].corner, 3);
  EXPECT_EQ(again[1].name, "ü 1");
  EXPECT_EQ(again[1].tag, std::nullopt);
  ASSERT_EQ(plain.size(), 1u);
  EXPECT_EQ(plain[0].t_m, 0.4);
}

TEST(Markers, MayLieOnTheEdgeButNotBeyond) {
  const TemporaryFolder folder;
  const auto edge = folder.write("edge.csv", "marker,s,t\na,0.4000005,-0.0000005\n");
  const auto beyond = folder.write("beyond.csv", "marker,s,t\na,0.400002,0\n");

  EXPECT_EQ(read_markers(edge, 0.4, 0.3).size(), 1u);
  expect_refused(folder,
                 "beyond.csv:2: marker `a` at (s, t) = (0.400002, 0) lies outside the cloth",
                 [&] { read_markers(beyond, 0.4, 0.3); });
}

TEST(Markers, RefuseDoubledNamesAndHalfGivenTags) {
  struct Case {
    std::string rows;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"", "m.csv: the table holds no markers"},
      {"a,0,0,,\nb,0,0,,\na,0.1,0,,\n", "m.csv:4: marker `a` stands on line 2 already"},
      {"a,0,0,7,1\nb,0,0,7,1\n", "m.csv:3: corner 1 of tag 7 stands on line 2 already"},
      {"a,0,0,7,\n", "m.csv:2: `a` has a tag but no corner"},
      {"a,0,0,,1\n", "m.csv:2: `a` has a corner but no tag"},
      {"a,0,0,7,4\n", "m.csv:2: corner = 4; 0 bottom left"},
      {"a,0,0,-7,1\n", "m.csv:2: tag = `-7`; a whole number, 0 or more"},
      {"a\tb,0,0,,\n", "m.csv:2: marker = `a?b`; a name"},
  };
  const TemporaryFolder folder;
  for (const Case& test : cases) {
    const auto file = folder.write("m.csv", "marker,s,t,tag,corner\n" + test.rows);
    expect_refused(folder, test.message, [&] { read_markers(file, 0.4, 0.4); });
  }
}

TEST(ReferencePoints, ReadBackAsWritten) {
  const TemporaryFolder folder;
  const std::vector<ReferencePoint> points = {
      {.name = "r0", .x_m = -0.152, .y_m = 1e-17, .z_m = 3, .tag = 100, .corner = 0},
      {.name = "nail", .x_m = 1, .y_m = 2, .z_m = 3},
  };

  write_reference_points(points, folder / "reference.csv");
  const std::vector<ReferencePoint> again = read_reference_points(folder / "reference.csv");

  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].name, "r0");
  EXPECT_EQ(again[0].y_m, 1e-17);
  EXPECT_EQ(again[0].tag, 100);
  EXPECT_EQ(again[1].corner, std::nullopt);
  expect_refused(folder, "twice.csv:3: point `r` stands on line 2 already", [&] {
    read_reference_points(folder.write("twice.csv", "point,x,y,z\nr,1,2,3\nr,1,2,3\n"));
  });
}

TEST(HeldPath, HasTimesThatRise) {
  const TemporaryFolder folder;
  const auto good = folder.write("good.csv", "time,x,y,z\n-0.5,1,2,3\n0,4,5,6\n");

  const HeldPath path = read_held_path(good);

  EXPECT_EQ(path.time_s, (std::vector<double>{-0.5, 0}));
  EXPECT_EQ(path.position_m[1], Eigen::Vector3d(4, 5, 6));
  expect_refused(folder, "still.csv:3: time = `1` after `1`; times that rise", [&] {
    read_held_path(folder.write("still.csv", "time,x,y,z\n1.0,0,0,0\n1,0,0,0\n"));
  });
  expect_refused(folder, "empty.csv: the table holds no positions",
                 [&] { read_held_path(folder.write("empty.csv", "time,x,y,z\n")); });
}

TEST(BodyPath, HasUnitQuaternions) {
  const TemporaryFolder folder;
  const std::string header = "time,x,y,z,qx,qy,qz,qw\n";

  const BodyPath path =
      read_body_path(folder.write("good.csv", header + "0,1,2,3,0,0,0,1.0005\n1,1,2,3,0,1,0,0\n"));

  EXPECT_EQ(path.rotation[0].w(), 1);  // normalised
  EXPECT_EQ(path.rotation[1].y(), 1);
  EXPECT_EQ(path.position_m[1], Eigen::Vector3d(1, 2, 3));
  expect_refused(folder, "bad.csv:3: quaternion (1.002, 0, 0, 0); a rotation of norm 1", [&] {
    read_body_path(folder.write("bad.csv", header + "0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1.002\n"));
  });
}

}  // namespace
}  // namespace clothfit
