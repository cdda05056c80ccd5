#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>

#include "apps/steps/recording_draft.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/number_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct InitVerbOptions {
  std::vector<fs::path> images;
  fs::path sheet;
  fs::path board;
  std::string mass;
  std::optional<double> frame_rate_hz, square_m;
  fs::path out;
};

/// Looks at some pictures of footage, its first ones among them.
LookResult look_over(const fs::path& images, LookOptions options) {
  options.looks = 40;
  options.head = 3;
  options.dots = false;
  ProgressLine line;
  LookResult seen = look(images, options, watch(line));
  if (seen.cancelled) throw Cancelled();
  return seen;
}

/// Reads kilograms from "32.5 g", "0.0325 kg" or, where the unit may be left out, "0.0325".
std::optional<double> parse_mass_kg(std::string text, bool needs_unit) {
  std::erase(text, ' ');
  double units_in_kg = 1;
  if (text.ends_with("kg")) {
    text.resize(text.size() - 2);
  } else if (text.ends_with('g')) {
    units_in_kg = 1e3;
    text.resize(text.size() - 1);
  } else if (needs_unit) {
    return std::nullopt;
  }
  const std::optional<double> value = parse_number(text);
  if (!value || !(*value > 0)) return std::nullopt;
  return *value / units_in_kg;
}

/// Asks a person for the mass (kg); nothing where nobody is there, or knows it.
std::optional<double> ask_mass_kg() {
  if (isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0) return std::nullopt;
  for (;;) {
    fmt::print(
        stderr,
        "Mass of the cloth with its print, such as 32.5 g or 0.0325 kg (Enter: not known): ");
    std::string answer;
    if (!std::getline(std::cin, answer) || answer.empty()) return std::nullopt;
    if (const std::optional<double> mass_kg = parse_mass_kg(answer, true)) return mass_kg;
    fmt::print(stderr, "A number above 0 with its unit, g or kg, please.\n");
  }
}

fs::path new_folder(const InitVerbOptions& options, const std::string& name) {
  const fs::path folder = out_folder(options.out, name);
  // What stands there may hold what a person has written since.
  if (fs::exists(folder))
    throw InputError(folder.string(), "is there already", "a folder that does not exist yet",
                     "give another one with --out");
  return folder;
}

DraftInput look_at_all(const InitVerbOptions& options, const std::optional<double>& mass_kg) {
  DraftInput input{.sheet = read_recording(options.sheet),
                   .footage = {},
                   .mass_kg = mass_kg,
                   .frame_rate_hz = options.frame_rate_hz,
                   .board = std::nullopt,
                   .board_seen = std::nullopt,
                   .square_m = options.square_m};
  const MarkerSet& markers = input.sheet.markers;
  if (markers.kind != MarkerKind::apriltag && markers.kind != MarkerKind::dots)
    throw InputError(options.sheet.string(), "has no tags and no dots", "a sheet of tags or dots",
                     "print one: clothfit sheet tags");
  LookOptions wanted{.boards = false};
  if (!markers.family.empty()) wanted.families = {markers.family};
  if (markers.kind == MarkerKind::dots) wanted.sheet = &markers;
  for (const fs::path& images : options.images)
    input.footage.push_back({images, look_over(images, wanted)});
  if (!options.board.empty()) {
    input.board = options.board;
    input.board_seen = look_over(options.board, {.families = wanted.families});
  }
  return input;
}

void print_list(const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  say("\n{}\n", title);
  for (const std::string& text : lines) say("  - {}\n", text);
}

/// Returns a path without a separator at its end, which would hide its name.
fs::path trimmed(const fs::path& path) {
  const fs::path normal = path.lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

void require_positive(const char* option, const std::optional<double>& value) {
  if (value && !(*value > 0))
    throw InputError(option, fmt::format("{}", *value), "a number above 0");
}

int run_init(InitVerbOptions options) {
  std::optional<double> mass_kg;
  if (!options.mass.empty()) {
    mass_kg = parse_mass_kg(options.mass, false);
    if (!mass_kg)
      throw InputError("--mass", fmt::format("'{}'", options.mass), "kilograms above 0",
                       "such as 0.0325, 0.0325kg or 32.5g");
  }
  require_positive("--frame-rate", options.frame_rate_hz);
  require_positive("--square", options.square_m);
  for (fs::path& images : options.images) images = trimmed(images);
  const std::string usual = options.images.front().stem().string() + ".recording";
  const fs::path folder = new_folder(options, usual);
  std::vector<fs::path> inputs = options.images;
  inputs.push_back(options.sheet);
  ResultFolder out(folder, inputs);
  if (options.sheet.empty())
    refuse_without_sheet(
        {options.images.front(), look_over(options.images.front(), {.boards = false})});
  DraftInput input = look_at_all(options, mass_kg);
  if (!input.mass_kg) input.mass_kg = ask_mass_kg();

  const std::string name =
      options.out.empty() ? options.images.front().stem().string() : folder.filename().string();
  const RecordingDraft draft = draft_recording(input, name, folder);
  write_markers(input.sheet.markers.markers, out.path() / "markers.csv");
  write_text(draft.yaml, out.path() / "recording.yaml");
  read_recording(out.path());
  out.publish();
  fs::remove(folder / ".clothfit");  // what is in it is the user's from now on

  say("\n{}\n", shown_path(folder / "recording.yaml"));
  print_list("Assumed, to be looked at:", draft.assumed);
  print_list("Still needed:", draft.needed);
  say("\nNext: clothfit track {}\n", shown_path(folder));
  return kExitGood;
}

}  // namespace

void add_init_verb(Verb program) {
  const auto options = std::make_shared<InitVerbOptions>();
  Verb verb = program.add_verb("init", "Write a recording from what was filmed");
  verb.add_option("images", &options->images, "A video or folder of pictures per camera")
      .required()
      .type_name("VIDEO");
  verb.add_option("--sheet", &options->sheet, "Folder of the sheet on the cloth (clothfit sheet)")
      .type_name("DIR");
  verb.add_option("--board", &options->board, "Stills or a video of a chessboard")
      .type_name("STILLS");
  verb.add_option("--square", &options->square_m, "Side of the board's fields").is_length();
  verb.add_option("--mass", &options->mass, "Mass of the cloth: 0.0325 (kg), 0.0325kg or 32.5g")
      .type_name("MASS");
  verb.add_option("--frame-rate", &options->frame_rate_hz, "Frames per second, of pictures");
  add_out_option(verb, options->out, "VIDEO.recording");
  verb.footer("Example:\n  clothfit init front.mp4 --sheet tags_8x8.sheet --mass 0.032");
  verb.runs([options] { return run_init(*options); });
}

}  // namespace clothfit
