#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vision/print/printed_sheet.h"

namespace clothfit {

struct PageOptions {
  std::string paper = "a4";    ///< a4, a3, letter, or whole: one page as large as it takes
  bool mirrored = false;       ///< for transfer paper, which is laid face down on the cloth
  double dots_per_inch = 300;  ///< of the PNG, 50 to 1200
  void validate() const;       ///< throws InputError
};

/// Papers that can be named.
std::vector<std::string> paper_names();

/// Part of a length that one of several pages shows (mm).
struct PageSpan {
  double begin_mm = 0, end_mm = 0;
};

/// Divides a length, whose sheet begins and ends `margin_mm` from its ends, over pages that show
/// `room_mm`. Pages end between shares of the sheet, and show `kPageOverlap_mm` of their
/// neighbours' part. A share of 0, or one that no page can show whole, is cut anywhere.
std::vector<PageSpan> page_spans(double length_mm, double margin_mm, double share_mm,
                                 double room_mm);
inline constexpr double kPageOverlap_mm = 5;

/// Returns how many pages a PDF of the sheet has.
int page_count(const PrintedSheet& sheet, const std::string& paper);

/// Returns the dots per inch of a PNG: those that are asked for, or fewer on a large sheet.
double png_dots_per_inch(const PrintedSheet& sheet, const PageOptions& options);

/// Each writes the sheet at true scale, PDF and SVG with crop marks at its corners and a ruler of
/// 100 mm, or as long as there is room for: of a PDF on each page. Pages stand upright or lie,
/// whichever takes fewer. Throws InputError where the file cannot be written.
void write_sheet_pdf(const PrintedSheet& sheet, const PageOptions& options,
                     const std::filesystem::path& file);
void write_sheet_svg(const PrintedSheet& sheet, const PageOptions& options,
                     const std::filesystem::path& file);
/// The picture ends at the crop marks: sheet alone, its top left corner at that of the picture.
void write_sheet_png(const PrintedSheet& sheet, const PageOptions& options,
                     const std::filesystem::path& file);

}  // namespace clothfit
