#pragma once

#include <filesystem>
#include <string>

#include "data/output_folder.h"

namespace clothfit {

/// A study's results, and the journal that keeps its finished pieces until the results are there.
/// Without a journal of the user's choice it lies beside the results and goes with success.
class ResumableRun {
 public:
  /// `out` and `journal` are as asked for, or empty. `pieces` names what the journal keeps in
  /// messages, "trials". Throws InputError as OutputFolder does.
  ResumableRun(const std::filesystem::path& out, const std::string& default_out,
               const std::filesystem::path& journal, std::string pieces);

  const std::filesystem::path& journal() const { return journal_; }
  /// The folder that results are written to.
  const std::filesystem::path& folder() const { return out_.path(); }

  /// Throws Cancelled, which says how to go on.
  [[noreturn]] void cancel() const;
  /// Moves the results into place and removes a journal of its own. Throws Cancelled where the user
  /// asked to stop meanwhile.
  void publish();
  /// Prints where the report lies.
  void print_report_path() const;

 private:
  OutputFolder out_;
  bool own_journal_;
  std::filesystem::path journal_;
  std::string pieces_;
};

}  // namespace clothfit
