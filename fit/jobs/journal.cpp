#include "fit/jobs/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "data/input_error.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/sync_to_disk.h"
#include "fit/jobs/checksum.h"
#include "fit/jobs/journal_key.h"

namespace clothfit {
namespace {

constexpr std::string_view kFormat = "clothfit-journal/";
constexpr std::string_view kVersionLine = "clothfit-journal/1\n";
constexpr std::string_view kRecord = "record ";
constexpr std::chrono::seconds kSyncInterval{1};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& problem,
                         int error_number) {
  throw InputError(file.string(), problem + ": " + std::strerror(error_number),
                   "a journal on a disk with room that can be written and locked");
}

/// Opens the journal for this process alone.
int open_locked(const std::filesystem::path& file, JournalStart start) {
  const int fresh_only = start == JournalStart::fresh ? O_EXCL : 0;
  const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | fresh_only, 0666);
  if (descriptor < 0 && errno == EEXIST && fresh_only != 0)
    throw InputError(file.string(), "exists", "a new file, for this run starts from scratch",
                     "go on with it by JournalStart::resume, or remove it");
  if (descriptor < 0) refuse(file, "cannot be opened", errno);
  struct stat status {};
  if (fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(descriptor);
    throw InputError(file.string(), "is no file of records but a device or a pipe",
                     "a file on a disk", "name another file");
  }
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    const int error_number = errno;
    close(descriptor);
    if (error_number != EWOULDBLOCK) refuse(file, "cannot be locked", error_number);
    throw InputError(file.string(), "is being written by another process",
                     "one run at a time for each journal", "wait for that run, or stop it");
  }
  return descriptor;
}

std::string read_all(const std::filesystem::path& file, int descriptor) {
  std::string bytes;
  std::array<char, 1 << 16> block;
  for (;;) {
    const ssize_t count =
        pread(descriptor, block.data(), block.size(), static_cast<off_t>(bytes.size()));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse(file, "cannot be read", errno);
    if (count == 0) return bytes;
    bytes.append(block.data(), static_cast<size_t>(count));
  }
}

/// Returns the first line of a record that begins at byte `begin`.
std::string record_head(size_t begin, int index, std::string_view payload) {
  const std::string what = fmt::format("{}{} {}", kRecord, index, payload.size());
  const std::uint64_t sum = checksum(payload, checksum(fmt::format("{} at {}\n", what, begin)));
  return fmt::format("{} {:016x}\n", what, sum);
}

struct Record {
  int index = 0;
  std::string_view payload;
  size_t end = 0;  ///< the byte behind the record
};

/// Returns the record that begins at byte `begin`, where there is an intact one.
std::optional<Record> record_at(std::string_view bytes, size_t begin) {
  std::string_view rest = bytes.substr(begin);
  if (!rest.starts_with(kRecord)) return std::nullopt;
  const char* const end = rest.data() + rest.size();
  int index = -1;
  size_t length = 0;
  const auto [after_index, no_index] = std::from_chars(rest.data() + kRecord.size(), end, index);
  if (no_index != std::errc() || index < 0 || after_index == end) return std::nullopt;
  if (std::from_chars(after_index + 1, end, length).ec != std::errc()) return std::nullopt;

  const size_t head = std::min(rest.find('\n'), rest.size() - 1) + 1;
  if (rest.size() - head <= length || rest[head + length] != '\n') return std::nullopt;
  const std::string_view payload = rest.substr(head, length);
  if (rest.substr(0, head) != record_head(begin, index, payload)) return std::nullopt;
  return Record{.index = index, .payload = payload, .end = begin + head + length + 1};
}

