// The fit.json of an earlier fit. What reads once must read again after it was written.

#include "data/fit_result.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("fit.json", text_of(data, size));
  FitResult result;
  try {
    result = read_fit_result(file);
  } catch (const InputError&) {
    return 0;
  }
  write_fit_result(result, file);
  read_fit_result(file);
  read_or_refuse([&] { write_fit_result(at_density(result, 0.2), file); });
  return 0;
}
