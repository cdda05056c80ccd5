// Outlines from DXF drawings, of a block and outside. What is read can be measured, and runs
// counterclockwise.

#include "data/dxf_outline.h"
#include "tests/fuzz/check_outline.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("a.dxf", text_of(data, size));
  read_or_refuse([&] { check_outline(read_dxf_outline(file, "*", std::nullopt)); });
  read_or_refuse([&] { check_outline(read_dxf_outline(file, "A", 0.001)); });
  return 0;
}
