// Checks recording.yaml and the files that it names. Not checked: the tables by themselves
// (tables_test.cpp) and camera files (camera_parameters_test.cpp).

#include "data/recording.h"

#include "data/tracks.h"
#include "tests/data/expect_refused.h"
#include "tests/data/full_recording.h"

namespace clothfit {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const std::string kLeastRecording =
    "format: clothfit-recording/1\n"
    "name: least\n"
    "cloth: {size: [0.4, 0.3]}\n"
    "markers: {kind: none}\n"
    "time: {frame_rate: 60}\n"
    "start: unknown\n";

void expect_same(const Recording& a, const Recording& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.cloth.width_m, b.cloth.width_m);
  EXPECT_EQ(a.cloth.height_m, b.cloth.height_m);
  EXPECT_EQ(a.cloth.mass_kg, b.cloth.mass_kg);
  EXPECT_EQ(a.cloth.masses, b.cloth.masses);
  EXPECT_EQ(a.cloth.mesh_columns, b.cloth.mesh_columns);
  EXPECT_EQ(a.cloth.mesh_rows, b.cloth.mesh_rows);
  EXPECT_EQ(a.markers_file, b.markers_file);
  EXPECT_EQ(a.markers.kind, b.markers.kind);
  EXPECT_EQ(a.markers.family, b.markers.family);
  EXPECT_EQ(a.markers.index, b.markers.index);
  EXPECT_EQ(a.frame_rate_hz, b.frame_rate_hz);
  EXPECT_EQ(a.times_file, b.times_file);
  EXPECT_EQ(a.times_s, b.times_s);
  EXPECT_EQ(a.gravity_m_per_s2, b.gravity_m_per_s2);
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    EXPECT_EQ(a.cameras[i].name, b.cameras[i].name);
    EXPECT_EQ(a.cameras[i].file, b.cameras[i].file);
    EXPECT_EQ(a.cameras[i].images, b.cameras[i].images);
    ASSERT_EQ(a.cameras[i].calibration.has_value(), b.cameras[i].calibration.has_value());
    if (!a.cameras[i].calibration) continue;
    EXPECT_EQ(a.cameras[i].calibration->images, b.cameras[i].calibration->images);
    EXPECT_EQ(a.cameras[i].calibration->board.columns, b.cameras[i].calibration->board.columns);
    EXPECT_EQ(a.cameras[i].calibration->board.rows, b.cameras[i].calibration->board.rows);
    EXPECT_EQ(a.cameras[i].calibration->board.square_m, b.cameras[i].calibration->board.square_m);
  }
  EXPECT_EQ(a.tracks3d, b.tracks3d);
  EXPECT_EQ(a.tracks2d, b.tracks2d);
  EXPECT_EQ(a.reference_file, b.reference_file);
  EXPECT_EQ(a.reference.size(), b.reference.size());
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].name, b.bodies[i].name);
    EXPECT_EQ(a.bodies[i].file, b.bodies[i].file);
    EXPECT_EQ(a.bodies[i].clock_offset_s, b.bodies[i].clock_offset_s);
    EXPECT_EQ(a.bodies[i].holds_m, b.bodies[i].holds_m);
  }
  ASSERT_EQ(a.clouds.has_value(), b.clouds.has_value());
  if (a.clouds) {
    EXPECT_EQ(a.clouds->camera, b.clouds->camera);
    EXPECT_EQ(a.clouds->folder, b.clouds->folder);
  }
  EXPECT_EQ(a.obstacle_file, b.obstacle_file);
  ASSERT_EQ(a.obstacle.has_value(), b.obstacle.has_value());
  if (a.obstacle) {
    EXPECT_EQ(a.obstacle->vertex_m, b.obstacle->vertex_m);
  }
  ASSERT_EQ(a.held.size(), b.held.size());
  for (size_t i = 0; i < a.held.size(); ++i) {
    EXPECT_EQ(a.held[i].at_m, b.held[i].at_m);
    EXPECT_EQ(a.held[i].edge, b.held[i].edge);
    EXPECT_EQ(a.held[i].motion, b.held[i].motion);
    EXPECT_EQ(a.held[i].file, b.held[i].file);
  }
  EXPECT_EQ(a.start, b.start);
  ASSERT_EQ(a.declared.size(), b.declared.size());
  for (size_t i = 0; i < a.declared.size(); ++i) {
    EXPECT_EQ(a.declared[i].name, b.declared[i].name);
    EXPECT_EQ(a.declared[i].parameters, b.declared[i].parameters);
  }
  EXPECT_EQ(a.held_out_from_frame, b.held_out_from_frame);
}

