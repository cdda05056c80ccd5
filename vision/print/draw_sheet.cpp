#include "vision/print/draw_sheet.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <string>

#include "data/input_error.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr double kPointsPerMm = 72 / 25.4;
constexpr double kFree_mm = 10;    // around a page, which printers leave white
constexpr double kMargin_mm = 12;  // around a sheet, for crop marks
constexpr double kStrip_mm = 12;   // at the foot, for ruler and words
constexpr double kLine_mm = 0.15;

struct PaperSize {
  const char* name;
  double width_mm, height_mm;
};
constexpr std::array kPapers = {PaperSize{"a4", 210, 297}, PaperSize{"a3", 297, 420},
                                PaperSize{"letter", 215.9, 279.4}};
constexpr const char* kWhole = "whole";

using Surface = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;
using Pen = std::unique_ptr<cairo_t, void (*)(cairo_t*)>;

Pen pen_on(const Surface& surface) {
  return {cairo_create(surface.get()), cairo_destroy};
}

void require(cairo_status_t status, const fs::path& file) {
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw InputError(file.string(),
                   fmt::format("cannot be written: {}", cairo_status_to_string(status)),
                   "a writable place with room on its disk", "give another folder");
}

double width_mm(const PrintedSheet& sheet) {
  return 1e3 * sheet.width_m + 2 * kMargin_mm;
}
double height_mm(const PrintedSheet& sheet) {
  return 1e3 * sheet.height_m + 2 * kMargin_mm;
}

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

/// Takes what Cairo writes into a string. Of a file that it writes itself, Cairo does not tell
/// every failure: a full disk left half a PDF.
cairo_status_t take(void* bytes, const unsigned char* data, unsigned int size) {
  try {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), size);
  } catch (const std::bad_alloc&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

/// Puts the scale into a PNG (its chunk pHYs), which Cairo leaves out: viewers print by it.
void state_scale(std::string& png, double pixels_per_m) {
  constexpr size_t kAfterHeader = 8 + 4 + 4 + 13 + 4;  // signature, and the chunk IHDR
  const std::string scale = big_endian(static_cast<std::uint32_t>(std::lround(pixels_per_m)));
  const std::string chunk = "pHYs" + scale + scale + '\x01';
  const uLong check =
      crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(chunk.size()));
  png.insert(kAfterHeader, big_endian(static_cast<std::uint32_t>(chunk.size() - 4)) + chunk +
                               big_endian(static_cast<std::uint32_t>(check)));
}

/// Fills all that is black with one path, since paths of their own would leave fine lines between
/// neighbours. Units are millimetres from the sheet's corner.
void fill_sheet(cairo_t* pen, const PrintedSheet& sheet) {
  cairo_new_path(pen);
  for (const PrintedRectangle& one : sheet.rectangles) {
    const Eigen::Vector2d low_mm = 1e3 * one.low_m, size_mm = 1e3 * (one.high_m - one.low_m);
    cairo_rectangle(pen, low_mm.x(), low_mm.y(), size_mm.x(), size_mm.y());
  }
  for (const PrintedDisc& disc : sheet.discs) {
    cairo_new_sub_path(pen);
    cairo_arc(pen, 1e3 * disc.centre_m.x(), 1e3 * disc.centre_m.y(), 1e3 * disc.radius_m, 0,
              2 * M_PI);
  }
  cairo_fill(pen);
}

void line(cairo_t* pen, double x0, double y0, double x1, double y1) {
  cairo_move_to(pen, x0, y0);
  cairo_line_to(pen, x1, y1);
  cairo_stroke(pen);
}

