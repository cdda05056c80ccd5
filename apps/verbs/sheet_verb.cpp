#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <tuple>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/grid_size.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/verbs/verb.h"
#include "data/input_error.h"
#include "data/number_text.h"
#include "data/text_file.h"
#include "vision/print/draw_sheet.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct SheetVerbOptions {
  std::string kind = "tags";
  std::string size = "0.4x0.4";
  std::string grid;
  double square_m = 0.02;
  TagSheetOptions tags;
  PageOptions draw;
  fs::path out;
};

/// Reads metres from "0.4" or "0.4x0.3".
std::pair<double, double> parse_size(const std::string& text) {
  const auto number = [&](const std::string& part) {
    const std::optional<double> value = parse_number(part);
    if (!value)
      throw InputError("--size", fmt::format("'{}'", text), "metres, WIDTHxHEIGHT or one number",
                       "such as 0.4x0.3");
    return *value;
  };
  const size_t cross = text.find('x');
  const double width_m = number(text.substr(0, cross));
  return {width_m, cross == std::string::npos ? width_m : number(text.substr(cross + 1))};
}

GridSize grid_of(const SheetVerbOptions& options, const GridSize& usual) {
  if (options.grid.empty()) return usual;
  const std::optional<GridSize> grid = parse_grid_size(options.grid);
  if (!grid)
    throw InputError("--grid", fmt::format("'{}'", options.grid), "COLUMNSxROWS, such as 8x8");
  return *grid;
}

PrintedSheet make_sheet(const SheetVerbOptions& options) {
  if (options.kind == "board") {
    const GridSize corners = grid_of(options, {9, 6});
    return make_board_sheet(
        {.columns = corners.columns, .rows = corners.rows, .square_m = options.square_m});
  }
  if (options.kind == "dots") {
    DotSheetOptions dots;
    std::tie(dots.width_m, dots.height_m) = parse_size(options.size);
    const auto [columns, rows] = usual_dot_grid(dots.width_m, dots.height_m);
    const GridSize grid = grid_of(options, {columns, rows});
    dots.columns = grid.columns;
    dots.rows = grid.rows;
    return make_dot_sheet(dots);
  }
  TagSheetOptions tags = options.tags;
  std::tie(tags.width_m, tags.height_m) = parse_size(options.size);
  const GridSize grid = grid_of(options, {8, 8});
  tags.columns = grid.columns;
  tags.rows = grid.rows;
  return make_tag_sheet(tags);
}

/// Warns of what a print shows too small, or over too many pages.
void warn_of(const PrintedSheet& sheet, const SheetVerbOptions& options) {
  const int pages = page_count(sheet, options.draw.paper);
  constexpr int kMostPages = 12;
  if (options.kind == "board" && pages > 1)
    spdlog::warn(
        "the board is spread over {} pages, which seldom join flat; use smaller fields or "
        "larger paper, or have it printed on one plate",
        pages);
  else if (pages > kMostPages)
    spdlog::warn(
        "the sheet is spread over {} pages, and each joint errs; use larger paper, or have it "
        "printed in one piece: --paper whole",
        pages);
  if (sheet.markers.kind != MarkerKind::apriltag) return;
  // A cloth that fills the middle half of a picture of full HD.
  constexpr double kPicture_px = 960, kRead_px = 15, kPrinted_m = 8e-3;
  const Marker &left = sheet.markers.markers[0], &right = sheet.markers.markers[1];
  const double tag_m = right.s_m - left.s_m;
  const double tag_px = kPicture_px * tag_m / std::max(sheet.width_m, sheet.height_m);
  if (tag_px < kRead_px || tag_m < kPrinted_m)
    spdlog::warn(
        "the tags are {} mm wide: {} px where the cloth fills half of a picture of 1920 px, and "
        "below {} px few are read; use fewer or larger ones",
        significant(1e3 * tag_m, 2), significant(tag_px, 2), kRead_px);
}

/// Returns the line of a recording.yaml that names a sheet's markers.
std::string markers_line(const MarkerSet& markers) {
  if (markers.kind == MarkerKind::dots)
    return "markers: {kind: dots, family: tag36h11, file: markers.csv}  # the family is that of "
           "reference tags beside the cloth";
  return fmt::format("markers: {{kind: apriltag, family: {}, file: markers.csv}}", markers.family);
}

