#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "data/finding.h"
#include "data/recording.h"

namespace clothfit {

/// Collects what the checks of a recording find.
class CheckList {
 public:
  explicit CheckList(const Recording& recording)
      : file_((recording.folder / "recording.yaml").string()) {}

  void pass(const std::string& check, std::string found) {
    findings_.push_back({.check = check,
                         .state = FindingState::passed,
                         .found = std::move(found),
                         .where = "",
                         .expected = "",
                         .remedy = ""});
  }
  void warn(const std::string& check, std::string found, std::string expected,
            std::string remedy = "") {
    add(check, FindingState::warning, file_, std::move(found), std::move(expected),
        std::move(remedy));
  }
  void refuse(const std::string& check, std::string found, std::string expected,
              std::string remedy = "") {
    add(check, FindingState::refused, file_, std::move(found), std::move(expected),
        std::move(remedy));
  }
  /// Adds a finding about another file, or a line of it.
  void add(const std::string& check, FindingState state, const std::string& where,
           std::string found, std::string expected, std::string remedy) {
    findings_.push_back({.check = check,
                         .state = state,
                         .found = std::move(found),
                         .where = where,
                         .expected = std::move(expected),
                         .remedy = std::move(remedy)});
  }

  void add(Finding finding) { findings_.push_back(std::move(finding)); }

  const std::string& file() const { return file_; }
  const Findings& findings() const { return findings_; }
  bool warns_of(const std::string& check) const {
    return std::ranges::any_of(findings_, [&](const Finding& finding) {
      return finding.check == check && finding.state == FindingState::warning;
    });
  }
  bool refused() const { return !with_state(findings_, FindingState::refused).empty(); }

 private:
  std::string file_;
  Findings findings_;
};

}  // namespace clothfit