void text(cairo_t* pen, double x, double y, const std::string& words) {
  constexpr double kHeight_mm = 3;
  cairo_select_font_face(pen, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(pen, kHeight_mm);
  cairo_move_to(pen, x, y);
  cairo_show_text(pen, words.c_str());
}

/// Draws a ruler of 100 mm, or of 50 where there is less room, with a tick every 10.
void draw_ruler(cairo_t* pen, double x, double y, double room_mm) {
  const int length = room_mm >= 150 ? 100 : room_mm >= 90 ? 50 : 10;
  line(pen, x, y, x + length, y);
  for (int mm = 0; mm <= length; mm += 10) {
    const double tick = mm % 50 == 0 ? 3 : 1.5;
    line(pen, x + mm, y, x + mm, y - tick);
  }
  text(pen, x + length + 2, y, fmt::format("{} mm", length));
}

/// Draws marks beside the corners of a sheet, where it is to be cut.
void draw_crop_marks(cairo_t* pen, double width, double height) {
  constexpr double kOff = 2, kLength = 7;
  for (const double x : {0.0, width})
    for (const double y : {0.0, height}) {
      const double right = x > 0 ? 1 : -1, down = y > 0 ? 1 : -1;
      line(pen, x + right * kOff, y, x + right * (kOff + kLength), y);
      line(pen, x, y + down * kOff, x, y + down * (kOff + kLength));
    }
}

/// Draws the sheet and its marks; the pen's origin is the corner of the margin.
void draw_marked(cairo_t* pen, const PrintedSheet& sheet, bool mirrored) {
  const double width = 1e3 * sheet.width_m, height = 1e3 * sheet.height_m;
  cairo_save(pen);
  cairo_translate(pen, kMargin_mm, kMargin_mm);
  cairo_set_line_width(pen, kLine_mm);
  draw_crop_marks(pen, width, height);
  if (mirrored) {
    cairo_translate(pen, width, 0);
    cairo_scale(pen, -1, 1);
  }
  fill_sheet(pen, sheet);
  cairo_restore(pen);
}

/// Draws ruler and words below a drawing of that height.
void draw_strip(cairo_t* pen, const PrintedSheet& sheet, bool mirrored, double room_mm,
                const std::string& more) {
  cairo_set_line_width(pen, kLine_mm);
  draw_ruler(pen, 0, 5, room_mm);
  text(pen, 0, 9.5,
       fmt::format("{}, {:.6g} x {:.6g} mm{}. Print at 100 %.{}", sheet.name, 1e3 * sheet.width_m,
                   1e3 * sheet.height_m, mirrored ? ", mirrored for transfer paper" : "", more));
}

/// How a sheet is spread over pages.
struct PagePlan {
  double width_mm = 0, height_mm = 0;  ///< of the paper
  std::vector<PageSpan> columns, rows;

  size_t pages() const { return columns.size() * rows.size(); }
};

PagePlan plan_on(double paper_width_mm, double paper_height_mm, const PrintedSheet& sheet) {
  const Eigen::Vector2d bare_mm = 1e3 * sheet.bare_m, share_mm = 1e3 * sheet.share_m;
  return {.width_mm = paper_width_mm,
          .height_mm = paper_height_mm,
          .columns = page_spans(width_mm(sheet), kMargin_mm + bare_mm.x(), share_mm.x(),
                                paper_width_mm - 2 * kFree_mm),
          .rows = page_spans(height_mm(sheet), kMargin_mm + bare_mm.y(), share_mm.y(),
                             paper_height_mm - 2 * kFree_mm - kStrip_mm)};
}

PagePlan plan_pages(const PrintedSheet& sheet, const std::string& paper) {
  const auto found = std::ranges::find(kPapers, paper, &PaperSize::name);
  if (found == kPapers.end())
    return plan_on(width_mm(sheet) + 2 * kFree_mm, height_mm(sheet) + 2 * kFree_mm + kStrip_mm,
                   sheet);
  const PagePlan upright = plan_on(found->width_mm, found->height_mm, sheet);
  const PagePlan lying = plan_on(found->height_mm, found->width_mm, sheet);
  return lying.pages() < upright.pages() ? lying : upright;
}

/// Draws ticks beside what a page shows, where its neighbours' own part begins.
void draw_join_marks(cairo_t* pen, const PageSpan& column, const PageSpan& row, bool left,
                     bool right, bool top, bool bottom) {
  constexpr double kTick = 4, kOff = 1;
  cairo_set_line_width(pen, kLine_mm);
  const double width = column.end_mm - column.begin_mm, height = row.end_mm - row.begin_mm;
  for (const auto& [there, x] :
       {std::pair(left, kPageOverlap_mm), std::pair(right, width - kPageOverlap_mm)})
    if (there) {
      line(pen, x, -kOff - kTick, x, -kOff);
      line(pen, x, height + kOff, x, height + kOff + kTick);
    }
  for (const auto& [there, y] :
       {std::pair(top, kPageOverlap_mm), std::pair(bottom, height - kPageOverlap_mm)})
    if (there) {
      line(pen, -kOff - kTick, y, -kOff, y);
      line(pen, width + kOff, y, width + kOff + kTick, y);
    }
}

void draw_page(cairo_t* pen, const PrintedSheet& sheet, bool mirrored, const PagePlan& plan,
               size_t number) {
  const size_t c = number % plan.columns.size(), r = number / plan.columns.size();
  const PageSpan &column = plan.columns[c], &row = plan.rows[r];
  cairo_save(pen);
  cairo_translate(pen, kFree_mm, kFree_mm);
  cairo_save(pen);
  cairo_rectangle(pen, 0, 0, column.end_mm - column.begin_mm, row.end_mm - row.begin_mm);
  cairo_clip(pen);
  cairo_translate(pen, -column.begin_mm, -row.begin_mm);
  draw_marked(pen, sheet, mirrored);
  cairo_restore(pen);
  draw_join_marks(pen, column, row, c > 0, c + 1 < plan.columns.size(), r > 0,
                  r + 1 < plan.rows.size());
  cairo_translate(pen, 0, plan.height_mm - 2 * kFree_mm - kStrip_mm);
  const std::string place =
      plan.pages() == 1 ? ""
                        : fmt::format(" Page {} of {}: column {}, row {}. Join at the ticks.",
                                      number + 1, plan.pages(), c + 1, r + 1);
  draw_strip(pen, sheet, mirrored, plan.width_mm - 2 * kFree_mm, place);
  cairo_restore(pen);
}

}  // namespace

