#include "vision/ingest/video_file.h"

extern "C" {
#include <libavutil/display.h>
}

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "data/input_error.h"
#include "vision/ingest/frame_list.h"
#include "vision/ingest/libav.h"
#include "vision/ingest/picture_limits.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// What a container says of its video, read without decoding a picture.
struct VideoTable {
  int stream = -1;
  std::vector<std::int64_t> times;  ///< of the pictures that are shown, rising; ticks
  double tick_s = 0;
  int stated = 0;  ///< pictures that the container claims, hidden ones included; 0: it does not say
  int stored = 0;  ///< of those, whole ones
  int turn_deg = 0;  ///< clockwise, asked of players
  int videos = 0;    ///< in the file; the largest is read
  int repeated = 0;  ///< pictures that share a time with another
  bool tells_damage = true;
  double missing_end_s = 0;  ///< by which the pictures end before the container states
};

constexpr const char* kVideo = "a folder of pictures or a video";

void refuse_interlaced(AVFieldOrder order, const std::string& file) {
  if (order == AV_FIELD_UNKNOWN || order == AV_FIELD_PROGRESSIVE) return;
  const bool top = order == AV_FIELD_TT || order == AV_FIELD_BT;
  throw InputError(file,
                   fmt::format("the video is interlaced, {} field first: odd and even lines show "
                               "different instants",
                               top ? "top" : "bottom"),
                   kProgressive, kDeinterlace);
}

int turn_of(AVStream& stream) {
  const uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) return 0;
  const double turn = -av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix));
  return std::isfinite(turn) ? (static_cast<int>(std::lround(turn)) % 360 + 360) % 360 : 0;
}

/// Says whether the codec's decoder reports most damage inside pictures. Others decode on.
bool tells_damage(AVCodecID codec) {
  switch (codec) {
    case AV_CODEC_ID_H264:
    case AV_CODEC_ID_FFV1:
    case AV_CODEC_ID_RAWVIDEO:
      return true;
    default:
      return false;
  }
}

/// Gathers what the packets of a video say of its pictures.
class TableReader {
 public:
  TableReader(VideoTable& table, std::string file) : table_(table), file_(std::move(file)) {}

  void take(const AVPacket& packet) {
    ++table_.stored;
    const bool timed = packet.pts != AV_NOPTS_VALUE;
    untimed_ += timed ? 0 : 1;
    const std::int64_t time = timed ? packet.pts : packet.dts;
    if (time == AV_NOPTS_VALUE) refuse_untimed();
    const bool hidden = (packet.flags & AV_PKT_FLAG_DISCARD) != 0;
    packets_.push_back({time, hidden, (packet.flags & AV_PKT_FLAG_CORRUPT) != 0});
  }

  /// Fills the table. `reordered` says that pictures are not stored in the order shown: then times
  /// of storage are none of display.
  void finish(bool reordered) {
    if (untimed_ > 0 && (reordered || untimed_ < table_.stored)) refuse_untimed();
    // The last ones of a file that is cut short are no pictures any more.
    for (; !packets_.empty() && packets_.back().cut; packets_.pop_back()) --table_.stored;
    for (const StoredPicture& packet : packets_)
      if (!packet.hidden) table_.times.push_back(packet.time);
    std::sort(table_.times.begin(), table_.times.end());
    const auto last = std::unique(table_.times.begin(), table_.times.end());
    table_.repeated = static_cast<int>(table_.times.end() - last);
    table_.times.erase(last, table_.times.end());
    if (table_.times.empty())
      throw InputError(file_, "no picture can be read from it: it holds no frame", kVideo,
                       "check that the file is whole and that a video player shows it");
  }

 private:
  struct StoredPicture {
    std::int64_t time = 0;
    bool hidden = false, cut = false;
  };

  [[noreturn]] void refuse_untimed() const {
    throw InputError(
        file_,
        fmt::format("{} of its first {} pictures have no time of display", untimed_, table_.stored),
        "a video whose container holds a time for each picture",
        "convert it: ffmpeg -i IN -c:v ffv1 OUT.mkv, or extract pictures");
  }

