#include "apps/report/page/html.h"

#include <fmt/format.h>

#include <cstdint>

#include "apps/terminal/number_text.h"

namespace clothfit {
namespace {

// The page is paper-like: one column of text, figures as wide as it, numbers in tabular figures.
constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --paper: #fff; --ink: #1c1e21; --soft: #565c66; --rule: #d4d8de; --quiet: #f4f5f7;
  --good: #1b7a3d; --good-back: #eef8f1; --care: #8a6100; --care-back: #fff8e6;
  --lacks: #9a4b00; --lacks-back: #fff2e5; --bad: #a32020; --bad-back: #fdeeee; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 "Source Sans 3", "Helvetica Neue", Arial, "Liberation Sans", "DejaVu Sans", sans-serif; }
main { max-width: 62rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; overflow-wrap: break-word; }
main > p, section > p, dl, ol, .verdict p, .verdict li { max-width: 48rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; padding-top: .8rem; border-top: 1px solid var(--rule); }
h3, h4 { margin: 1.2rem 0 .3rem; }
p { margin: .5rem 0 .8rem; }
.meta { color: var(--soft); margin: 0 0 1.2rem; }
.verdict { display: flex; gap: 1rem; border-left: 6px solid var(--tone); background: var(--back); padding: .9rem 1.1rem; margin: 1.2rem 0; }
.verdict > div { min-width: 0; flex: 1; }
.verdict .sign { font-size: 1.7rem; line-height: 1.2; font-weight: 700; color: var(--tone); width: 1.4rem; text-align: center; }
.verdict strong { font-size: 1.08rem; }
.verdict > div > strong { display: block; margin-bottom: .3rem; }
.verdict ul { margin: .2rem 0 .6rem; padding-left: 1.2rem; }
.good { --tone: var(--good); --back: var(--good-back); } .care { --tone: var(--care); --back: var(--care-back); }
.lacks { --tone: var(--lacks); --back: var(--lacks-back); } .bad { --tone: var(--bad); --back: var(--bad-back); }
.answer { display: grid; grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); gap: 1.6rem; }
.answer .found { margin: .2rem 0 .6rem; }
.wide { overflow-x: auto; }
.pair { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); gap: 1rem; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; font-variant-numeric: tabular-nums; margin: .4rem 0 1.2rem; }
caption { text-align: left; color: var(--soft); padding: 0 0 .4rem; }
th, td { padding: .32rem .7rem .32rem 0; text-align: left; vertical-align: top; }
thead th { border-bottom: 1.5px solid var(--ink); font-weight: 600; vertical-align: bottom; }
tbody td, tbody th { border-bottom: 1px solid var(--rule); font-weight: 400; }
.number { text-align: right; } td.number { white-space: nowrap; }
td:last-child, th:last-child { padding-right: 0; }
.matrix { width: auto; } .matrix td, .matrix th { padding: .25rem .45rem; } .matrix td { color: #1c1e21; }
.matrix thead th { writing-mode: vertical-rl; transform: rotate(180deg); text-align: left; border-bottom: 0; border-top: 1.5px solid var(--ink); padding: .45rem .25rem; }
figure { margin: 1rem 0 1.6rem; }
figure svg { display: block; width: 100%; height: auto; background: #fff; }
figcaption { color: var(--soft); font-size: .92rem; margin-top: .4rem; }
details { margin: .4rem 0 1rem; } summary { cursor: pointer; font-weight: 600; padding: .2rem 0; }
pre { background: var(--quiet); padding: .7rem .9rem; overflow-x: auto; white-space: pre-wrap; overflow-wrap: anywhere; font: .88rem/1.5 "DejaVu Sans Mono", Menlo, Consolas, monospace; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .35rem 1.2rem; }
dt { font-weight: 600; } dd { margin: 0; }
ol.stages { padding-left: 1.4rem; font-size: .92rem; }
@media (max-width: 46rem) {
  main { padding: 1.2rem .9rem 3rem; } h1 { font-size: 1.5rem; }
  .verdict { flex-direction: column; gap: .2rem; } .verdict .sign { text-align: left; }
  .pair, .answer { grid-template-columns: minmax(0, 1fr); }
  dl { grid-template-columns: 1fr; } dd { margin-bottom: .5rem; }
  figure svg text { font-size: 15px; }
  table.rows thead { display: none; }
  table.rows, table.rows tbody, table.rows tr, table.rows th, table.rows td, table.rows caption { display: block; }
  table.rows tr { border-bottom: 1px solid var(--rule); padding: .4rem 0; }
  table.rows th, table.rows td { border: 0; padding: .05rem 0; text-align: left; white-space: normal; }
  table.rows tbody th { font-weight: 600; }
  table.rows td::before { content: attr(data-name) ": "; color: var(--soft); }
  table.rows td:empty { display: none; }
}
@media (prefers-color-scheme: dark) {
  :root { --paper: #16181b; --ink: #e6e8eb; --soft: #a7adb7; --rule: #3a3f47; --quiet: #22262b;
    --good: #6fd08c; --good-back: #14261a; --care: #e7c15c; --care-back: #2a2413;
    --lacks: #f0a35e; --lacks-back: #2b1f13; --bad: #f08a8a; --bad-back: #2d1717; }
  a { color: #8ab8ff; }
}
@media print {
  :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --rule: #bbb; --quiet: #f4f5f7;
    --good: #1b7a3d; --care: #8a6100; --lacks: #9a4b00; --bad: #a32020;
    --good-back: #fff; --care-back: #fff; --lacks-back: #fff; --bad-back: #fff; }
  body { font-size: 10pt; } main { max-width: none; padding: 0; }
  h2 { break-after: avoid; } figure, tr, .verdict { break-inside: avoid; }
  .wide { overflow: visible; } table { font-size: 8pt; } td.number { white-space: normal; }
  details::details-content { content-visibility: visible; block-size: auto; }
}
)";

}  // namespace

std::string escape_xml(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string typeset_number(const std::string& text) {
  if (text == "-") return "–";
  std::string mantissa = text;
  std::string power;
  const size_t e = text.find('e');
  if (e != std::string::npos) {
    mantissa = text.substr(0, e);
    const int exponent = std::atoi(text.c_str() + e + 1);
    power = fmt::format(" × 10<sup>{}{}</sup>", exponent < 0 ? "−" : "", std::abs(exponent));
  }
  const bool negative = !mantissa.empty() && mantissa.front() == '-';
  return (negative ? "−" + escape_xml(mantissa.substr(1)) : escape_xml(mantissa)) + power;
}

std::string html_table(const Table& table, const std::string& caption) {
  constexpr size_t kBrief = 28;  // letters: a rate with its bounds stays on a line
  std::vector<bool> number(table.header.size(), true), brief(table.header.size(), true);
  for (const std::vector<std::string>& row : table.rows) {
    for (size_t c = 0; c < row.size(); ++c) {
      number[c] = number[c] && shows_number(row[c]);
      brief[c] = brief[c] && row[c].size() <= kBrief;
    }
  }
  const auto mark = [&](size_t c) {
    return number[c] ? " class=\"number\"" : brief[c] ? " class=\"brief\"" : "";
  };

  std::string html = "<div class=\"wide\"><table class=\"rows\">";
  if (!caption.empty()) html += "<caption>" + escape_xml(caption) + "</caption>";
  html += "<thead><tr>";
  for (size_t c = 0; c < table.header.size(); ++c)
    html += fmt::format("<th scope=\"col\"{}>{}</th>", mark(c), escape_xml(table.header[c]));
  html += "</tr></thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : table.rows) {
    html += "<tr>";
    for (size_t c = 0; c < row.size(); ++c) {
      const char* tag = c == 0 ? "th" : "td";
      // On a narrow page every cell stands on a line of its own, behind the name of its column.
      const std::string name = c == 0 || c >= table.header.size()
                                   ? " scope=\"row\""
                                   : fmt::format(" data-name=\"{}\"", escape_xml(table.header[c]));
      html += fmt::format("<{}{}{}>{}</{}>", tag, name, mark(c),
                          shows_number(row[c]) ? typeset_number(row[c]) : escape_xml(row[c]), tag);
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string data_uri(std::string_view media_type, std::string_view bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string uri = fmt::format("data:{};base64,", media_type);
  uri.reserve(uri.size() + bytes.size() * 4 / 3 + 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t k) -> std::uint32_t {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U;
    };
    const std::uint32_t word = byte(0) << 16U | byte(1) << 8U | byte(2);
    const size_t given = bytes.size() - i;
    uri += kDigits[word >> 18U & 63U];
    uri += kDigits[word >> 12U & 63U];
    uri += given > 1 ? kDigits[word >> 6U & 63U] : '=';
    uri += given > 2 ? kDigits[word & 63U] : '=';
  }
  return uri;
}

std::string section(const std::string& title, const std::string& content) {
  if (content.empty()) return "";
  return fmt::format("<section>\n<h2>{}</h2>\n{}</section>\n", escape_xml(title), content);
}

std::string folded(const std::string& line, const std::string& content) {
  if (content.empty()) return "";
  return fmt::format("<details><summary>{}</summary>\n{}</details>\n", escape_xml(line), content);
}

std::string paragraph(const std::string& text) {
  return fmt::format("<p>{}</p>\n", escape_xml(text));
}

std::string figure(const std::string& svg, const std::string& caption) {
  if (svg.empty()) return "";
  return fmt::format("<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n", svg,
                     escape_xml(caption));
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n"
      "</html>\n",
      escape_xml(title), kStyle, body);
}

}  // namespace clothfit
