#include "apps/study/vision/judged_recording.h"

#include <fmt/format.h>

#include <cstdint>

#include "data/csv_reader.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "data/recording.h"
#include "vision/ingest/decode_picture.h"
#include "vision/ingest/picture_content.h"

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
  std::vector<fs::path> files;
  for (const FolderEntry& entry : list_whole_folder(folder))
    if (entry.kind == FolderEntry::Kind::file && has_picture_name(entry.path))
      files.push_back(entry.path);
  if (files.empty())
    throw InputError(folder.string(), "holds no picture", fmt::format("{} files", kReadFormats));
  return files;
}

cv::Mat read_grey(const fs::path& file) {
  const DecodedPicture picture = decode_picture(file);
  if (!picture.damage.empty())
    throw InputError(file.string(), fmt::format("cannot be decoded ({})", picture.damage),
                     "a whole picture", "copy it again");
  if (picture.grey.depth() == CV_8U) return picture.grey;
  cv::Mat upper(picture.grey.size(), CV_8UC1);
  for (int y = 0; y < upper.rows; ++y)
    for (int x = 0; x < upper.cols; ++x)
      upper.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(picture.grey.at<std::uint16_t>(y, x) >> (picture.bits - 8));
  return upper;
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
