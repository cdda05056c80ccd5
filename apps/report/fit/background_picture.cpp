#include "apps/report/fit/background_picture.h"

#include <algorithm>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "data/input_error.h"
#include "data/unreadable_file.h"
#include "vision/encode/encode_picture.h"
#include "vision/ingest/footage.h"

namespace clothfit {
namespace {

std::optional<BackgroundPicture> read_picture(const std::string& kind, const Recording& recording,
                                              int frame) {
  try {
    const Footage footage = open_footage(recording, {kind});
    ImageSource& source = *footage.cameras.at(kind);
    cv::Mat grey;
    do {
      if (!source.next(grey)) return std::nullopt;
    } while (source.frame() < frame);
    if (source.frame() > frame || !source.damage().empty()) return std::nullopt;
    return BackgroundPicture{.kind = kind,
                             .frame = frame,
                             .width = grey.cols,
                             .height = grey.rows,
                             .jpeg = encode_jpeg(grey, 80)};
  } catch (const UnreadableFile&) {
    throw;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

int overlay_frame(const FitReport::Residuals& residuals) {
  std::map<int, int> count;
  for (const FitReport::Residuals::Row& row : residuals.rows) ++count[row.frame];
  int most = 0;
  for (const auto& [frame, rows] : count) most = std::max(most, rows);
  for (auto frame = count.rbegin(); frame != count.rend(); ++frame)
    if (2 * frame->second >= most) return frame->first;
  return -1;
}

std::vector<BackgroundPicture> background_pictures(const FitReport& report,
                                                   const Recording& recording) {
  std::vector<BackgroundPicture> pictures;
  for (const FitReport::Residuals& residuals : report.residuals) {
    const CameraEntry* camera = recording.find_camera(residuals.kind);
    const int frame = overlay_frame(residuals);
    if (camera == nullptr || !camera->images || frame < 0) continue;
    if (auto picture = read_picture(residuals.kind, recording, frame))
      pictures.push_back(std::move(*picture));
  }
  return pictures;
}

}  // namespace clothfit