std::vector<std::string> paper_names() {
  std::vector<std::string> names;
  for (const PaperSize& paper : kPapers) names.emplace_back(paper.name);
  names.emplace_back(kWhole);
  return names;
}

void PageOptions::validate() const {
  const std::vector<std::string> names = paper_names();
  if (std::ranges::find(names, paper) == names.end())
    throw InputError("PageOptions::paper", fmt::format("unknown paper '{}'", paper),
                     "a4, a3, letter or whole");
  if (!(dots_per_inch >= 50 && dots_per_inch <= 1200))
    throw InputError("PageOptions::dots_per_inch", fmt::format("{}", dots_per_inch),
                     "50 to 1200 dots per inch");
}

std::vector<PageSpan> page_spans(double length_mm, double margin_mm, double share_mm,
                                 double room_mm) {
  constexpr double kRounding_mm = 1e-6;
  if (length_mm <= room_mm + kRounding_mm) return {{0, length_mm}};
  // Of a page in the middle of several, both ends show a part of a neighbour; a first or last one
  // shows a margin.
  const double own_mm = room_mm - std::max(margin_mm, kPageOverlap_mm) - kPageOverlap_mm;
  const double shares = share_mm > 0 ? std::floor(own_mm / share_mm + kRounding_mm) : 0;
  const double step_mm = shares >= 1 ? shares * share_mm : own_mm;
  const double sheet_mm = length_mm - 2 * margin_mm;
  const auto count = std::max(1, static_cast<int>(std::ceil(sheet_mm / step_mm - kRounding_mm)));
  std::vector<PageSpan> spans;
  for (int i = 0; i < count; ++i)
    spans.push_back({i == 0 ? 0 : margin_mm + i * step_mm - kPageOverlap_mm,
                     i + 1 == count ? length_mm : margin_mm + (i + 1) * step_mm + kPageOverlap_mm});
  return spans;
}

int page_count(const PrintedSheet& sheet, const std::string& paper) {
  return static_cast<int>(plan_pages(sheet, paper).pages());
}

void write_sheet_pdf(const PrintedSheet& sheet, const PageOptions& options, const fs::path& file) {
  options.validate();
  const PagePlan plan = plan_pages(sheet, options.paper);
  std::string pdf;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(take, &pdf, plan.width_mm * kPointsPerMm,
                                          plan.height_mm * kPointsPerMm),
      cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), file);
  const Pen pen = pen_on(surface);
  cairo_scale(pen.get(), kPointsPerMm, kPointsPerMm);
  for (size_t page = 0; page < plan.pages(); ++page) {
    draw_page(pen.get(), sheet, options.mirrored, plan, page);
    cairo_show_page(pen.get());
  }
  cairo_surface_finish(surface.get());
  require(cairo_surface_status(surface.get()), file);
  write_text(pdf, file);
}

void write_sheet_svg(const PrintedSheet& sheet, const PageOptions& options, const fs::path& file) {
  options.validate();
  std::string svg;
  const Surface surface(cairo_svg_surface_create_for_stream(take, &svg, width_mm(sheet),
                                                            height_mm(sheet) + kStrip_mm),
                        cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), file);
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_MM);
  const Pen pen = pen_on(surface);
  draw_marked(pen.get(), sheet, options.mirrored);
  cairo_translate(pen.get(), kMargin_mm, height_mm(sheet));
  draw_strip(pen.get(), sheet, options.mirrored, 1e3 * sheet.width_m, "");
  cairo_surface_finish(surface.get());
  require(cairo_surface_status(surface.get()), file);
  write_text(svg, file);
}

double png_dots_per_inch(const PrintedSheet& sheet, const PageOptions& options) {
  constexpr double kMostPixels = 12'000;  // a side; 0.6 GB of memory
  return std::min(options.dots_per_inch,
                  kMostPixels * 0.0254 / std::max(sheet.width_m, sheet.height_m));
}

void write_sheet_png(const PrintedSheet& sheet, const PageOptions& options, const fs::path& file) {
  options.validate();
  const double pixels_per_mm = png_dots_per_inch(sheet, options) / 25.4;
  const auto width = static_cast<int>(std::lround(1e3 * sheet.width_m * pixels_per_mm)),
             height = static_cast<int>(std::lround(1e3 * sheet.height_m * pixels_per_mm));
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height),
                        cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), file);
  const Pen pen = pen_on(surface);
  cairo_set_source_rgb(pen.get(), 1, 1, 1);
  cairo_paint(pen.get());
  cairo_set_source_rgb(pen.get(), 0, 0, 0);
  cairo_scale(pen.get(), pixels_per_mm, pixels_per_mm);
  if (options.mirrored) {
    cairo_translate(pen.get(), 1e3 * sheet.width_m, 0);
    cairo_scale(pen.get(), -1, 1);
  }
  fill_sheet(pen.get(), sheet);
  std::string png;
  require(cairo_surface_write_to_png_stream(surface.get(), take, &png), file);
  state_scale(png, 1e3 * pixels_per_mm);
  write_text(png, file);
}

}  // namespace clothfit
