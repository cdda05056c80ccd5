// A video, or what else a file of pictures may be, with its first frames.

#include "tests/fuzz/scratch_folder.h"
#include "vision/ingest/open_images.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("video.mp4", text_of(data, size));
  read_or_refuse([&] {
    const auto source = open_images(file);
    source->times_s();
    cv::Mat grey;
    for (int picture = 0; picture < 4 && source->next(grey); ++picture) {
      source->damage();
      source->current_name();
    }
    source->findings();
  });
  return 0;
}
