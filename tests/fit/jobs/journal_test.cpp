// Checks a run's journal after it was cut, damaged or opened by the wrong run. Not checked here:
// runs that are killed (killed_runs_test.cpp), the executor that goes on with one
// (executor_test.cpp), power cuts (no test can pull the plug).

#include "fit/jobs/journal.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "data/program_version.h"
#include "fit/jobs/arithmetic.h"
#include "fit/jobs/journal_key.h"
#include "tests/data/expect_refused.h"
#include "tests/data/file_bytes.h"

namespace clothfit {
namespace {

constexpr const char* kKey = "trials of towel, options default, seed 3";

/// Returns payloads with all that could be mistaken for the journal's own text.
std::map<int, std::string> awkward_payloads() {
  std::string all_bytes;
  for (int byte = 0; byte < 256; ++byte) all_bytes += static_cast<char>(byte);
  return {{0, ""},
          {7, "record 3 2 0000000000000000\nab\n"},
          {3, all_bytes},
          {2000000000, "\n\n"},
          {4, std::string(100000, 'x')},
          {1, "last"}};
}

void write_journal(const std::filesystem::path& file, const std::map<int, std::string>& payloads) {
  Journal journal(file, kKey, JournalStart::fresh);
  for (const auto& [index, payload] : payloads) journal.append(index, payload);
}

TEST(Journal, GivesBackWhatWasAppendedWhateverItsBytes) {
  const TemporaryFolder folder;
  write_journal(folder / "journal", awkward_payloads());

  const Journal again(folder / "journal", kKey, JournalStart::resume);

  EXPECT_EQ(again.finished(), awkward_payloads());
  EXPECT_EQ(again.damaged_places(), 0);
}

TEST(Journal, GoesOnBehindTheRecordsThatItFinds) {
  const TemporaryFolder folder;
  std::map<int, std::string> expected;
  for (int session = 0; session < 5; ++session) {
    Journal journal(folder / "journal", kKey, JournalStart::resume);
    EXPECT_EQ(journal.finished(), expected);
    for (int k = 0; k < session; ++k) {
      const int index = 100 * session + k;
      expected[index] = std::string(static_cast<size_t>(index), '\n');
      journal.append(index, expected[index]);
    }
  }
  EXPECT_EQ(Journal(folder / "journal", kKey, JournalStart::resume).finished(), expected);
}

TEST(Journal, CutAtAnyByteLosesOnlyTheRecordThatWasCut) {
  // Given a journal, and where its header and each of its records end,
  const TemporaryFolder folder;
  const std::map<int, std::string> payloads = {
      {5, "five"}, {2, "two\nrecord 2 3\n"}, {9, ""}, {0, std::string("\0zero", 5)}};
  std::map<size_t, std::map<int, std::string>> held_from;
  {
    Journal journal(folder / "journal", kKey, JournalStart::fresh);
    held_from[std::filesystem::file_size(folder / "journal")] = {};
    for (const auto& [index, payload] : payloads) {
      journal.append(index, payload);
      held_from[std::filesystem::file_size(folder / "journal")] = journal.finished();
    }
  }
  const std::string whole = file_bytes(folder / "journal");

  // when it is cut at any byte, header included,
  for (size_t size = 0; size <= whole.size(); ++size) {
    SCOPED_TRACE(size);
    folder.write("cut", whole.substr(0, size));
    const auto above = held_from.upper_bound(size);
    // A header that was cut is written again.
    const auto& [end, held] = above == held_from.begin() ? *above : *std::prev(above);
    {
      Journal cut(folder / "cut", kKey, JournalStart::resume);
      ASSERT_EQ(cut.finished(), held);
      EXPECT_EQ(cut.damaged_places(), 0);
      EXPECT_EQ(std::filesystem::file_size(folder / "cut"), end);
      for (const auto& [index, payload] : payloads)
        if (!held.contains(index)) cut.append(index, payload);
    }
    // then the records before the cut are there, and those redone end up as if never cut.
    EXPECT_EQ(file_bytes(folder / "cut"), whole);
  }
}

TEST(Journal, LeavesOutTheDamagedRecordAloneAndTakesItsPieceAgain) {
  const TemporaryFolder folder;
  const std::map<int, std::string> payloads = {{0, "zero"}, {1, "one"}, {2, "two"}};
  std::map<int, std::pair<size_t, size_t>> place;
  {
    Journal journal(folder / "journal", kKey, JournalStart::fresh);
    for (const auto& [index, payload] : payloads) {
      const size_t begin = std::filesystem::file_size(folder / "journal");
      journal.append(index, payload);
      place[index] = {begin, std::filesystem::file_size(folder / "journal")};
    }
  }
  const std::string whole = file_bytes(folder / "journal");

  for (const int spoiled : {0, 1, 2}) {
    for (size_t at = place[spoiled].first; at < place[spoiled].second; ++at) {
      for (const int bit : {0, 6}) {
        SCOPED_TRACE(testing::Message()
                     << "record " << spoiled << ", byte " << at << ", bit " << bit);
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
        folder.write("damaged", damaged);
        std::map<int, std::string> others = payloads;
        others.erase(spoiled);
        {
          Journal journal(folder / "damaged", kKey, JournalStart::resume);
          ASSERT_EQ(journal.finished(), others);
          EXPECT_EQ(journal.damaged_places(), spoiled < 2 ? 1 : 0);  // the last counts as torn
          journal.append(spoiled, payloads.at(spoiled));
        }
        EXPECT_EQ(Journal(folder / "damaged", kKey, JournalStart::resume).finished(), payloads);
      }
    }
  }
}

TEST(Journal, TakesNoRecordFromInsideADamagedOne) {
  // Given a payload that is itself a whole journal, whose record head is then spoiled,
  const TemporaryFolder folder;
  write_journal(folder / "inner", {{0, "wrong"}, {1, "wrong"}});
  write_journal(folder / "outer", {{0, file_bytes(folder / "inner")}, {1, "right"}});
  std::string text = file_bytes(folder / "outer");
  const size_t head = text.find("record 0");
  text[head] = 'R';
  folder.write("damaged", text);

  const Journal journal(folder / "damaged", kKey, JournalStart::resume);

  EXPECT_EQ(journal.finished(), (std::map<int, std::string>{{1, "right"}}));
}

TEST(Journal, RefusesAnotherVersionOfTheProgramAndAnotherArithmeticByName) {
  const TemporaryFolder folder;
  const std::string key = JournalKey("trials/1").add("seed", 4).line();
  const auto with_field = [&](const std::string& name, const std::string& value) {
    const size_t begin = key.find(name + "=") + name.size() + 1;
    return key.substr(0, begin) + value + key.substr(key.find("; ", begin));
  };
  Journal(folder / "older", with_field("clothfit", "0.0.1"), JournalStart::fresh);
  Journal(folder / "elsewhere", with_field("arithmetic", "glibc 2.0"), JournalStart::fresh);

  expect_refused(folder,
                 fmt::format("older:2: belongs to another run, of `clothfit=0.0.1`; this run is of "
                             "`clothfit={}`; give",
                             program_version()),
                 [&] { Journal(folder / "older", key, JournalStart::resume); });
  expect_refused(folder,
                 fmt::format("elsewhere:2: belongs to another run, of `arithmetic=glibc 2.0`; this "
                             "run is of `arithmetic={}`; give",
                             arithmetic_name()),
                 [&] { Journal(folder / "elsewhere", key, JournalStart::resume); });
}

TEST(Journal, RefusesAnotherRunsJournalAndLeavesItAsItIs) {
  const TemporaryFolder folder;
  write_journal(folder / "journal", {{0, "zero"}});
  const std::string before = file_bytes(folder / "journal");

  expect_refused(
      folder,
      "journal:2: belongs to another run, of `trials of towel, options default, seed "
      "3`; this run is of `trials of towel, options default, seed 31`; give the options",
      [&] { Journal(folder / "journal", kKey + std::string("1"), JournalStart::resume); });
  const auto key = [](int seed, const char* hidden) {
    return JournalKey("trials/1").add("mesh", "9x9").add("seed", seed).add("hidden", hidden).line();
  };
  Journal(folder / "fields", key(4, "wind"), JournalStart::fresh);
  expect_refused(folder,
                 "fields:2: belongs to another run, of `seed=4`; this run is of `seed=5`; give",
                 [&] { Journal(folder / "fields", key(5, "wind"), JournalStart::resume); });
  expect_refused(
      folder,
      "fields:2: belongs to another run, of `seed=4, hidden=wind`; this run is of `seed=5, "
      "hidden=gust`",
      [&] { Journal(folder / "fields", key(5, "gust"), JournalStart::resume); });
  expect_refused(folder,
                 "journal: exists; a new file, for this run starts from scratch; go on with it",
                 [&] { Journal(folder / "journal", kKey, JournalStart::fresh); });
  EXPECT_EQ(file_bytes(folder / "journal"), before);
}

TEST(JournalKey, NamesTheFieldsThatDiffer) {
  const std::string one = JournalKey("a/1").add("x", 1).add("y", 0.5).add("z", "p; q").line();
  EXPECT_EQ(one, JournalKey("a/1").line() + "; x=1; y=0.5; z=p  q");
  EXPECT_EQ(differing_fields(one, one), "");
  const std::string other = JournalKey("a/2").add("x", 1).add("y", 0.25).line();
  EXPECT_EQ(differing_fields(one, other), "a/1, y=0.5, z=p  q");
  EXPECT_EQ(differing_fields(other, one), "a/2, y=0.25, z not given");
}

TEST(Journal, RefusesWhatIsNoJournalAndLeavesItAsItIs) {
  const TemporaryFolder folder;
  folder.write("letter", "Dear clothfit,\n");
  expect_refused(folder, "letter:1: is no journal of a run",
                 [&] { Journal(folder / "letter", kKey, JournalStart::resume); });
  EXPECT_EQ(read_text(folder / "letter"), "Dear clothfit,\n");

  folder.write("later", std::string("clothfit-journal/2\n") + kKey + "\n");
  expect_refused(folder, "later:1: is a journal of version `clothfit-journal/2`",
                 [&] { Journal(folder / "later", kKey, JournalStart::resume); });
  expect_refused(folder, ": cannot be opened",
                 [&] { Journal(folder.path() / "", kKey, JournalStart::resume); });
  std::filesystem::create_symlink("/dev/zero", folder / "endless");
  expect_refused(folder, "endless: is no file of records",
                 [&] { Journal(folder / "endless", kKey, JournalStart::resume); });
  expect_refused(folder, "no/such/journal: cannot be opened",
                 [&] { Journal(folder / "no/such/journal", kKey, JournalStart::fresh); });
}

TEST(Journal, HasOneWriterAtATime) {
  const TemporaryFolder folder;
  const auto second = [&] { Journal(folder / "journal", kKey, JournalStart::resume); };
  {
    Journal first(folder / "journal", kKey, JournalStart::fresh);
    first.append(0, "zero");
    expect_refused(folder, "journal: is being written by another process", second);

    // Another process is refused, too; it uses no threads.
    const pid_t child = fork();
    if (child == 0) {
      try {
        second();
      } catch (const InputError&) {
        _exit(7);
      }
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 7);
    first.append(1, "one");
  }
  EXPECT_EQ(Journal(folder / "journal", kKey, JournalStart::resume).finished().size(), 2u);
}

TEST(Journal, KeepsItsRecordsWhenTheDiskIsFull) {
  // The size of files has a limit, beyond which writing stops in the middle of a record.
  const TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous_handler = signal(SIGXFSZ, SIG_IGN);
  {
    Journal journal(folder / "journal", kKey, JournalStart::fresh);
    journal.append(0, "zero");
    const std::uintmax_t size = std::filesystem::file_size(folder / "journal");
    const rlimit tight{.rlim_cur = size + 10, .rlim_max = before.rlim_max};

    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
    expect_refused(folder, "journal: cannot be written: ", [&] { journal.append(1, "one"); });
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);

    EXPECT_EQ(std::filesystem::file_size(folder / "journal"), size);
    EXPECT_EQ(journal.finished().size(), 1u);
    journal.append(1, "one at last");
  }
  signal(SIGXFSZ, previous_handler);
  EXPECT_EQ(Journal(folder / "journal", kKey, JournalStart::resume).finished(),
            (std::map<int, std::string>{{0, "zero"}, {1, "one at last"}}));
}

}  // namespace
}  // namespace clothfit
