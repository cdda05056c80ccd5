// A compressed table as it lies on the disk, whose compression is what is damaged.

#include "data/text_file.h"
#include "data/tracks.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  MarkerSet markers;
  markers.markers = {{.name = "a"}};
  markers.index = {{"a", 0}};
  for (const char* name : {"t.csv.gz", "t.csv"}) {
    const auto file = write_scratch(name, text_of(data, size));
    read_or_refuse([&] { read_tracks2d(file, markers); });
    read_or_refuse([&] { read_text(file); });
  }
  return 0;
}
