#include "apps/report/fit/notices.h"

#include <fmt/format.h>

#include "apps/report/page/html.h"

namespace clothfit {
namespace {

struct Look {
  const char* name;  ///< of the style
  const char* sign;  ///< so that it does not rest on colour alone
};

Look look_of(Notice notice) {
  switch (notice) {
    case Notice::good:
      return {"good", "✓"};
    case Notice::care:
      return {"care", "!"};
    case Notice::lacks:
      return {"lacks", "?"};
    case Notice::bad:
      return {"bad", "✗"};
  }
  return {"care", "!"};
}

}  // namespace

std::string notice_box(Notice notice, const std::string& sentence, const std::string& html_below) {
  const Look look = look_of(notice);
  return fmt::format(
      "<div class=\"verdict {}\"><span class=\"sign\" aria-hidden=\"true\">{}</span>"
      "<div><strong>{}</strong>\n{}</div></div>\n",
      look.name, look.sign, escape_xml(sentence), html_below);
}

std::string warnings_box(const Findings& warnings) {
  if (warnings.empty()) return "";
  std::string list = "<ul>\n";
  for (const Finding& warning : warnings)
    list += fmt::format(
        "<li>{}. Expected: {}.{}</li>\n", escape_xml(warning.found), escape_xml(warning.expected),
        warning.remedy.empty() ? "" : " Remedy: " + escape_xml(warning.remedy) + ".");
  return notice_box(Notice::care, "The recording may not be what it says it is", list + "</ul>\n");
}

}  // namespace clothfit
