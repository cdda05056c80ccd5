#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace clothfit {

enum class JournalStart {
  fresh,  ///< the file must not exist yet
  resume  ///< goes on with the file that is there; begins one where none is
};

/// The finished pieces of a long run in an append-only file. A run that was killed loses at most
/// the pieces at work. Layout: a line with the version, a line with the key, then for each piece,
/// in the order in which they were finished,
///
///   record INDEX LENGTH CHECKSUM\n PAYLOAD \n
///
/// Payloads hold any bytes. The checksum covers the record's place in the file too, so that nothing
/// inside a payload passes for a record.
///
/// A record counts where its checksum holds. Bytes behind the last such record were torn while they
/// were written, and the file is cut there. A record damaged before that is left out, and its piece
/// has to be done again. Each record proves itself, so one spoiled sector need not cost the days in
/// the others. A damaged header is refused, because it says to which run the records belong.
///
/// A record is with the system when `append` returns: it survives the end of the program. It is on
/// disk at most a second later, or with the record after that: it then survives a power cut. A
/// journal belongs to one process at a time, and there to one thread at a time.
class Journal {
 public:
  /// Opens the file. `key` is one line that names all that determines the payloads, such as options
  /// and seed (fit/jobs/journal_key.h). The number of pieces need not be in it, so that a run can
  /// be prolonged. Throws InputError where the file exists and `start` is `fresh`, belongs to
  /// another key, is no journal, is written by another process, or cannot be read and written.
  Journal(const std::filesystem::path& file, const std::string& key, JournalStart start);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  const std::filesystem::path& file() const { return file_; }
  /// Returns payloads by index: those found and those appended.
  const std::map<int, std::string>& finished() const { return finished_; }
  /// Returns at how many places records before the last intact one are damaged.
  int damaged_places() const { return damaged_places_; }

  /// Notes the payload of a piece that is not among the finished ones. Throws InputError when it
  /// cannot be written; the journal's content is then as before.
  void append(int index, std::string_view payload);

 private:
  struct Opened {
    std::filesystem::path file;
    int descriptor = -1;
  };
  explicit Journal(Opened opened);
  /// Reads what an earlier run left, or writes the header.
  void open_records(const std::string& key);
  void read_records(std::string_view bytes, size_t begin);
  void write_at_end(std::string_view bytes);
  void sync();

  std::filesystem::path file_;
  int descriptor_ = -1;
  size_t end_ = 0;  ///< bytes that are header or records
  std::map<int, std::string> finished_;
  int damaged_places_ = 0;
  std::chrono::steady_clock::time_point synced_at_;
};

}  // namespace clothfit
