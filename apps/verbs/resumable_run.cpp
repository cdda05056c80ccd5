#include "apps/verbs/resumable_run.h"

#include <fmt/format.h>

#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/say.h"
#include "apps/verbs/verb.h"

namespace clothfit {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> with_path(std::vector<fs::path> paths, const fs::path& path) {
  paths.push_back(path);
  return paths;
}

}  // namespace

void add_journal_options(Verb& verb, std::filesystem::path& journal, bool& resume,
                         const std::string& pieces) {
  verb.add_option("--journal", &journal,
                  "File that keeps finished " + pieces +
                      ", and stays (default: beside the results, gone with success)")
      .shapes_no_result()
      .type_name("FILE");
  verb.add_flag("--resume", resume, "Go on where the journal ends").shapes_no_result();
}

ResumableRun::ResumableRun(const fs::path& out, const std::string& default_out,
                           const fs::path& journal, std::vector<fs::path> inputs,
                           const std::string& ending)
    : out_(out_folder(out, default_out), with_path(std::move(inputs), journal)),
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
  say("Report: {}\n", shown_path(out_.final_path() / "report.html"));
}

}  // namespace clothfit
