// Checks that no file can make a reader wait, fill the memory, crash, or lead it elsewhere: pipes
// and devices, bombs, absurd numbers, links, names that terminals and spreadsheets obey. Not
// checked here: damaged bytes (corruption_test.cpp), pictures (tests/vision/ingest), the program
// as a whole (tools/attack_cases).

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "data/camera_parameters.h"
#include "data/clouds.h"
#include "data/csv_reader.h"
#include "data/file_bytes.h"
#include "data/fit_result.h"
#include "data/obj_mesh.h"
#include "data/read_json.h"
#include "data/recording.h"
#include "data/replace_text.h"
#include "data/text_writer.h"
#include "data/tracks.h"
#include "tests/data/expect_refused.h"
#include "tests/data/file_bytes.h"
#include "tests/data/full_recording.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

MarkerSet one_marker(const std::string& name) {
  MarkerSet set;
  set.markers = {{.name = name}};
  set.index = {{name, 0}};
  return set;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(SpecialFiles, AreRefusedWithoutWaiting) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe.csv").c_str(), 0600), 0);
  const int socket_descriptor = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  (folder / "socket").string().copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(socket_descriptor, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  fs::create_symlink("/dev/zero", folder / "zero.csv");

  expect_refused(folder, "pipe.csv: is a named pipe; a file",
                 [&] { read_text(folder / "pipe.csv"); });
  expect_refused(folder, "socket: is a socket", [&] { read_text(folder / "socket"); });
  expect_refused(folder, "zero.csv: is a device", [&] { read_text(folder / "zero.csv"); });
  expect_refused(folder, "/dev/zero: is a device", [&] { read_file_bytes("/dev/zero", 10); });
  expect_refused(folder, folder.path().string() + ": is a folder",
                 [&] { read_text(folder.path()); });
  expect_refused(folder, "none/x: there is no such file", [&] { read_text(folder / "none/x"); });
  close(socket_descriptor);
}

TEST(SpecialFiles, ThatFailWhileTheyAreReadAreRefusedWithTheReason) {
  const TemporaryFolder folder;
  expect_refused(folder, "/proc/self/mem: cannot be read: Input/output error",
                 [&] { read_text("/proc/self/mem"); });
}

TEST(FileBytes, AreThoseOfTheFileUpToTheLimit) {
  const TemporaryFolder folder;
  for (const size_t size : {size_t{0}, size_t{1}, size_t{65'536}, size_t{200'001}}) {
    const std::string bytes(size, 'x');
    write_bytes(bytes, folder / "file");
    EXPECT_EQ(read_file_bytes(folder / "file", size), bytes);
    if (size > 0)
      expect_refused(folder, "file: holds more than",
                     [&] { read_file_bytes(folder / "file", size - 1); });
  }
  EXPECT_GT(read_file_bytes("/proc/self/status", 1'000'000).size(), 100u);  // states a size of 0
}

TEST(CompressedFiles, ThatUnpackBeyondMeasurementsAreRefused) {
  const TemporaryFolder folder;
  {
    TextWriter bomb(folder / "bomb.csv.gz");
    bomb.append("frame,marker,x,y,z\n");
    const std::string row_ends(1 << 20, '\n');
    for (int megabyte = 0; megabyte < 64; ++megabyte) bomb.append(row_ends);
    bomb.close();
  }
  expect_refused(folder,
                 "bomb.csv.gz:", [&] { read_tracks3d(folder / "bomb.csv.gz", one_marker("a")); });
  expect_refused(folder, "bomb.csv.gz:", [&] { read_text(folder / "bomb.csv.gz"); });
}

TEST(CompressedFiles, MayHaveSeveralPiecesButNothingElseBehindThem) {
  const TemporaryFolder folder;
  folder.write("a.gz", "one\n");
  const std::string piece = file_bytes(folder / "a.gz");
  write_bytes(piece + piece, folder / "b.gz");
  EXPECT_EQ(read_text(folder / "b.gz"), "one\none\n");
  write_bytes("", folder / "empty.gz");
  EXPECT_EQ(read_text(folder / "empty.gz"), "");

  write_bytes(piece + "more", folder / "c.gz");
  expect_refused(folder, "c.gz:2: other bytes follow the compressed data",
                 [&] { read_text(folder / "c.gz"); });
}

TEST(TextLines, AreTheSameWhateverEndsThemAndWhereverBlocksEnd) {
  const TemporaryFolder folder;
  for (const char* end : {"\n", "\r\n", "\r"}) {
    for (const size_t first :
         {size_t{262'140}, size_t{262'141}, size_t{262'142}, size_t{262'143}}) {
      // Many lines, and one that ends about where the reader's buffer does.
      std::string text;
      std::vector<std::string> expected;
      for (size_t left = first; left > 0;) {
        const size_t length = std::min<size_t>(left, 4'000);
        expected.emplace_back(length, 'a');
        text += expected.back() + end;
        left -= length;
      }
      expected.emplace_back("last");
      write_bytes("\xef\xbb\xbf" + text + "last", folder / "t.csv");

      TextLines lines(folder / "t.csv");
      for (const std::string& line : expected) {
        ASSERT_TRUE(lines.next());
        ASSERT_EQ(lines.text(), line) << lines.line();
      }
      EXPECT_FALSE(lines.next());
    }
  }
}

TEST(TextLines, RefuseWhatIsNoText) {
  const TemporaryFolder folder;
  const auto read_all = [&] {
    TextLines lines(folder / "t.csv");
    while (lines.next()) continue;
  };
  write_bytes(std::string("a\nb\0c\n", 6), folder / "t.csv");
  expect_refused(folder, "t.csv:2: a NUL byte", read_all);
  expect_refused(folder, "t.csv:2: a NUL byte", [&] { read_text(folder / "t.csv"); });
  write_bytes("a\n" + std::string(kMostLineBytes + 1, 'x'), folder / "t.csv");
  expect_refused(folder, "t.csv:2: a line of more than 65536 bytes", read_all);
  write_bytes(std::string(kMostLineBytes, 'x') + "\n", folder / "t.csv");
  EXPECT_NO_THROW(read_all());
}

TEST(Documents, BeyondWhatTheirFormatsMayHoldAreRefused) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  folder.write("recording.yaml", kFullRecording + std::string(kMostYamlBytes, '#'));
  expect_refused(folder, "recording.yaml: holds more than 1000000 bytes",
                 [&] { read_recording(folder.path()); });

  folder.write("fit.json", std::string(kMostJsonBytes + 1, ' '));
  expect_refused(folder, "fit.json: holds more than 20000000 bytes",
                 [&] { read_fit_result(folder / "fit.json"); });
}

TEST(Documents, WithAKeyTwiceAreRefused) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_json(folder.write("x.json", text), "expected", "remedy");
  };
  EXPECT_EQ(read(R"({"a": {"b": 1}, "b": {"b": 2}})").size(), 2u);
  expect_refused(folder, "x.json: key `b` comes twice",
                 [&] { read(R"({"a": 1, "b": 2, "b": 3})"); });
  expect_refused(folder, "x.json: key `b` comes twice",
                 [&] { read(R"([{"c": [{"b": 1, "b": 3}]}])"); });
  expect_refused(folder, "x.json:2: not JSON", [&] { read("{\n\"a\": }"); });
  expect_refused(folder, "x.json: holds a number too large", [&] { read(R"({"a": 1e999})"); });
}