  VideoTable& table_;
  std::string file_;
  std::vector<StoredPicture> packets_;
  int untimed_ = 0;
};

/// Says by how much a video ends before its container states, where there is nothing but a video.
double missing_end_s(const AVFormatContext& format, const VideoTable& table) {
  if (format.nb_streams != 1 || format.duration <= 0 ||
      format.duration_estimation_method == AVFMT_DURATION_FROM_BITRATE)
    return 0;
  const double begin_s = static_cast<double>(table.times.front()) * table.tick_s,
               end_s = static_cast<double>(table.times.back()) * table.tick_s;
  // Some count from 0, others from their first picture.
  return static_cast<double>(format.duration) / AV_TIME_BASE - std::max(end_s, end_s - begin_s);
}

VideoTable read_table(const fs::path& file) {
  const libav::Container container(file);
  VideoTable table;
  table.stream = av_find_best_stream(&*container, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (table.stream < 0)
    throw InputError(file.string(), "it holds no video (no picture can be read from it)", kVideo,
                     "name the file that holds the pictures");
  AVStream& stream = *container->streams[table.stream];
  refuse_interlaced(stream.codecpar->field_order, file.string());
  if (stream.codecpar->width > 0 || stream.codecpar->height > 0)
    require_possible_size(file.string(), stream.codecpar->width, stream.codecpar->height);
  table.tick_s = av_q2d(stream.time_base);
  table.stated = static_cast<int>(std::clamp<std::int64_t>(stream.nb_frames, 0, 1'000'000'000));
  table.turn_deg = turn_of(stream);
  table.tells_damage = tells_damage(stream.codecpar->codec_id);
  for (unsigned i = 0; i < container->nb_streams; ++i)  // a cover is no video
    if (container->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
        (container->streams[i]->disposition & AV_DISPOSITION_ATTACHED_PIC) == 0)
      ++table.videos;

  TableReader reader(table, file.string());
  const libav::Packet packet(av_packet_alloc());
  while (av_read_frame(&*container, packet.get()) >= 0) {
    if (packet->stream_index == table.stream) reader.take(*packet);
    av_packet_unref(packet.get());
  }
  reader.finish(stream.codecpar->video_delay > 0);
  table.missing_end_s = missing_end_s(*container, table);
  return table;
}

libav::Codec open_decoder(const AVStream& stream, const std::string& file) {
  const AVCodec* decoder = avcodec_find_decoder(stream.codecpar->codec_id);
  libav::Codec context(avcodec_alloc_context3(decoder));
  int code = decoder == nullptr ? AVERROR_DECODER_NOT_FOUND
                                : avcodec_parameters_to_context(context.get(), stream.codecpar);
  context->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  context->max_pixels = kMostPixels;
  context->pkt_timebase = stream.time_base;
  // Threads over pictures tell of damage late, and differently from run to run.
  context->thread_count = 0;
  context->thread_type = FF_THREAD_SLICE;
  if (code >= 0) code = avcodec_open2(context.get(), decoder, nullptr);
  if (code < 0)
    throw InputError(file,
                     fmt::format("no picture can be read from it ({})", libav::error_text(code)),
                     kVideo, "convert it: ffmpeg -i IN -c:v ffv1 OUT.mkv");
  return context;
}

class VideoFile : public ImageSource {
 public:
  explicit VideoFile(const fs::path& file)
      : file_(file.string()),
        table_(read_table(file)),
        container_(file),
        decoder_(open_decoder(*container_->streams[table_.stream], file_)),
        packet_(av_packet_alloc()),
        frame_(av_frame_alloc()) {
    if (decode()) return;
    throw InputError(file_, "no picture can be read from it: none can be decoded", kVideo,
                     "check that the file is whole and that a video player shows it");
  }

  std::string current_name() const override {
    return number_ < 0 ? std::string() : fmt::format("picture {}", number_);
  }
  std::string damage() const override { return damage_; }
  int count() const override { return static_cast<int>(table_.times.size()); }

  std::vector<double> times_s() const override {
    std::vector<double> times;
    for (const std::int64_t time : table_.times)
      times.push_back(static_cast<double>(time) * table_.tick_s);
    return times;
  }

 protected:
  bool read_next(cv::Mat& grey) override {
    if (number_ >= 0 && !decode()) {
      for (int n = number_ + 1; n < count(); ++n) damaged_.insert(n);
      number_ = std::max(number_, count() - 1);
      return false;
    }
    const int number = number_of(*frame_);
    for (int n = number_ + 1; n < number; ++n) damaged_.insert(n);
    number_ = number;
    damage_ =
        is_damaged(packet_of(*frame_), frame_->best_effort_timestamp) ? "its data are damaged" : "";
    if (!damage_.empty()) {
      damaged_.insert(number_);
      return true;
    }
    if (frame_->interlaced_frame != 0)
      refuse_interlaced(frame_->top_field_first != 0 ? AV_FIELD_TT : AV_FIELD_BB, file_);
    require_possible_size(fmt::format("{}, {}", file_, current_name()), frame_->width,
                          frame_->height);
    const libav::GreyLevels levels = libav::grey_levels(*frame_, file_);
    if (levels.levels.empty())
      throw InputError(file_, "its pixel format has no grey", "grey or colour pictures",
                       "convert it: ffmpeg -i IN -c:v ffv1 -pix_fmt gray OUT.mkv");
    levels.levels.convertTo(grey, CV_8U, 255.0 / ((1 << levels.bits) - 1));
    return true;
  }

  int own_number() const override { return number_; }
  std::string where() const override { return file_; }
  Findings own_findings() const override;

 private:
  bool decode();
  bool send_next_packet();
  int number_of(const AVFrame& frame) const;
  /// Returns the packet that the decoder's last answer is about.
  std::int64_t packet_in_work() const { return std::max<std::int64_t>(0, sent_ - 1); }
  static std::int64_t packet_of(const AVFrame& frame) { return frame.reordered_opaque; }

  /// Says whether a picture rests on damaged data: on those of a packet since the last one that
  /// needs no other. One that is shown before that also rests on what was before it.
  bool is_damaged(std::int64_t packet, std::int64_t time) const {
    auto key = std::upper_bound(keys_.begin(), keys_.end(), packet,
                                [](std::int64_t p, const Key& k) { return p < k.packet; });
    if (key != keys_.begin() && time < std::prev(key)->time) --key;
    const std::int64_t from = key == keys_.begin() ? 0 : std::prev(key)->packet;
    return std::ranges::any_of(
        errors_, [&](std::int64_t error) { return error >= from && error <= packet; });
  }

  /// Notes the packet in work as damaged where libav has logged an error since.
  void note_errors(long before) {
    if (libav::errors_logged() != before) errors_.push_back(packet_in_work());
  }

  std::string file_;
  VideoTable table_;
  libav::Container container_;
  libav::Codec decoder_;
  libav::Packet packet_;
  libav::Frame frame_;
  bool ended_ = false;
  std::int64_t sent_ = 0;  ///< packets
  struct Key {
    std::int64_t packet = 0, time = 0;
  };
  std::vector<Key> keys_;             ///< packets that need no other, rising
  std::vector<std::int64_t> errors_;  ///< packets that are damaged
  int number_ = -1;
  std::string damage_;
  std::set<int> damaged_;  ///< pictures, those that were never decoded among them
};

/// Decodes the next picture into `frame_`; false at the end.
bool VideoFile::decode() {
  for (;;) {
    const long errors = libav::errors_logged();
    const int code = avcodec_receive_frame(decoder_.get(), frame_.get());
    note_errors(errors);
    if (code == AVERROR_EOF) return false;
    if (code == AVERROR(EAGAIN)) {
      if (!send_next_packet()) return false;
      continue;
    }
    if (code < 0) {
      errors_.push_back(packet_in_work());
      continue;
    }
    if (frame_->decode_error_flags != 0 || (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0)
      errors_.push_back(packet_of(*frame_));
    if (number_of(*frame_) > number_) return true;
  }
}

/// Sends the next packet of the video to the decoder, or its end. Returns false where that fails.
bool VideoFile::send_next_packet() {
  if (ended_) return false;
  for (;;) {
    if (av_read_frame(&*container_, packet_.get()) < 0) {
      ended_ = true;
      return avcodec_send_packet(decoder_.get(), nullptr) >= 0;
    }
    if (packet_->stream_index == table_.stream) break;
    av_packet_unref(packet_.get());
  }
  if ((packet_->flags & AV_PKT_FLAG_KEY) != 0) keys_.push_back({sent_, packet_->pts});
  if ((packet_->flags & AV_PKT_FLAG_CORRUPT) != 0) errors_.push_back(sent_);
  decoder_->reordered_opaque = sent_++;
  const long errors = libav::errors_logged();
  if (avcodec_send_packet(decoder_.get(), packet_.get()) < 0) errors_.push_back(packet_in_work());
  note_errors(errors);
  av_packet_unref(packet_.get());
  return true;
}

/// Returns the number of a decoded picture among those that the container lists, by its time.
int VideoFile::number_of(const AVFrame& frame) const {
  const std::int64_t time =
      frame.best_effort_timestamp != AV_NOPTS_VALUE ? frame.best_effort_timestamp : frame.pkt_dts;
  const auto at = std::lower_bound(table_.times.begin(), table_.times.end(), time);
  if (at == table_.times.end() || *at != time) return -1;
  return static_cast<int>(at - table_.times.begin());
}

Findings VideoFile::own_findings() const {
  Findings findings;
  const auto warn = [&](const std::string& found, const std::string& remedy) {
    findings.push_back({.check = "pictures",
                        .state = FindingState::warning,
                        .found = found,
                        .where = file_,
                        .expected = "a whole file",
                        .remedy = remedy});
  };
  constexpr double kCutShort_s = 0.5;
  // Containers round their count, so one missing picture is no sign of damage.
  if (table_.stored + 1 < table_.stated)
    warn(fmt::format("the video breaks off after {} of {} pictures", table_.stored, table_.stated),
         "copy it again");
  if (!damaged_.empty())
    warn(fmt::format("{} of {} pictures are damaged and left out: {}", damaged_.size(), count(),
                     list_numbers({damaged_.begin(), damaged_.end()})),
         "copy it again");
  if (table_.stated == 0 && table_.missing_end_s > kCutShort_s)
    warn(fmt::format("the video ends {:.2g} s before its container states", table_.missing_end_s),
         "copy it again");
  if (table_.repeated > 0)
    warn(fmt::format("{} pictures share a time with another and are left out", table_.repeated),
         "use the file as the camera wrote it");
  if (table_.videos > 1)
    warn(fmt::format("{} videos are in it, of which one is read", table_.videos),
         "extract the one that is meant: ffmpeg -i IN -map 0:v:N -c copy OUT.mkv");
  if (!table_.tells_damage)
    findings.push_back({.check = "pictures",
                        .found = fmt::format(
                            "{} is of a codec whose decoder tells little of damage inside pictures",
                            fs::path(file_).filename().string())});
  if (table_.turn_deg != 0)
    findings.push_back(
        {.check = "pictures",
         .found = fmt::format("{} asks players to turn it by {} degrees clockwise; pixels are "
                              "used as the sensor read them",
                              fs::path(file_).filename().string(), table_.turn_deg)});
  return findings;
}

}  // namespace

std::unique_ptr<ImageSource> open_video(const fs::path& file) {
  return std::make_unique<VideoFile>(file);
}

}  // namespace clothfit
