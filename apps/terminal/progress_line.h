#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "data/progress.h"

namespace clothfit {

/// Writes one line for a person, at most `width` characters (bytes of UTF-8 aside):
///
///   refine  240/1000 evaluations  12.3/s  1:02 left  cost 0.41
///
/// `elapsed_s` is the time since the stage began. Rate and time left appear once they are known.
std::string progress_text(const Progress& progress, double elapsed_s, int width);

/// Shows progress on one line of a terminal. The line is wiped when the object goes, so that
/// messages and tables start on a clean line. Elsewhere, as in a log file, it writes at most a line
/// each `log_interval`, which begins with the time since the object was made:
///
///   0:02:00  refine  240/1000 evaluations  12.3/s  1:02 left  cost 0.41
class ProgressLine {
 public:
  explicit ProgressLine(std::FILE* stream = stderr,
                        std::chrono::seconds log_interval = std::chrono::minutes(1));
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const Progress& progress);

 private:
  using Clock = std::chrono::steady_clock;

  std::FILE* stream_;
  bool terminal_;
  Clock::duration interval_;
  bool dirty_ = false;
  std::string stage_;
  Clock::time_point begin_;
  Clock::time_point stage_begin_;
  Clock::time_point last_shown_;
};

/// Shows progress on `line` and asks to stop once the user did. `line` must outlive the callback.
ProgressCallback watch(ProgressLine& line);

}  // namespace clothfit
