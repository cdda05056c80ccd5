// A model file with its tables. What reads once must read again after it was written.

#include "data/model_description.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto& folder = write_files(files_of(text_of(data, size), "model.yaml"));
  ModelDescription model;
  try {
    model = read_model(folder / "model.yaml");
  } catch (const InputError&) {
    return 0;
  }
  const auto written = folder / "written";
  std::filesystem::remove_all(written);
  std::filesystem::create_directories(written);
  write_model(model, written);
  read_model(written / "model.yaml");
  return 0;
}
