// Each table by itself, told by its name, as one of a cloth with two markers.

#include "data/body_path.h"
#include "data/clouds.h"
#include "data/markers.h"
#include "data/recording_parts.h"
#include "data/tracks.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto files = files_of(text_of(data, size), "tracks3d.csv");
  const auto& folder = write_files(files);
  MarkerSet markers;
  markers.markers = {{.name = "a"}, {.name = "b"}};
  markers.index = {{"a", 0}, {"b", 1}};
  bool clouds = false;
  for (const auto& entry : files) {
    const std::string& name = entry.first;
    const auto file = folder / name;
    read_or_refuse([&] {
      if (name.starts_with("tracks3d")) write_tracks3d(read_tracks3d(file, markers), markers, file);
      if (name.starts_with("tracks2d")) write_tracks2d(read_tracks2d(file, markers), markers, file);
      if (name.starts_with("markers")) write_markers(read_markers(file, 0.4, 0.3), file);
      if (name.starts_with("reference")) write_reference_points(read_reference_points(file), file);
      if (name.starts_with("times")) write_times(read_times(file), file);
      if (name.starts_with("held")) write_held_path(read_held_path(file), file);
      if (name.starts_with("body")) read_body_path(file);
    });
    clouds |= name.starts_with("clouds/");
  }
  if (clouds) read_or_refuse([&] { read_point_clouds(folder / "clouds"); });
  return 0;
}