TEST(Documents, OfVeryManyKeysAreReadInTimeThatGrowsWithThem) {
  const TemporaryFolder folder;
  // Quadratic time would be minutes.
  std::string json = "{\"format\": \"x\"", yaml = kFullRecording + "declared2:\n";
  for (int key = 0; key < 200'000; ++key) json += ",\"key" + std::to_string(key) + "\": 0";
  for (int key = 0; key < 60'000; ++key) yaml += "  key" + std::to_string(key) + ": 0\n";

  EXPECT_EQ(read_json(folder.write("x.json", json + "}"), "", "").size(), 200'001u);

  write_full_recording(folder);
  folder.write("recording.yaml", yaml);
  expect_refused(folder, "recording.yaml:36: unknown key `declared2`",
                 [&] { read_recording(folder.path()); });
}

TEST(FitJson, OfAnImpossibleMeshOrNumberIsRefused) {
  const TemporaryFolder folder;
  FitResult result;
  result.recording = "swing";
  result.mesh_columns = 9;
  result.mesh_rows = 7;
  result.substeps = 4;
  result.errors.resize(1);
  result.parameters.push_back({.name = "shear", .unit = "N/m", .value = 12, .sigma = 1});
  write_fit_result(result, folder / "fit.json");
  const std::string whole = read_text(folder / "fit.json");
  const auto read = [&](const std::string& what, const std::string& by) {
    read_fit_result(folder.write("fit.json", replaced(whole, what, by)));
  };
  EXPECT_EQ(read_fit_result(folder / "fit.json").mesh_columns, 9);

  for (const char* columns : {"0", "1", "2147483647", "100000"})
    expect_refused(folder, std::string("fit.json: `/model/mesh` is ") + columns + " x 7",
                   [&] { read("\"columns\": 9", std::string("\"columns\": ") + columns); });
  expect_refused(folder, "fit.json: `/model/substeps` is 2147483647",
                 [&] { read("\"substeps\": 4", "\"substeps\": 2147483647"); });
  expect_refused(folder, "fit.json: `/parameters/0/value` is 1e+200",
                 [&] { read("\"value\": 12.0", "\"value\": 1e200"); });
  expect_refused(folder, "fit.json: `/parameters/0/sigma` is -1",
                 [&] { read("\"sigma\": 1.0", "\"sigma\": -1.0"); });
}

TEST(FitJson, WithNumbersThatOverflowForAClothOfAnotherDensityIsRefused) {
  const TemporaryFolder folder;
  FitResult result;
  result.recording = "swing";
  result.mesh_columns = result.mesh_rows = 9;
  result.errors.resize(1);
  result.parameters.push_back({.name = "areal_density", .unit = "kg/m2", .value = 0.1});
  result.parameters.push_back({.name = "shear",
                               .unit = std::string("N/m") + kPerArealDensity,
                               .value = 12,
                               .interval_90 = Interval{.lower = 11, .upper = 13.5}});
  write_fit_result(result, folder / "fit.json");
  const std::string whole = read_text(folder / "fit.json");
  const auto read = [&](const std::string& what, const std::string& by) {
    return read_fit_result(folder.write("fit.json", replaced(whole, what, by)));
  };
  EXPECT_NO_THROW(
      write_fit_result(at_density(read("0.1,", "1e-12,"), std::nullopt), folder / "x.json"));
  for (const char* number : {"0", "-1", "1e-320", "1e13"})
    expect_refused(folder, "fit.json: `/parameters/0/value` is ",
                   [&] { read("0.1,", std::string(number) + ","); });
  expect_refused(folder, "fit.json: `/parameters/1/interval_90/1` is 1e+308",
                 [&] { read("13.5", "1e308"); });
}

TEST(Camera, OfNumbersBeyondAnyCameraIsRefused) {
  const TemporaryFolder folder;
  CameraParameters camera;
  camera.name = "front";
  camera.model = CameraModel::brown_conrady;
  camera.image_width = 961;
  camera.image_height = 722;
  camera.focal_px = {1001, 1002};
  camera.centre_px = {483, 364};
  camera.distortion = {-0.5, 0.25, 0, 0};
  camera.camera_from_world = CameraPose{
      .translation_m = {17.5, 18.5, 19.5},
      .covariance = Eigen::Matrix<double, 6, 6>(Eigen::Matrix<double, 6, 6>::Identity() * 0.125)};
  camera.readout_time_s = 0.0625;
  write_camera(camera, folder / "camera.yaml");
  const std::string whole = read_text(folder / "camera.yaml");
  ASSERT_NO_THROW(read_camera(folder / "camera.yaml"));
  for (const char* number : {"961", "722", "1001", "1002", "483", "364", "-0.5", "0.25", "17.5",
                             "18.5", "19.5", "0.125", "0.0625"})
    for (const char* absurd : {"1e160", "-1e160", "1e308", "2147483647", "-2147483648e6"}) {
      SCOPED_TRACE(std::string(number) + " is " + absurd);
      // A focal length of 2e9 px is refused as well.
      const bool possible = std::string(number) == "0.125" && absurd == std::string("2147483647");
      const auto read = [&] {
        read_camera(folder.write("camera.yaml", replaced(whole, number, absurd)));
      };
      if (!possible) expect_refused(folder, "camera.yaml:", read);
    }
  for (const char* focal : {"1e-320", "1e-160", "0"})
    expect_refused(folder, "camera.yaml:5: focal", [&] {
      read_camera(folder.write("camera.yaml", replaced(whole, "1001", focal)));
    });
}

TEST(Coordinates, BeyondAnyClothAreRefused) {
  const TemporaryFolder folder;
  const MarkerSet markers = one_marker("a");
  for (const char* number : {"1e160", "-1e7", "1e300"}) {
    expect_refused(folder, std::string("t.csv:2: y = `") + number, [&] {
      read_tracks3d(
          folder.write("t.csv", std::string("frame,marker,x,y,z\n0,a,1,") + number + ",3\n"),
          markers);
    });
    expect_refused(folder, std::string("t.csv:2: v = `") + number, [&] {
      read_tracks2d(folder.write("t.csv", std::string("frame,marker,u,v\n0,a,1,") + number + "\n"),
                    markers);
    });
    expect_refused(folder, std::string("clouds/1.csv:2: x = `") + number, [&] {
      folder.write("clouds/1.csv", std::string("x,y,z\n") + number + ",1,1\n");
      read_point_clouds(folder / "clouds");
    });
  }
}

TEST(Names, ThatSpreadsheetsComputeAreWrittenAsText) {
  const TemporaryFolder folder;
  for (const std::string name : {"=1+1", "+cmd", "-x", "@a", "'=b", "'quoted", "-1.5", "plain"}) {
    SCOPED_TRACE(name);
    const MarkerSet markers = one_marker(name);
    write_tracks3d({{.frame = 0, .marker = 0, .position_m = {1, 2, 3}}}, markers, folder / "t.csv");
    const std::string field = csv_name(name);
    EXPECT_EQ(read_text(folder / "t.csv"), "frame,marker,x,y,z\n0," + field + ",1,2,3\n");
    EXPECT_EQ(std::string("=+-@").find(field.front()) != std::string::npos, name == "-1.5");
    EXPECT_EQ(read_tracks3d(folder / "t.csv", markers).size(), 1u);
  }
}

TEST(InputError, HoldsNothingThatATerminalObeys) {
  const InputError error("a\x1b]52;c;aGk=\a/b.csv", 3, "is \x9b wrong\n", "x\xc2\x9bm", "\x7f");
  const std::string text = error.what();
  EXPECT_EQ(text.find_first_of("\x1b\a\n\x7f"), std::string::npos);
  EXPECT_EQ(text.find("\xc2\x9b"), std::string::npos);
  EXPECT_THAT(text, testing::HasSubstr("a?]52;c;aGk=?/b.csv:3: is"));
}

TEST(ReplaceText, FollowsNoLinkAndLeavesNothingBeside) {
  const TemporaryFolder folder;
  folder.write("victim", "precious");
  const std::string own = ".s.txt.partial-" + std::to_string(getpid());
  fs::create_symlink("victim", folder / own);

  replace_text("new", folder / "s.txt");

  EXPECT_EQ(read_text(folder / "victim"), "precious");
  EXPECT_EQ(read_text(folder / "s.txt"), "new");
  EXPECT_FALSE(fs::is_symlink(folder / own));

  fs::create_symlink("victim", folder / "link");
  expect_refused(folder, "link: cannot be written", [&] { write_text("x", folder / "link"); });
  EXPECT_EQ(read_text(folder / "victim"), "precious");
}

TEST(Recording, NamesNoTableOutsideItsFolderUnlessThatIsAllowed) {
  const TemporaryFolder folder, elsewhere;
  write_full_recording(folder);
  elsewhere.write("secret.csv", "frame,marker,x,y,z\n0,a,1,2,3\n");
  fs::create_symlink(elsewhere / "secret.csv", folder / "link.csv");
  const std::string outside = (elsewhere / "secret.csv").string();
  const auto read = [&](const std::string& what, const std::string& by, OutsideFiles allowed) {
    folder.write("recording.yaml", replaced(kFullRecording, what, by));
    return read_recording(folder.path(), allowed);
  };
  for (const std::string& path :
       {outside, "../" + elsewhere.path().filename().string() + "/secret.csv",
        std::string("link.csv")}) {
    SCOPED_TRACE(path);
    for (const auto& [line, what] :
         {std::pair(19, "tracks3d: tracks3d.csv"), std::pair(27, "file: held/right.csv")}) {
      const std::string key(what, std::string(what).find(' ') + 1);  // with its colon
      expect_refused(folder, "recording.yaml:" + std::to_string(line) + ": ",
                     [&] { read(what, key + path, OutsideFiles::refused); });
    }
    EXPECT_NO_THROW(read("tracks3d: tracks3d.csv", "tracks3d: " + path, OutsideFiles::allowed));
    // Pictures, clouds and body logs are not copied.
    EXPECT_NO_THROW(
        read("name: tool, file: tool.csv", "name: tool, file: " + path, OutsideFiles::refused));
  }
  EXPECT_NO_THROW(
      read("images: frames/front", "images: " + elsewhere.path().string(), OutsideFiles::refused));
}

}  // namespace
}  // namespace clothfit