TEST(Recording, HoldsEveryKeyOfTheFormat) {
  const TemporaryFolder folder;
  write_full_recording(folder);

  const Recording recording = read_recording(folder.path());

  EXPECT_EQ(recording.folder, folder.path());
  EXPECT_EQ(recording.name, "full");
  EXPECT_EQ(recording.origin, "made up: for a test");
  EXPECT_EQ(recording.cloth.width_m, 0.4);
  EXPECT_EQ(recording.cloth.height_m, 0.3);
  EXPECT_EQ(recording.cloth.mass_kg, 0.0305);
  EXPECT_EQ(recording.cloth.masses, MassDistribution::equal);
  EXPECT_EQ(recording.cloth.mesh_columns, 17);
  EXPECT_EQ(recording.cloth.mesh_rows, 13);
  EXPECT_EQ(recording.markers.kind, MarkerKind::apriltag);
  EXPECT_EQ(recording.markers.family, "tag36h11");
  EXPECT_EQ(recording.markers.index.at("b"), 1);
  EXPECT_EQ(recording.markers.markers[1].corner, 1);
  EXPECT_EQ(recording.markers_file, folder / "markers.csv");
  EXPECT_EQ(recording.frame_rate_hz, std::nullopt);
  EXPECT_EQ(recording.times_s, (std::vector<double>{0.5, 0.6, 0.75}));
  EXPECT_EQ(recording.frame_time_s(2), 0.75);
  EXPECT_EQ(recording.gravity_m_per_s2, Eigen::Vector3d(0, 0.1, -9.81));
  ASSERT_EQ(recording.cameras.size(), 2u);
  EXPECT_EQ(recording.find_camera("front")->images, folder / "frames/front");
  EXPECT_EQ(recording.find_camera("side")->file, std::nullopt);
  EXPECT_EQ(recording.find_camera("side")->calibration->board.rows, 6);
  EXPECT_EQ(recording.find_camera("side")->calibration->board.square_m, 0.025);
  EXPECT_EQ(recording.find_camera("back"), nullptr);
  EXPECT_EQ(recording.tracks3d, folder / "tracks3d.csv");
  EXPECT_EQ(recording.tracks2d.at("front"), folder / "tracks2d/front.csv.gz");
  EXPECT_EQ(recording.reference[0].z_m, 3);
  EXPECT_EQ(recording.bodies[0].clock_offset_s, std::nullopt);
  EXPECT_EQ(recording.bodies[0].holds_m[1], Eigen::Vector2d(0.4, 0));
  EXPECT_EQ(recording.bodies[1].clock_offset_s, -0.25);
  EXPECT_EQ(recording.clouds->folder, folder / "clouds");
  ASSERT_EQ(recording.held.size(), 4u);
  EXPECT_EQ(recording.held[1].motion, HeldMotion::path);
  EXPECT_EQ(recording.held[1].file, folder / "held/right.csv");
  EXPECT_EQ(recording.held[2].motion, HeldMotion::tracked);
  EXPECT_EQ(recording.held[3].edge, ClothEdge::bottom);
  EXPECT_EQ(recording.start, StartKind::released_flat);
  ASSERT_EQ(recording.declared.size(), 2u);
  EXPECT_EQ(recording.declared[0].parameters.at("q"), (std::vector<double>{0, 0.25, 0}));
  EXPECT_EQ(recording.declared[0].parameters.at("c"), std::vector<double>{0.5});
  EXPECT_TRUE(recording.declared[1].parameters.empty());
  EXPECT_EQ(recording.held_out_from_frame, 2);
  EXPECT_EQ(recording.obstacle_file, folder / "scene/table.obj");
  ASSERT_TRUE(recording.obstacle);
  EXPECT_EQ(recording.obstacle->vertex_m.col(2), Eigen::Vector3d(1, 1, 0.7));
}

