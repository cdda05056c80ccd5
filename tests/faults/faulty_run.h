#pragma once

#include <cerrno>
#include <filesystem>
#include <functional>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "tests/apps/program_run.h"

namespace clothfit::test {

/// A kind of calls of the system, as fail_once.cpp names it, and the error with which one fails.
struct FaultKind {
  std::string name;
  int error_number = EIO;
  int every = 1;  ///< of how many calls one is let fail
};

/// What calls are tried: every kind of them that a run makes.
const std::vector<FaultKind>& fault_kinds();

/// One call that fails: the n-th of its kind, from 1.
struct Fault {
  FaultKind kind;
  int number = 0;
  bool stays = false;  ///< later calls of the kind fail too
  std::string also;    ///< a further fault, as fail_once.cpp reads it
};

/// A command of the program whose calls are let fail one by one.
struct FaultyCommand {
  std::string name;
  /// Lays the inputs into the folder that the command is run in.
  std::function<void(const std::filesystem::path&)> prepare;
  std::vector<std::string> words;  ///< without --out
  std::string kept;                ///< the journal or checkpoint that --resume goes on from
  bool writes = true;              ///< leaves a result at --out
  bool replaces = true;            ///< an older one
};

/// Prints its name, as the name of a test.
inline void PrintTo(const FaultyCommand& command, std::ostream* out) {
  *out << command.name;
}

/// Runs a command again and again in one folder, with faults, and judges its results.
class FaultyRuns {
 public:
  explicit FaultyRuns(const FaultyCommand& command);
  ~FaultyRuns();

  /// Returns how many calls of each kind a run without faults makes.
  const std::map<std::string, int>& calls() const { return calls_; }
  /// Lets one call fail; expects that the run says so or works all the same, that the result is
  /// the older one or the whole new one, that nothing else is left or the next run removes it, and
  /// that a run which is resumed ends as one without faults. `older`: a result stands there before.
  void expect_honest(const Fault& fault, bool older);

 private:
  using Files = std::map<std::string, std::string>;  ///< name -> bytes

  void lay_out(bool older) const;
  /// Runs the command and notes which call failed; returns also how many calls were made.
  ProgramRun run(const std::string& fault, std::map<std::string, int>* calls, bool resume = false);
  void judge(const ProgramRun& done, bool older, const Fault& fault);
  void judge_message(const ProgramRun& done) const;
  void judge_resumed();
  std::vector<std::string> hidden_names() const;

  FaultyCommand command_;
  std::filesystem::path root_, here_, log_;
  Files inputs_, older_, whole_;
  std::map<std::string, int> calls_;
  std::string failed_path_;  ///< of the last run
};

}  // namespace clothfit::test
