#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/terminal/table.h"

namespace clothfit {

/// Makes text safe inside an element or a double-quoted attribute of HTML and SVG.
std::string escape_xml(std::string_view text);

/// Writes a number's text as print sets it: a true minus sign, exponents as powers of ten. Escaped.
std::string typeset_number(const std::string& text);

/// Writes the table as HTML; columns whose cells are all numbers stand right.
std::string html_table(const Table& table, const std::string& caption);

/// Write parts of a page; nothing where the content is empty. Titles, texts and captions are plain
/// text.
std::string section(const std::string& title, const std::string& content);
std::string paragraph(const std::string& text);
std::string figure(const std::string& svg, const std::string& caption);
/// Returns content behind a line that opens it.
std::string folded(const std::string& line, const std::string& content);

/// Returns `bytes` as a data: URI.
std::string data_uri(std::string_view media_type, std::string_view bytes);

/// Writes a whole page: head with the style sheet, `body` inside <main>.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace clothfit