TEST(Recording, NeedsLittle) {
  const TemporaryFolder folder;
  folder.write("recording.yaml", kLeastRecording);

  const Recording recording = read_recording(folder.path());

  EXPECT_EQ(recording.cloth.mass_kg, std::nullopt);
  EXPECT_EQ(recording.cloth.masses, MassDistribution::by_area);
  EXPECT_EQ(recording.gravity_m_per_s2, Eigen::Vector3d(0, 0, -9.81));
  EXPECT_TRUE(recording.cameras.empty());
  EXPECT_TRUE(recording.held.empty());
  EXPECT_EQ(recording.held_out_from_frame, std::nullopt);
  EXPECT_EQ(recording.obstacle_file, std::nullopt);
  EXPECT_FALSE(recording.obstacle);
  EXPECT_EQ(recording.frame_time_s(30), 0.5);
}

TEST(Recording, IsFoundByItsFolderOrItsFile) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  const Recording by_folder = read_recording(folder.path());

  expect_same(read_recording(folder / "recording.yaml"), by_folder);

  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  expect_same(read_recording("."), by_folder);
  expect_same(read_recording("recording.yaml"), by_folder);
  std::filesystem::current_path(before);
}

TEST(Recording, MayHaveWindowsLineEndsAndAByteOrderMark) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  const Recording plain = read_recording(folder.path());
  std::string text = "\xef\xbb\xbf";
  for (const char c : kFullRecording) text += c == '\n' ? "\r\n" : std::string(1, c);

  folder.write("recording.yaml", text);

  expect_same(read_recording(folder.path()), plain);
}

TEST(Recording, KeepsTheNamesOfLinkedFiles) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  std::filesystem::rename(folder / "tracks2d/front.csv.gz", folder / "store");
  std::filesystem::create_symlink("../store", folder / "tracks2d/front.csv.gz");
  folder.write("recording.yaml",
               replaced(kFullRecording, "images: frames/front", "images: frames/../frames/front/"));

  const Recording recording = read_recording(folder.path());

  EXPECT_EQ(recording.tracks2d.at("front"), folder / "tracks2d/front.csv.gz");
  EXPECT_EQ(recording.find_camera("front")->images, folder / "frames/front");
  EXPECT_EQ(read_tracks2d(recording.tracks2d.at("front"), recording.markers).size(), 1u);
}

TEST(Recording, ReadsBackAsWritten) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  const Recording recording = read_recording(folder.path());

  write_recording(recording, folder.path());

  expect_same(read_recording(folder.path()), recording);
}

TEST(Recording, WrittenElsewhereNamesTheSameFiles) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "results/a.tracks");
  write_full_recording(folder);
  const Recording recording = read_recording(folder.path());

  write_recording(recording, folder / "results/a.tracks");

  expect_same(read_recording(folder / "results/a.tracks", OutsideFiles::allowed), recording);
  EXPECT_THAT(read_text(folder / "results/a.tracks/recording.yaml"),
              testing::HasSubstr("images: ../../frames/front"));
}

TEST(Recording, IsWrittenInTheStyleOfTheFormat) {
  const TemporaryFolder folder;
  write_full_recording(folder);

  write_recording(read_recording(folder.path()), folder.path());

  const std::string text = read_text(folder / "recording.yaml");
  EXPECT_THAT(text, testing::StartsWith("format: clothfit-recording/1\nname: full\n"));
  for (const std::string line :
       {"  size: [0.4, 0.3]\n", "  mesh: {columns: 17, rows: 13}\n",
        "markers: {kind: apriltag, family: tag36h11, file: markers.csv}\n",
        "time: {file: times.csv}\n",
        "  - {name: front, file: cameras/front.yaml, images: frames/front}\n",
        "observations: {tracks3d: tracks3d.csv, tracks2d: {front: tracks2d/front.csv.gz}}\n",
        "  - {at: [0.4, 0], motion: path, file: held/right.csv}\n",
        "  - {edge: bottom, motion: fixed}\n",
        "  - {effect: wind, parameters: {c: 0.5, q: [0, 0.25, 0]}}\n",
        "obstacle: scene/table.obj\n", "held_out: {from_frame: 2}\n"})
    EXPECT_THAT(text, testing::HasSubstr(line));
}

