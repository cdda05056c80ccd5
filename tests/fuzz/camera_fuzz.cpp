// A camera file. What reads once must read again after it was written.

#include "data/camera_parameters.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("camera.yaml", text_of(data, size));
  CameraParameters camera;
  try {
    camera = read_camera(file);
  } catch (const InputError&) {
    return 0;
  }
  write_camera(camera, file);
  read_camera(file);
  return 0;
}
