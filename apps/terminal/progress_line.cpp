#include "apps/terminal/progress_line.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "apps/terminal/interrupt.h"

namespace clothfit {
namespace {

constexpr std::chrono::milliseconds kTerminalInterval{100};
constexpr int kLogWidth = 160;

std::string clock_text(long long seconds) {
  return fmt::format("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(std::ceil(seconds));
  if (whole >= 3600) return clock_text(whole);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

int terminal_width(std::FILE* stream) {
  winsize size{};
  const bool known = ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

/// Says whether a stream takes a line at once: a pipe may have lost its reader, or be full.
bool takes_a_line(std::FILE* stream) {
  pollfd asked{.fd = fileno(stream), .events = POLLOUT, .revents = 0};
  return poll(&asked, 1, 0) == 1 && asked.revents == POLLOUT;
}

}  // namespace

std::string progress_text(const Progress& progress, double elapsed_s, int width) {
  const bool total_known = progress.total > 0;
  std::string text = progress.stage;
  if (total_known)
    text += fmt::format("  {:.0f}/{:.0f} {}", progress.done, progress.total, progress.unit);
  else if (progress.done > 0)
    text += fmt::format("  {:.0f} {}", progress.done, progress.unit);

  const double rate = elapsed_s > 0 ? progress.done / elapsed_s : 0;
  if (rate > 0) {
    text += fmt::format("  {:.3g}/s", rate);
    if (total_known) {
      const double left_s = std::max(0.0, progress.total - progress.done) / rate;
      text += fmt::format("  {} left", duration_text(left_s));
    }
  }
  if (!progress.note.empty()) text += "  " + progress.note;

  const auto limit = static_cast<size_t>(std::max(width, 0));
  if (text.size() > limit) {
    size_t end = limit;
    // The text is never cut in the middle of a UTF-8 character.
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    text.resize(end);
  }
  return text;
}

ProgressLine::ProgressLine(std::FILE* stream, std::chrono::seconds log_interval)
    : stream_(stream),
      terminal_(isatty(fileno(stream)) != 0),
      interval_(terminal_ ? Clock::duration(kTerminalInterval) : Clock::duration(log_interval)),
      begin_(Clock::now()),
      stage_begin_(begin_),
      last_shown_(begin_) {}

ProgressLine::~ProgressLine() {
  if (dirty_) {
    std::fputs("\r\033[K", stream_);
    std::fflush(stream_);
  }
}

void ProgressLine::show(const Progress& progress) {
  const Clock::time_point now = Clock::now();
  const bool is_new_stage = progress.stage != stage_;
  if (is_new_stage) {
    stage_ = progress.stage;
    stage_begin_ = now;
  }
  // A terminal shows a new stage at once; a log would fill with stages of a moment.
  if (now - last_shown_ < interval_ && !(terminal_ && is_new_stage)) return;
  last_shown_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - stage_begin_).count();
  if (terminal_) {
    fmt::print(stream_, "\r\033[K{}",
               progress_text(progress, elapsed_s, terminal_width(stream_) - 1));
    dirty_ = true;
  } else if (takes_a_line(stream_)) {
    const auto since_begin = std::chrono::duration_cast<std::chrono::seconds>(now - begin_);
    fmt::print(stream_, "{}  {}\n", clock_text(since_begin.count()),
               progress_text(progress, elapsed_s, kLogWidth));
  }
  std::fflush(stream_);
}

ProgressCallback watch(ProgressLine& line) {
  return [&line](const Progress& progress) {
    line.show(progress);
    return !interrupted();
  };
}

}  // namespace clothfit