TEST(Recording, KeepsTextThatLooksLikeYaml) {
  const TemporaryFolder folder;
  folder.write("recording.yaml", kLeastRecording);
  Recording recording = read_recording(folder.path());
  for (const std::string text :
       {"null", "~",    "a: b # c", "'q' \"d\" \\", "- x", " x ",      "ünï", "two\nlines",
        "{x}",  "[x",   "@x",       "!x",           "%x",  "&x",       "*x",  "? x",
        "12",   "true", "#x",       ": x",          "x:",  "tab\there"}) {
    SCOPED_TRACE(text);
    recording.origin = text;

    write_recording(recording, folder.path());

    EXPECT_EQ(read_recording(folder.path()).origin, text);
  }
}

TEST(Recording, HasNoTimeForAFrameBeyondItsTimes) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  const Recording recording = read_recording(folder.path());

  expect_refused(folder, "times.csv: there is no time for frame 3; a time for every frame",
                 [&] { recording.frame_time_s(3); });
}

TEST(Recording, RefusesAPauseOfHours) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  folder.write("times.csv", "frame,time\n0,0\n1,0.1\n2,1e9\n");

  expect_refused(folder,
                 "times.csv:4: 999999999.9 seconds after the frame before; 1000 seconds at most",
                 [&] { read_recording(folder.path()); });
}

