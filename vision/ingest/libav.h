#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

/// Owners of libav's objects, and what every use of libav here shares. The library prints nothing.
namespace clothfit::libav {

struct Release {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};
using Frame = std::unique_ptr<AVFrame, Release>;
using Packet = std::unique_ptr<AVPacket, Release>;
using Codec = std::unique_ptr<AVCodecContext, Release>;

/// Returns libav's words for one of its error codes.
std::string error_text(int code);

/// Returns how many errors libav has logged in this process. It logs some that it returns nowhere.
long errors_logged();

/// A demuxer that reads one file and opens nothing else, whatever the file asks for: no playlist,
/// no reference to other media, no network.
class Container {
 public:
  /// Throws InputError where the file is none of the known containers.
  explicit Container(const std::filesystem::path& file);
  ~Container();
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;

  AVFormatContext& operator*() const { return *format_; }
  AVFormatContext* operator->() const { return format_; }

 private:
  void close();
  struct Bytes;
  std::unique_ptr<Bytes> bytes_;
  AVFormatContext* format_ = nullptr;
};

/// Grey levels of full range: 0 is black and 2^bits - 1 is white.
struct GreyLevels {
  cv::Mat levels;  ///< CV_8UC1 for 8 bits, else CV_16UC1; empty where the format has no grey
  int bits = 8;
};

/// Returns the luma of a decoded frame, or the grey of its RGB (ITU-R BT.601). Throws InputError
/// where parts of the picture are transparent.
GreyLevels grey_levels(const AVFrame& frame, const std::string& where);

/// Decodes a still of that codec. Sets `damage` to what is wrong with it, if anything is.
GreyLevels decode_still(std::string bytes, AVCodecID codec, const std::string& where,
                        std::string& damage);

}  // namespace clothfit::libav
