// Checks runs that are killed and resumed, in processes of their own. No thread is ever started in
// the process of the tests, which therefore may fork. Not checked here: journals cut or damaged
// otherwise (journal_test.cpp).

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

#include "fit/jobs/draws.h"
#include "fit/jobs/executor.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {
namespace {

constexpr int kPieces = 30;
constexpr const char* kKey = "30 pieces, seed 1";

/// Returns between 0 and 70 kB of any bytes, after between none and 10000 draws.
std::string piece(int index, std::uint64_t seed) {
  Draws draws(seed, 0, 0);
  std::string bytes = std::to_string(index) + "\n";
  const int effort = draws.index(10000);
  for (int k = 0; k < effort; ++k) bytes[0] ^= static_cast<char>(draws.index(2));
  const int length = draws.index(2) == 0 ? draws.index(100) : draws.index(70000);
  for (int k = 0; k < length; ++k) bytes += static_cast<char>(draws.index(256));
  return bytes;
}

/// Runs `body` in a process of its own and returns how that ended.
int in_another_process(const std::function<void()>& body) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      body();
    } catch (const std::exception& error) {
      fprintf(stderr, "%s\n", error.what());
      _exit(1);
    }
    _exit(0);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return status;
}

bool was_killed(int status) {
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

std::string joined(const std::vector<std::string>& payloads) {
  std::string all;
  for (const std::string& payload : payloads) all += std::to_string(payload.size()) + " " + payload;
  return all;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Notes an index in a file, so that it outlives the process.
void note(const std::filesystem::path& file, int index) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const std::string line = std::to_string(index) + "\n";
  if (write(descriptor, line.data(), line.size()) < 0) _exit(1);
  close(descriptor);
}

std::multiset<int> noted(const std::filesystem::path& file) {
  std::istringstream in(bytes_of(file));
  return {std::istream_iterator<int>(in), std::istream_iterator<int>()};
}

/// Returns the indices that the journal holds.
std::set<int> finished_in(const std::filesystem::path& file) {
  std::set<int> indices;
  const Journal journal(file, kKey, JournalStart::resume);
  for (const auto& [index, payload] : journal.finished()) indices.insert(index);
  return indices;
}

enum class Moment { before_the_piece, after_its_record };

/// Resumes the run in another process, which kills itself at `moment` once `kill_at` pieces were
/// begun or recorded. The bytes of a run that ends go to `out`.
int run_until(Moment moment, int kill_at, int threads, const TemporaryFolder& folder) {
  return in_another_process([&] {
    Journal journal(folder / "journal", kKey, JournalStart::resume);
    std::atomic<int> begun = 0;
    const Work work = [&](int index, std::uint64_t seed) {
      if (moment == Moment::before_the_piece && begun++ == kill_at) kill(getpid(), SIGKILL);
      note(folder / "noted", index);
      return piece(index, seed);
    };
    int told = 0;
    const auto progress = [&](const Progress&) {
      if (moment == Moment::after_its_record && told++ == kill_at) kill(getpid(), SIGKILL);
      return true;
    };
    const ExecuteResult result = execute(kPieces, work, {.threads = threads}, &journal, progress);
    write_bytes(folder / "out", joined(result.payloads));
  });
}

constexpr int kNever = 1000;

std::string uninterrupted() {
  std::vector<std::string> payloads;
  for (int index = 0; index < kPieces; ++index)
    payloads.push_back(piece(index, derived_seed(1, index)));
  return joined(payloads);
}

TEST(KilledRuns, ResumeToTheBytesOfAnUninterruptedRunAndRedoOnlyWhatWasAtWork) {
  const std::string expected = uninterrupted();
  int kills = 0;
  for (const int threads : {1, 2, 3, 8}) {
    for (int seed = 1; seed <= 8; ++seed) {
      SCOPED_TRACE(testing::Message() << threads << " threads, seed " << seed);
      const TemporaryFolder folder;
      Draws draws(static_cast<std::uint64_t>(seed), threads, 0);

      std::set<int> finished;
      for (int session = 0;; ++session) {
        std::filesystem::remove(folder / "noted");
        const Moment moment =
            draws.index(2) == 0 ? Moment::before_the_piece : Moment::after_its_record;
        const int left = kPieces - static_cast<int>(finished.size());
        const int kill_at = session < 4 ? draws.index(left) : kNever;
        const int status = run_until(moment, kill_at, threads, folder);

        // No finished piece was done again, none was lost.
        const std::multiset<int> done = noted(folder / "noted");
        for (const int index : done) EXPECT_FALSE(finished.contains(index)) << index;
        const std::set<int> now = finished_in(folder / "journal");
        EXPECT_TRUE(std::ranges::includes(now, finished));
        EXPECT_LE(finished.size() + done.size(), now.size() + static_cast<size_t>(threads));
        finished = now;
        if (!was_killed(status)) {
          ASSERT_EQ(status, 0);
          break;
        }
        ++kills;
      }

      EXPECT_EQ(finished.size(), static_cast<size_t>(kPieces));
      EXPECT_TRUE(bytes_of(folder / "out") == expected);
    }
  }
  EXPECT_EQ(kills, 4 * 8 * 4);  // the first four sessions of every run
}

TEST(KilledRuns, ResumeFromAJournalTornAtAnyByteOfItsLastTwoRecords) {
  // Given the journal of a whole run on one thread,
  const TemporaryFolder folder;
  ASSERT_EQ(run_until(Moment::before_the_piece, kNever, 1, folder), 0);
  const std::string whole = bytes_of(folder / "journal");
  const std::string expected = bytes_of(folder / "out");
  ASSERT_TRUE(expected == uninterrupted());
  const size_t tail = whole.rfind("\nrecord " + std::to_string(kPieces - 2) + " ") + 1;
  ASSERT_LT(tail, whole.size());

  // when it is torn at any byte of the last two (every 997th where they are long),
  const size_t last = whole.rfind("\nrecord " + std::to_string(kPieces - 1) + " ") + 1;
  const auto is_inside_payload = [&](size_t size) {
    const size_t begin = size < last ? tail : last;
    const size_t end = size < last ? last : whole.size();
    return size > begin + 200 && size + 200 < end;
  };
  for (size_t size = tail; size <= whole.size(); ++size) {
    if (is_inside_payload(size) && size % 997 != 0) continue;
    SCOPED_TRACE(size);
    write_bytes(folder / "journal", whole.substr(0, size));
    std::filesystem::remove(folder / "noted");
    std::filesystem::remove(folder / "out");
    ASSERT_EQ(run_until(Moment::before_the_piece, kNever, 1, folder), 0);

    // then the torn pieces are done again, and nothing else.
    std::multiset<int> redone;
    if (size < last) redone.insert(kPieces - 2);
    if (size < whole.size()) redone.insert(kPieces - 1);
    EXPECT_EQ(noted(folder / "noted"), redone);
    EXPECT_TRUE(bytes_of(folder / "out") == expected);
    EXPECT_TRUE(bytes_of(folder / "journal") == whole);
  }
}

}  // namespace
}  // namespace clothfit
