#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/jobs/journal.h"

namespace clothfit {

/// One piece of work: it makes a payload of bytes from its index and its seed alone. It therefore
/// does not matter who does it, when, or on which machine. The seed is derived_seed(run seed,
/// index). Several are at work at once.
using Work = std::function<std::string(int index, std::uint64_t seed)>;

struct ExecuteOptions {
  int threads = 0;              ///< >= 0; 0: as many as the machine has
  unsigned long long seed = 1;  ///< seed of the run
  std::string unit = "trials";  ///< name of the pieces in progress reports
  /// Throws for a payload that this run cannot have made of a piece. Those of a journal are asked
  /// before any piece is done.
  std::function<void(int index, const std::string& payload)> accept = {};
};

enum class ExecuteStop { not_run, finished, cancelled };

struct ExecuteResult {
  ExecuteStop stop = ExecuteStop::not_run;
  std::string message;  ///< one line for a person
  /// Payloads by index. Empty when cancelled, because chance then decides which pieces are
  /// finished; these are in the journal.
  std::vector<std::string> payloads;
  int resumed = 0;    ///< pieces that the journal held
  int performed = 0;  ///< pieces done by this call
  bool usable() const { return stop == ExecuteStop::finished; }
};

/// Asks `accept` for the payload that a journal holds of a piece. Throws InputError, with the
/// journal's name, where it throws.
void accept_record(const Journal& journal, int index,
                   const std::function<void(const std::string& payload)>& accept);

/// Does the pieces 0 ... count - 1. The payloads are the same bytes for any number of threads, and
/// whether or not a journal held some of them.
///
/// Pieces are handed out in the order of their indices, each thread doing one at a time. A piece
/// may itself use oneTBB. While it waits for its own tasks its thread does nothing for other
/// pieces. With one thread all of it stays on the calling thread. Threads for which no piece is
/// left help those at work.
///
/// When a piece throws, no more are handed out, those at work are finished, and the exception of
/// the lowest index is rethrown. This is the exception that one thread alone would meet, for all
/// pieces before it were handed out before it. An exception of `journal` or `progress` counts as
/// that of the piece before it.
///
/// `journal`, when given, holds pieces that are done already and receives those done now; its key
/// must name the seed. `progress`, when given, is told at the start and after each piece, from the
/// threads, one at a time. When it returns false, pieces at work are finished and kept.
ExecuteResult execute(int count, const Work& work, const ExecuteOptions& options = {},
                      Journal* journal = nullptr, const ProgressCallback& progress = {});

}  // namespace clothfit
