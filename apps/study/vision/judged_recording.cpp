#include "apps/study/vision/judged_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "data/csv_reader.h"
#include "data/input_error.h"
#include "data/recording.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

std::vector<TrueCorners> read_truth(const fs::path& file, const MarkerSet& markers,
                                    size_t pictures) {
  CsvReader table(file, {{"frame"}, {"marker"}, {"u"}, {"v"}, {"visible"}});
  std::vector<TrueCorners> truth(pictures);
  while (table.next()) {
    const auto frame = static_cast<size_t>(table.whole_number(0, 0));
    const auto known = markers.index.find(table.name(1));
    if (known == markers.index.end() || frame >= pictures)
      table.refuse("names a marker or a frame that is not there",
                   fmt::format("markers of the recording in frames 0 to {}", pictures - 1));
    const Marker& marker = markers.markers[static_cast<size_t>(known->second)];
    if (!marker.tag || !marker.corner) continue;
    truth[frame][{*marker.tag, *marker.corner}] = {
        .tag = *marker.tag,
        .corner = *marker.corner,
        .pixel_px = Eigen::Vector2d(table.number(2), table.number(3)),
        .visible = table.whole_number(4, 0) != 0};
  }
  return truth;
}

}  // namespace

std::vector<fs::path> picture_files(const fs::path& folder) {
  if (!fs::is_directory(folder))
    throw InputError(folder.string(), "is not a folder", "a folder with pictures in it");
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    std::string ending = entry.path().extension().string();
    std::ranges::transform(ending, ending.begin(),
                           [](unsigned char letter) { return std::tolower(letter); });
    if (ending == ".jpg" || ending == ".png") files.push_back(entry.path());
  }
  if (files.empty())
    throw InputError(folder.string(), "holds no picture", "pictures named .jpg or .png");
  std::ranges::sort(files);
  return files;
}

cv::Mat read_grey(const fs::path& file) {
  cv::Mat picture = cv::imread(file.string(), cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.empty()) throw InputError(file.string(), "cannot be decoded", "a picture");
  return picture;
}

JudgedRecording read_judged_recording(const fs::path& folder) {
  const Recording recording = read_recording(folder);
  if (recording.cameras.empty() || !recording.cameras.front().images)
    throw InputError(folder.string(), "has no pictures", "a camera with `images`");
  const CameraEntry& camera = recording.cameras.front();
  JudgedRecording judged{.name = folder.filename().string(),
                         .family = recording.markers.family,
                         .pictures = {},
                         .truth = {},
                         .layout = {},
                         .other_tags = {}};
  for (const Marker& marker : recording.markers.markers)
    if (marker.tag && marker.corner)
      judged.layout[*marker.tag].at(static_cast<size_t>(*marker.corner)) = {marker.s_m, marker.t_m};
  for (const ReferencePoint& point : recording.reference)
    if (point.tag) judged.other_tags.insert(*point.tag);
  for (const fs::path& file : picture_files(*camera.images))
    judged.pictures.push_back(read_grey(file));
  judged.truth = read_truth(folder / ("truth_tracks2d_" + camera.name + ".csv.gz"),
                            recording.markers, judged.pictures.size());
  return judged;
}

}  // namespace clothfit