TEST(Recording, IsRefusedWithFileAndLine) {
  struct Case {
    std::string from, to;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"recording/1", "recording/9", ":1: format = clothfit-recording/9; did you mean"},
      {"format: clothfit-recording/1\n", "", ":1: `format` is missing"},
      {"name: full", "nam: full",
       ":2: unknown key `nam`; did you mean `name`? known are `format`,"},
      {"name: full", "name: [full]", ":2: name is a list; text"},
      {"name: full", "name: ''", ":2: name is empty; text"},
      {"name: full", "name: a/b", ":2: name cannot name a file"},
      {"name: full", "\"na\\nme\": full", ":2: unknown key `na?me`; did you mean `name`?"},
      {"name: full", "name: ..", ":2: name cannot name a file"},
      {"name: full", "name: full\nname: again", ":3: `name` stands on line 2 already"},
      {"[0.40, 0.30]", "[0.40, 0]",
       ":5: cloth.size[1] = 0; a side of the flat cloth in metres, 0.0001 to 1000"},
      {"[0.40, 0.30]", "[0.40]", ":5: cloth.size has 1 items; a list of 2 numbers"},
      {"[0.40, 0.30]", "[0.40, wide]", ":5: cloth.size[1] = wide; a finite number"},
      {"[0.40, 0.30]", "[0.40, .nan]", ":5: cloth.size[1] = .nan; a finite number"},
      {"  size: [0.40, 0.30]\n", "", ":4: `size` is missing in cloth"},
      {"[0.40, 0.30]", "[4e20, 0.30]", ":5: cloth.size[0] = 4e20; a side of the flat cloth"},
      {"0.0305", "-0.02",
       ":6: cloth.mass = -0.02; the dry cloth's mass in kilograms (or null), 1e-06"},
      {"0.0305", "0", ":6: cloth.mass = 0; the dry cloth's mass"},
      {"0.0305", "1e-300", ":6: cloth.mass = 1e-300; the dry cloth's mass"},
      {"0.0305", "light", ":6: cloth.mass = light; a finite number"},
      {"masses: equal", "masses: same", ":7: cloth.masses = same; known are `by_area`, `equal`"},
      {"rows: 13", "rows: 0", ":8: cloth.mesh.rows = 0; a whole number, 2 or more"},
      {"rows: 13", "rows: 1", ":8: cloth.mesh.rows = 1; a whole number, 2 or more"},
      {"columns: 17", "columns: -3", ":8: cloth.mesh.columns = -3; a whole number, 2 or more"},
      {"columns: 17", "columns: 2.5", ":8: cloth.mesh.columns = 2.5; a whole number"},
      {"columns: 17", "columns: 2000000000",
       ":8: cloth.mesh = 2000000000 x 13; 65536 vertices at most"},
      {"rows: 13", "row: 13", ":8: unknown key `row` in cloth.mesh; did you mean `rows`?"},
      {"kind: apriltag", "kind: april", ":9: markers.kind = april; known are `apriltag`"},
      {"family: tag36h11, ", "", ":9: `family` is missing in markers"},
      {"file: markers.csv", "file: marker.csv", ":9: markers.file = marker.csv: there is no such"},
      {", file: markers.csv", "", ":9: `file` is missing in markers"},
      {"file: times.csv", "file: times.csv, frame_rate: 60", ":10: time has both a frame_rate and"},
      {"{file: times.csv}", "{}", ":10: time is not given"},
      {"file: times.csv", "frame_rate: 0", ":10: time.frame_rate = 0; frames per second, 0.001"},
      {"file: times.csv", "frame_rate: 1e300", ":10: time.frame_rate = 1e300; frames per second"},
      {"file: times.csv", "file: none.csv", ":10: time.file = none.csv: there is no such file"},
      {"-9.81]", "-1e200]", ":11: gravity[2] = -1e200; m/s2 along each axis, -1000 to 1000"},
      {"[0.0, 0.1, -9.81]", "-9.81", ":11: gravity = -9.81; a list of 3 numbers"},
      {"file: cameras/front.yaml", "file: cameras/none.yaml",
       ":13: cameras[0].file = cameras/none.yaml: there is no such file"},
      {"images: frames/front", "images: frames/none",
       ":13: cameras[0].images = frames/none: there is no such folder of pictures or a video file"},
      {"name: side", "name: front", ":14: a second camera `front`"},
      {"name: side", "name: a/b", ":14: cameras[1].name cannot name a file"},
      {"images: calibration/side", "images: calibration/none",
       ":17: cameras[1].calibration.images = calibration/none: there is no such"},
      {"kind: chessboard", "kind: charuco", ":18: cameras[1].calibration.board.kind = charuco"},
      {"rows: 6", "rows: 2", ":18: cameras[1].calibration.board.rows = 2; a whole number, 3 to"},
      {"rows: 6", "rows: 2000000000", ":18: cameras[1].calibration.board.rows = 2000000000; a"},
      {"square: 0.025", "square: 0",
       ":18: cameras[1].calibration.board.square = 0; a square's side"},
      {"tracks3d: tracks3d.csv", "tracks3d: x.csv", ":19: observations.tracks3d = x.csv: there is"},
      {"{front: tracks2d", "{fron: tracks2d",
       ":19: there is no camera `fron`; did you mean `front`? known are `front`, `side`"},
      {"reference: reference.csv", "reference: clouds",
       ":20: reference = clouds: there is no such"},
      {"reference: reference.csv", "reference: {a: 1}", ":20: reference is a map; text"},
      {"clock_offset: unknown", "clock_offset: soon", ":22: bodies[0].clock_offset is neither"},
      {"[0.4, 0]]", "[0.5, 0]]", ":22: bodies[0].holds[1] = [0.5, 0] lies outside the cloth"},
      {"name: arm", "name: tool", ":23: a second body `tool`"},
      {"camera: front", "camera: top", ":24: there is no camera `top`"},
      {"files: clouds", "files: none", ":24: clouds.files = none: there is no such folder"},
      {"at: [0.0, 0.0]", "at: [0.0, 0.31]", ":26: held[0].at = [0, 0.31] lies outside the cloth"},
      {"at: [0.0, 0.0], ", "", ":26: held[0] has neither `at` nor `edge`"},
      {"at: [0.0, 0.0]", "at: [0.0, 0.0], edge: top", ":26: held[0] has both `at` and `edge`"},
      {"motion: fixed", "motion: fix", ":26: held[0].motion = fix; known are `fixed`"},
      {"motion: fixed", "motion: fixed, file: held/right.csv",
       ":26: held[0]: a file with motion fixed"},
      {", file: held/right.csv", "", ":27: `file` is missing in held[1]"},
      {"held/right.csv", "held/left.csv",
       ":27: held[1].file = held/left.csv: there is no such file"},
      {"at: [0.2, 0.0]", "at: [0.4, 0.0]", ":28: held[2] is held already"},
      {"edge: bottom", "edge: under", ":29: held[3].edge = under; known are `top`"},
      {"edge: bottom, motion: fixed", "edge: bottom, motion: tracked",
       ":29: held[3]: an edge with motion tracked; motion: fixed for an edge"},
      {"released_flat", "released", ":30: start = released; known are `at_rest`"},
      {"c: 0.5", "c: strong", ":32: declared[0].parameters.c = strong; a finite number"},
      {"c: 0.5", "q: 0.5", ":32: `q` stands on line 32 already"},
      {"effect: viscous_damping", "effect: wind", ":33: effect `wind` is declared twice"},
      {"from_frame: 2", "from_frame: 0", ":34: held_out.from_frame = 0; a whole number, 1 or more"},
      {"from_frame: 2", "from: 2", ":34: unknown key `from` in held_out; known are `from_frame`"},
      {"held_out: {from_frame: 2}", "held_out: {from_frame: 2", ":35: not YAML: "},
      {"held_out: {from_frame: 2}", "\theld_out: 2", ":34: not YAML: "},
      {"scene/table.obj", "table.obj", ":35: obstacle = table.obj: there is no such file; a file"},
      {"scene/table.obj", "scene", ":35: obstacle = scene: there is no such file; a file"},
  };
  const TemporaryFolder folder;
  write_full_recording(folder);
  for (const Case& test : cases) {
    folder.write("recording.yaml", replaced(kFullRecording, test.from, test.to));
    expect_refused(folder, "recording.yaml" + test.message, [&] { read_recording(folder.path()); });
  }
}

