#include "apps/verbs/resumable_run.h"

#include <fmt/format.h>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/verbs/verb.h"

namespace clothfit {

namespace fs = std::filesystem;

ResumableRun::ResumableRun(const fs::path& out, const std::string& default_out,
                           const fs::path& journal, const std::string& ending)
    : out_(out_folder(out, default_out)),
      own_journal_(journal.empty()),
      journal_(own_journal_ ? fs::path(out_.final_path().string() + ending) : journal) {}

void ResumableRun::cancel(const std::string& kept) const {
  throw Cancelled(fmt::format("{} are kept in {}: the same command with --resume goes on", kept,
                              shown_path(journal_)));
}

void ResumableRun::publish() {
  if (interrupted()) cancel("all pieces");
  out_.publish();
  if (own_journal_) fs::remove_all(journal_);
}

void ResumableRun::print_report_path() const {
  fmt::print("Report: {}\n", shown_path(out_.final_path() / "report.html"));
}

}  // namespace clothfit
