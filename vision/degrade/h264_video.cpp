#include "vision/degrade/h264_video.h"

extern "C" {
#include <libavformat/avformat.h>
}

#include <cassert>
#include <cmath>
#include <memory>
#include <string>

#include "data/input_error.h"
#include "vision/degrade/h264_encoder.h"

namespace clothfit {
namespace {

constexpr AVRational kTick_s{1, 90000};

struct CloseFormat {
  void operator()(AVFormatContext* format) const {
    avio_closep(&format->pb);
    avformat_free_context(format);
  }
};
using Format = std::unique_ptr<AVFormatContext, CloseFormat>;

/// A file that an encoder's packets go to.
class Video {
 public:
  Video(const std::filesystem::path& file, const AVCodecContext& encoder, Format format)
      : file_(file.string()), format_(std::move(format)) {
    stream_ = avformat_new_stream(format_.get(), nullptr);
    require(avcodec_parameters_from_context(stream_->codecpar, &encoder));
    stream_->time_base = kTick_s;
    require(avio_open(&format_->pb, file_.c_str(), AVIO_FLAG_WRITE));
    require(avformat_write_header(format_.get(), nullptr));
  }

  /// Writes what the encoder has ready; a packet that names no duration gets `interval` (ticks).
  void take_from(AVCodecContext* encoder, std::int64_t interval) {
    const h264::Packet packet(av_packet_alloc());
    while (avcodec_receive_packet(encoder, packet.get()) >= 0) {
      // Without one an edit list would hide the last picture.
      packet->duration = interval;
      av_packet_rescale_ts(packet.get(), kTick_s, stream_->time_base);
      require(av_interleaved_write_frame(format_.get(), packet.get()));
    }
  }

  void finish() {
    require(av_write_trailer(format_.get()));
    require(avio_closep(&format_->pb));
  }

 private:
  void require(int code) const {
    if (code < 0)
      throw InputError(file_, "the video cannot be written", "a place on a disk with room");
  }

  std::string file_;
  Format format_;
  AVStream* stream_ = nullptr;
};

}  // namespace

void write_h264_video(const std::vector<cv::Mat>& pictures, const std::vector<double>& times_s,
                      int crf, const std::filesystem::path& file) {
  assert(!pictures.empty() && pictures.size() == times_s.size());
  const h264::SilentLibrary silent;
  AVFormatContext* opened = nullptr;
  if (avformat_alloc_output_context2(&opened, nullptr, nullptr, file.string().c_str()) < 0)
    throw InputError(file.string(), "names no container of videos", "a name with .mp4 or .mkv");
  Format format(opened);
  const auto ticks = [](double time_s) { return std::llround(time_s / av_q2d(kTick_s)); };
  const size_t intervals = pictures.size() - 1;
  const std::int64_t interval =
      intervals > 0 ? ticks((times_s.back() - times_s.front()) / static_cast<double>(intervals))
                    : kTick_s.den;
  const h264::Codec encoder =
      h264::open_encoder(pictures.front().size(), crf,
                         {.tick_s = kTick_s,
                          .rate_hz = {kTick_s.den, static_cast<int>(interval)},
                          .header_apart = (format->oformat->flags & AVFMT_GLOBALHEADER) != 0});
  Video video(file, *encoder, std::move(format));
  for (size_t n = 0; n < pictures.size(); ++n) {
    assert(pictures[n].type() == CV_8UC1 && pictures[n].size() == pictures.front().size());
    const h264::Frame frame = h264::frame_of(pictures[n], *encoder, ticks(times_s[n]));
    if (avcodec_send_frame(encoder.get(), frame.get()) < 0) h264::refuse("cannot encode a picture");
    video.take_from(encoder.get(), interval);
  }
  avcodec_send_frame(encoder.get(), nullptr);
  video.take_from(encoder.get(), interval);
  video.finish();
}

}  // namespace clothfit