TEST(Recording, IsRefusedWhereATableItNamesIsWrong) {
  struct Case {
    std::string file, text;
    std::string message;
  };
  const std::vector<Case> cases = {
      {"markers.csv", "marker,s,t\na,0.41,0\n", "markers.csv:2: marker `a` at (s, t)"},
      {"times.csv", "frame,time\n0,0\n2,1\n", "times.csv:3: frame 2 where frame 1 was due"},
      {"times.csv", "frame,time\n1,0\n", "times.csv:2: frame 1 where frame 0 was due"},
      {"times.csv", "frame,time\n0,1\n1,1\n", "times.csv:3: time = `1` after `1`; times that"},
      {"times.csv", "frame,time\n", "times.csv: the table holds no times"},
      {"reference.csv", "point,x,y\n", "reference.csv:1: column `z` is missing"},
      {"scene/table.obj", "", "scene/table.obj: no faces; a surface of triangles"},
      {"scene/table.obj", "v 0 0 x\n", "scene/table.obj:1: coordinate `x`; a vertex is three"},
  };
  for (const Case& test : cases) {
    const TemporaryFolder folder;
    write_full_recording(folder);
    folder.write(test.file, test.text);
    expect_refused(folder, test.message, [&] { read_recording(folder.path()); });
  }
}

TEST(Recording, IsRefusedWhereThereIsNone) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  folder.write("file", "x");

  expect_refused(folder, "none: there is no such folder; a recording: a folder that holds",
                 [&] { read_recording(folder / "none"); });
  expect_refused(folder, "empty: holds no recording.yaml; a recording: a folder that holds",
                 [&] { read_recording(folder / "empty"); });
  expect_refused(folder, "file: holds no recording.yaml", [&] { read_recording(folder / "file"); });
  expect_refused(folder, "empty/recording.yaml: there is no such file",
                 [&] { read_recording(folder / "empty/recording.yaml"); });
}

TEST(Recording, MayLeaveItsTimesToItsVideos) {
  const TemporaryFolder folder;
  write_full_recording(folder);
  folder.write("recording.yaml", replaced(kFullRecording, "time: {file: times.csv}\n", ""));
  const Recording recording = read_recording(folder.path());
  EXPECT_FALSE(recording.frame_rate_hz);
  EXPECT_FALSE(recording.times_file);
  expect_refused(folder, "recording.yaml: no `time` is given, and the videos were not looked at",
                 [&] { recording.frame_time_s(0); });
  write_recording(recording, folder.path());
  expect_same(read_recording(folder.path()), recording);
}

TEST(Recording, NeedsTimesWhereNoVideoStatesThem) {
  const TemporaryFolder folder;
  const std::string timeless = replaced(kLeastRecording, "time: {frame_rate: 60}\n", "");
  folder.write("recording.yaml", timeless);
  EXPECT_NO_THROW(read_recording(folder.path())) << "it has no frames";
  folder.write("recording.yaml", timeless + "cameras: [{name: front}]\n");
  expect_refused(folder, "recording.yaml: no `time` is given, and no video states it",
                 [&] { read_recording(folder.path()); });
}

}  // namespace
}  // namespace clothfit
