// The journal of a long run: bytes as they are, and records under checksums that hold.

#include "fit/jobs/journal.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  constexpr std::string_view kHeader = "clothfit-journal/1\nkey\n";
  const std::string_view text = text_of(data, size);
  for (const bool whole_header : {false, true}) {
    const auto file = write_scratch("run.journal",
                                    (whole_header ? std::string(kHeader) : "") + std::string(text));
    read_or_refuse([&] {
      size_t records = 0;
      {
        Journal journal(file, "key", JournalStart::resume);
        int next = 0;
        while (journal.finished().contains(next)) ++next;
        journal.append(next, text.substr(text.size() / 2));
        records = journal.finished().size();
      }
      // What was damaged stays so; what counts and what was appended is found again.
      if (Journal(file, "key", JournalStart::resume).finished().size() != records) __builtin_trap();
    });
  }
  return 0;
}
