#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
}

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit::h264 {

struct FreeCodec {
  void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
using Codec = std::unique_ptr<AVCodecContext, FreeCodec>;
using Frame = std::unique_ptr<AVFrame, FreeFrame>;
using Packet = std::unique_ptr<AVPacket, FreePacket>;

/// Keeps the library silent while it lives; its log is one for the process.
class SilentLibrary {
 public:
  SilentLibrary();
  ~SilentLibrary();
  SilentLibrary(const SilentLibrary&) = delete;
  SilentLibrary& operator=(const SilentLibrary&) = delete;

 private:
  int before_;
};

/// Throws InputError: the library lacks something.
[[noreturn]] void refuse(const std::string& problem);

/// What an encoder is told of time and of the file that it writes for.
struct EncoderSetting {
  AVRational tick_s{1, 60};   ///< unit of the pictures' times
  AVRational rate_hz{60, 1};  ///< of the pictures, on average
  bool header_apart = false;  ///< its header goes to the container, not into the stream
};

/// Opens libx264 at a constant rate factor with its own defaults, on one thread. An odd side is
/// made even. Throws InputError where libavcodec was built without it.
Codec open_encoder(const cv::Size& size, int crf, const EncoderSetting& setting);

/// Makes the frame that shows an 8-bit grey picture at full range, without colour; its border is
/// repeated where the encoder's size is larger. `time` is in ticks.
Frame frame_of(const cv::Mat& picture, const AVCodecContext& encoder, std::int64_t time);

}  // namespace clothfit::h264
