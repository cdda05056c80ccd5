#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>

#include "apps/steps/recording_draft.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/progress_line.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/output_folder.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct InitVerbOptions {
  std::vector<fs::path> images;
  fs::path sheet;
  fs::path board;
  std::optional<double> mass_kg, frame_rate_hz, square_m;
  fs::path out;
};

/// Looks at some pictures of footage, its first ones among them.
LookResult look_over(const fs::path& images, const std::vector<std::string>& families,
                     bool boards) {
  constexpr int kLooks = 40, kHead = 3;
  ProgressLine line;
  LookResult seen =
      look(images, {.families = families, .looks = kLooks, .head = kHead, .boards = boards},
           watch(line));
  if (seen.cancelled) throw Cancelled();
  return seen;
}

/// Asks a person for a number; nothing where nobody is there, or has none.
std::optional<double> ask(const std::string& question) {
  if (isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0) return std::nullopt;
  for (;;) {
    fmt::print(stderr, "{} (Enter: not known): ", question);
    std::string answer;
    if (!std::getline(std::cin, answer) || answer.empty()) return std::nullopt;
    try {
      size_t used = 0;
      const double value = std::stod(answer, &used);
      if (used == answer.size() && value > 0) return value;
    } catch (const std::exception&) {
      // asked again
    }
    fmt::print(stderr, "A number above 0, please.\n");
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

DraftInput look_at_all(const InitVerbOptions& options) {
  DraftInput input{.sheet = read_recording(options.sheet),
                   .footage = {},
                   .mass_kg = options.mass_kg,
                   .frame_rate_hz = options.frame_rate_hz,
                   .board = std::nullopt,
                   .board_seen = std::nullopt,
                   .square_m = options.square_m};
  if (input.sheet.markers.kind != MarkerKind::apriltag)
    throw InputError(options.sheet.string(), "has no tags", "a sheet of tags",
                     "print one: clothfit sheet tags");
  for (const fs::path& images : options.images)
    input.footage.push_back({images, look_over(images, {input.sheet.markers.family}, false)});
  if (!options.board.empty()) {
    input.board = options.board;
    input.board_seen = look_over(options.board, {input.sheet.markers.family}, true);
  }
  return input;
}

void print_list(const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  fmt::print("\n{}\n", title);
  for (const std::string& text : lines) fmt::print("  - {}\n", text);
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
  require_positive("--mass", options.mass_kg);
  require_positive("--frame-rate", options.frame_rate_hz);
  require_positive("--square", options.square_m);
  for (fs::path& images : options.images) images = trimmed(images);
  const std::string usual = options.images.front().stem().string() + ".recording";
  const fs::path folder = new_folder(options, usual);
  DraftInput input = look_at_all(options);
  if (!input.mass_kg)
    if (const auto grams = ask("Mass of the cloth with its print, in grams"))
      input.mass_kg = *grams / 1e3;

  const std::string name =
      options.out.empty() ? options.images.front().stem().string() : folder.filename().string();
  const RecordingDraft draft = draft_recording(input, name, folder);
  OutputFolder out(folder);
  write_markers(input.sheet.markers.markers, out.path() / "markers.csv");
  write_text(draft.yaml, out.path() / "recording.yaml");
  read_recording(out.path());
  out.publish();
  fs::remove(folder / ".clothfit");  // what is in it is the user's from now on

  fmt::print("\n{}\n", shown_path(folder / "recording.yaml"));
  print_list("Assumed, to be looked at:", draft.assumed);
  print_list("Still needed:", draft.needed);
  fmt::print("\nNext: clothfit track {}\n", shown_path(folder));
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
      .required()
      .type_name("DIR");
  verb.add_option("--board", &options->board, "Stills or a video of a chessboard")
      .type_name("STILLS");
  verb.add_option("--square", &options->square_m, "Side of the board's fields").is_length();
  verb.add_option("--mass", &options->mass_kg, "Mass of the cloth (kg)");
  verb.add_option("--frame-rate", &options->frame_rate_hz, "Frames per second, of pictures");
  add_out_option(verb, options->out, "VIDEO.recording");
  verb.footer("Example:\n  clothfit init front.mp4 --sheet tags_8x8.sheet --mass 0.032");
  verb.runs([options] { return run_init(*options); });
}

}  // namespace clothfit
