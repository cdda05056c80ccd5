#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/terminal/result_folder.h"
#include "apps/verbs/verb.h"

namespace clothfit {

/// Adds --journal and --resume to a verb. `pieces` are what its journal keeps: "fits".
void add_journal_options(Verb& verb, std::filesystem::path& journal, bool& resume,
                         const std::string& pieces);

/// Keeps a study's results, and its journal of finished pieces until the results are there. A
/// journal that the user does not name lies beside the results and goes with success.
class ResumableRun {
 public:
  /// `out` and `journal` are as asked for, or empty. A journal of its own has the name of the
  /// results with `ending`. Throws InputError as ResultFolder does.
  /// `inputs` are what the study reads.
  ResumableRun(const std::filesystem::path& out, const std::string& default_out,
               const std::filesystem::path& journal, std::vector<std::filesystem::path> inputs = {},
               const std::string& ending = ".journal");

  const std::filesystem::path& journal() const { return journal_; }
  /// Returns the folder that results are written to.
  const std::filesystem::path& folder() const { return out_.path(); }

  /// Throws Cancelled, which says how to go on with what is kept: "9 of 22 trials".
  [[noreturn]] void cancel(const std::string& kept) const;
  /// Moves the results into place and removes a journal of its own. Throws Cancelled where the user
  /// asked to stop meanwhile.
  void publish();
  /// Prints where the report lies.
  void print_report_path() const;

 private:
  ResultFolder out_;
  bool own_journal_;
  std::filesystem::path journal_;
};

}  // namespace clothfit
