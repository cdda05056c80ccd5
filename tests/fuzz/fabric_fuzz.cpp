// A fabric's data sheet. What reads has numbers that the simulator takes.

#include <cstdlib>

#include "data/fabric_sheet.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("fabric.yaml", text_of(data, size));
  try {
    const FabricSheet sheet = read_fabric_sheet(file);
    for (const SheetNumber& number :
         {sheet.areal_density_kg_per_m2, sheet.shear_n_per_m, sheet.tension_n_per_m.warp,
          sheet.tension_n_per_m.weft, sheet.bending_n_m.warp, sheet.bending_n_m.weft})
      if (!(number.value > 0 && number.value < 1e12)) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
