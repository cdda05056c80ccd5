// Outlines from SVG drawings. What is read can be measured, and runs counterclockwise.

#include "data/svg_outline.h"
#include "tests/fuzz/check_outline.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("a.svg", text_of(data, size));
  for (const char* piece : {"p", "q"})
    read_or_refuse([&] { check_outline(read_svg_outline(file, piece, std::nullopt)); });
  return 0;
}
