// A picture, told by its content.

#include "tests/fuzz/scratch_folder.h"
#include "vision/ingest/decode_picture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("picture", text_of(data, size));
  read_or_refuse([&] { decode_picture(file); });
  return 0;
}