/// Writes the start of a recording of a cloth that carries the sheet.
void write_recording_start(const PrintedSheet& sheet, const fs::path& folder) {
  write_markers(sheet.markers.markers, folder / "markers.csv");
  write_text(
      fmt::format("format: clothfit-recording/1\n"
                  "name: {}\n"
                  "cloth:\n"
                  "  size: [{}, {}]  # m; measure the ruler of the print: 100 mm, or scale this\n"
                  "  mass: null      # kg; weigh the cloth with its print\n"
                  "{}\n"
                  "# time: {{frame_rate: 60}}  # per second, as filmed; left out where a video has "
                  "its own times\n"
                  "cameras: []      # {{name: front, images: VIDEO, file: cameras/front.yaml}}\n"
                  "held: []         # {{at: [0, 0], motion: fixed}}, s to the right and t down\n"
                  "start: released_flat  # or at_rest, unknown\n",
                  sheet.name, sheet.width_m, sheet.height_m, markers_line(sheet.markers)),
      folder / "recording.yaml");
}

int run_sheet(const SheetVerbOptions& options) {
  options.draw.validate();
  const PrintedSheet sheet = make_sheet(options);
  const char* mirrored = options.draw.mirrored ? "_mirrored" : "";
  const fs::path folder = out_folder(options.out, sheet.name + mirrored + ".sheet");
  // What stands there may hold what a person has written since.
  if (fs::exists(folder))
    throw InputError(folder.string(), "is there already", "a folder that does not exist yet",
                     "give another one with --out");
  ResultFolder out(folder, {});
  write_sheet_pdf(sheet, options.draw, out.path() / "sheet.pdf");
  write_sheet_svg(sheet, options.draw, out.path() / "sheet.svg");
  write_sheet_png(sheet, options.draw, out.path() / "sheet.png");
  if (!sheet.markers.markers.empty()) write_recording_start(sheet, out.path());
  out.publish();
  fs::remove(folder / ".clothfit");  // what is in it is the user's from now on
  say("\n{}: {} x {} mm\n\nPrint {} at 100 % (no \"fit to page\"), and measure the ruler: it is "
      "100 "
      "mm long.\n",
      sheet.name, significant(1e3 * sheet.width_m, 6), significant(1e3 * sheet.height_m, 6),
      shown_path(out.final_path() / "sheet.pdf"));
  if (const double dpi = png_dots_per_inch(sheet, options.draw); dpi < options.draw.dots_per_inch)
    say("sheet.png has {} dots per inch, which so large a sheet allows.\n", significant(dpi, 3));
  warn_of(sheet, options);
  if (!sheet.markers.markers.empty())
    say("Markers and the start of a recording: {}\n",
        shown_path(out.final_path() / "recording.yaml"));
  return kExitGood;
}

}  // namespace

void add_sheet_verb(Verb program) {
  const auto options = std::make_shared<SheetVerbOptions>();
  Verb verb = program.add_verb("sheet", "Print markers for a cloth, or a calibration board");
  verb.add_option("kind", &options->kind, "What to print")
      .one_of({"tags", "dots", "board"})
      .shows_default();
  verb.add_option("--size", &options->size, "Cloth, WIDTHxHEIGHT in metres").shows_default();
  verb.add_option(
          "--grid", &options->grid,
          "COLUMNSxROWS: tags (8x8), dots (16 along the longer side), or inner corners of a "
          "board (9x6)")
      .type_name("GRID");
  verb.add_option("--tag", &options->tags.tag_m,
                  "Side of a tag's black border; as large as fits, unless told")
      .is_length();
  verb.add_option("--family", &options->tags.family, "Family of tags").shows_default();
  verb.add_option("--first-id", &options->tags.first_id, "Id of the first tag").shows_default();
  verb.add_option("--square", &options->square_m, "Field of a board (m)")
      .is_length()
      .shows_default();
  verb.add_option("--paper", &options->draw.paper, "Paper of the PDF")
      .one_of(paper_names())
      .shows_default();
  verb.add_flag("--mirror", options->draw.mirrored, "Mirror it, for transfer paper");
  verb.add_option("--dpi", &options->draw.dots_per_inch, "Dots per inch of the PNG")
      .shows_default();
  add_out_option(verb, options->out, "NAME.sheet");
  verb.footer("Example:\n  clothfit sheet tags --size 0.4x0.4 --grid 8x8");
  verb.runs([options] { return run_sheet(*options); });
}

}  // namespace clothfit
