#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <optional>
#include <string_view>

#include "apps/steps/calibrate_step.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/grid_size.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/verb.h"
#include "data/file_name.h"
#include "data/input_error.h"
#include "data/number_text.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct CalibrateVerbOptions {
  fs::path input;
  std::string board;
  std::string name;
  std::string model = "brown_conrady";
  int distortion_count = CalibrateOptions{}.distortion_count;
  fs::path out;
  bool allow_outside = false;
};

/// Reads "chessboard:9x6:0.025": inner corners along and across, side of a square in metres.
/// Nothing where the text is not a board.
std::optional<BoardDescription> parse_board(const std::string& text) {
  constexpr std::string_view kKind = "chessboard:";
  if (!text.starts_with(kKind)) return std::nullopt;
  const std::string_view sizes = std::string_view(text).substr(kKind.size());
  const size_t colon = sizes.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::optional<GridSize> corners = parse_grid_size(sizes.substr(0, colon));
  const std::optional<double> square_m = parse_number(sizes.substr(colon + 1));
  if (!corners || !square_m) return std::nullopt;
  const BoardDescription board{corners->columns, corners->rows, *square_m};
  return is_possible(board) ? std::optional(board) : std::nullopt;
}

std::string check_board(const std::string& text) {
  if (parse_board(text)) return "";
  return fmt::format("'{}' is not a board, such as chessboard:9x6:0.025 ({} to {} inner corners)",
                     text, kFewestBoardCorners, kMostBoardCorners);
}

std::string check_name(const std::string& text) {
  return can_name_a_file(text) ? "" : "'" + text + "' cannot name a file";
}

CalibrateOptions library_options(const CalibrateVerbOptions& options) {
  CalibrateOptions result;
  result.distortion_count = options.distortion_count;
  if (options.model == "pinhole") {
    result.model = CameraModel::pinhole;
    result.distortion_count = 0;
  } else if (options.model == "kannala_brandt") {
    result.model = CameraModel::kannala_brandt;
    result.distortion_count = 4;
  }
  result.validate();
  return result;
}

void print_calibration(const StillsCalibration& calibration) {
  const CalibrateResult& result = calibration.result;
  say("\nCamera {}: {} of {} stills used, {} corners, {} px rms per coordinate\n{}\n\n",
      calibration.camera, result.views.size(), calibration.stills, result.corners_used,
      significant(result.rms_px, 3), result.message);
  std::vector<std::vector<std::string>> rows;
  for (const NamedSigma& parameter : result.intrinsics) {
    rows.push_back({parameter.name, value_text(parameter.value, parameter.sigma),
                    significant(parameter.sigma, 2)});
  }
  say("{}", text_table({{"parameter", "value", "sigma"}, rows}));
  for (const std::string& still : calibration.board_not_found)
    spdlog::warn("{}: the whole board was not found", still);
}

int run_calibrate(const CalibrateVerbOptions& options) {
  const CalibrateOptions calibrate_options = library_options(options);
  const fs::path folder = recording_folder(options.input);
  std::vector<StillsCalibration> calibrations;

  if (fs::exists(folder / "recording.yaml")) {
    if (!options.board.empty())
      throw InputError("--board", "is given beside a recording", "one place that says the board",
                       "write it under `calibration` in recording.yaml");
    const Recording recording = read_recording(folder, outside_files(options.allow_outside));
    std::vector<std::string> cameras = cameras_to_calibrate(recording, true);
    if (!options.name.empty()) std::erase_if(cameras, [&](auto& c) { return c != options.name; });
    if (cameras.empty())
      throw InputError((folder / "recording.yaml").string(),
                       options.name.empty()
                           ? "no camera has stills to calibrate from"
                           : "camera '" + options.name + "' has no stills to calibrate from",
                       "`calibration: {images: FOLDER, board: ...}` in a camera's entry");
    ResultFolder out(out_folder(options.out, recording.name + ".calibration"),
                     input_paths(recording));
    {
      ProgressLine line;
      calibrations = calibrate_step(recording, cameras, calibrate_options, out.path(), watch(line))
                         .calibrations;
    }
    out.publish();
    for (const StillsCalibration& calibration : calibrations) print_calibration(calibration);
    say("\nRecording with cameras: {}\n", shown_path(out.final_path()));
    return kExitGood;
  }

  if (options.board.empty())
    throw InputError(options.input.string(), "holds no recording.yaml, so it must be stills",
                     "--board with them", "for example --board chessboard:9x6:0.025");
  const CalibrationStills stills{.images = options.input, .board = *parse_board(options.board)};
  const std::string name = options.name.empty() ? "camera" : options.name;
  ResultFolder out(out_folder(options.out, name + ".calibration"), {options.input});
  {
    ProgressLine line;
    calibrations.push_back(calibrate_from_stills(name, stills, calibrate_options, watch(line)));
  }
  write_calibrations(calibrations, out.path());
  out.publish();
  print_calibration(calibrations.front());
  say("\nCamera file: {}\n", shown_path(out.final_path() / "cameras" / (name + ".yaml")));
  return kExitGood;
}

}  // namespace

void add_calibrate_verb(Verb program) {
  const auto options = std::make_shared<CalibrateVerbOptions>();
  Verb verb = program.add_verb(
      "calibrate", "Find a camera's focal length, centre and distortion from stills of a board");
  verb.add_option("input", &options->input, "Folder of stills, or a recording that names them")
      .required()
      .type_name("STILLS|RECORDING");
  verb.add_option("--board", &options->board,
                  "Board on the stills: chessboard:COLUMNSxROWS:SQUARE, inner corners and metres")
      .check(check_board);
  verb.add_option("--name", &options->name, "Name of the camera").check(check_name);
  verb.add_option("--model", &options->model, "Camera model")
      .one_of({"pinhole", "brown_conrady", "kannala_brandt"})
      .shows_default();
  verb.add_option("--distortion", &options->distortion_count,
                  "Distortion coefficients of brown_conrady")
      .one_of({"4", "5", "8"})
      .shows_default();
  add_out_option(verb, options->out, "NAME.calibration");
  add_outside_option(verb, options->allow_outside);
  verb.footer("Example:\n  clothfit calibrate stills/ --board chessboard:9x6:0.025 --name front");
  verb.runs([options] { return run_calibrate(*options); });
}

}  // namespace clothfit