/// Says why a run cannot go on with a file whose first bytes are not its header.
[[noreturn]] void refuse_header(const std::filesystem::path& file, std::string_view bytes,
                                const std::string& key) {
  const std::string remedy = "name another file, or remove this one";
  if (!bytes.starts_with(kFormat))
    throw InputError(file.string(), 1, "is no journal of a run",
                     fmt::format("`{}1` in the first line", kFormat), remedy);
  if (!bytes.starts_with(kVersionLine))
    throw InputError(
        file.string(), 1,
        fmt::format("is a journal of version `{}`", shown_text(bytes.substr(0, bytes.find('\n')))),
        fmt::format("`{}1`", kFormat), remedy);
  bytes.remove_prefix(kVersionLine.size());
  const std::string_view other = bytes.substr(0, bytes.find('\n'));
  throw InputError(file.string(), 2,
                   fmt::format("belongs to another run, of `{}`", differing_fields(other, key)),
                   fmt::format("this run is of `{}`", differing_fields(key, other)),
                   "give the options that it was started with, or another file");
}

}  // namespace

Journal::Journal(Opened opened)
    : file_(std::move(opened.file)),
      descriptor_(opened.descriptor),
      synced_at_(std::chrono::steady_clock::now()) {}

Journal::Journal(const std::filesystem::path& file, const std::string& key, JournalStart start)
    : Journal(reading(file, [&] {
        // The copy, which takes memory, comes before what has to be closed again.
        Opened opened{.file = file};
        opened.descriptor = open_locked(file, start);
        return opened;
      })) {
  assert(key.find('\n') == std::string::npos);
  reading(file_, [&] { open_records(key); });
}

void Journal::open_records(const std::string& key) {
  const std::string header = fmt::format("{}{}\n", kVersionLine, key);
  const std::string bytes = read_all(file_, descriptor_);
  if (bytes.starts_with(header)) {
    read_records(bytes, header.size());
    return;
  }
  // A file that holds only a part of the header was killed before it did anything.
  if (!header.starts_with(bytes)) refuse_header(file_, bytes, key);
  write_at_end(header);
  sync();
  const std::filesystem::path folder = file_.has_parent_path() ? file_.parent_path() : ".";
  if (const int error_number = sync_to_disk(folder))
    refuse(file_, "cannot be synced", error_number);
}

Journal::~Journal() {
  // A caller that asks for certainty has it from the checksums of the next run.
  static_cast<void>(fdatasync(descriptor_));
  close(descriptor_);
}

void Journal::read_records(std::string_view bytes, size_t begin) {
  end_ = begin;
  for (size_t at = begin; at < bytes.size();) {
    if (const std::optional<Record> record = record_at(bytes, at)) {
      if (at != end_) ++damaged_places_;
      finished_.emplace(record->index, record->payload);
      at = end_ = record->end;
    } else {
      at = std::min(bytes.find(kRecord, at + 1), bytes.size());
    }
  }
  if (end_ < bytes.size() && ftruncate(descriptor_, static_cast<off_t>(end_)) != 0)
    refuse(file_, "its torn last record cannot be cut off", errno);
}

void Journal::append(int index, std::string_view payload) {
  assert(index >= 0 && !finished_.contains(index));
  std::string record = record_head(end_, index, payload);
  record += payload;
  record += '\n';
  write_at_end(record);
  finished_.emplace(index, payload);
  // Syncing takes milliseconds, more than short pieces do.
  if (std::chrono::steady_clock::now() - synced_at_ >= kSyncInterval) sync();
}

void Journal::write_at_end(std::string_view bytes) {
  size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = pwrite(descriptor_, bytes.data() + written, bytes.size() - written,
                                 static_cast<off_t>(end_ + written));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error_number = errno;
      // Where even this fails, the next run cuts the torn record off.
      static_cast<void>(!ftruncate(descriptor_, static_cast<off_t>(end_)));
      refuse(file_, "cannot be written", error_number);
    }
    written += static_cast<size_t>(count);
  }
  end_ += bytes.size();
}

void Journal::sync() {
  // Some files, such as those in memory, cannot be synced and say so.
  if (fdatasync(descriptor_) != 0 && errno != EINVAL) refuse(file_, "cannot be synced", errno);
  synced_at_ = std::chrono::steady_clock::now();
}

}  // namespace clothfit
