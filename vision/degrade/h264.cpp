#include "vision/degrade/h264.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <cassert>
#include <cstring>
#include <memory>
#include <string>

#include "data/input_error.h"

namespace clothfit {
namespace {

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
  SilentLibrary() : before_(av_log_get_level()) { av_log_set_level(AV_LOG_QUIET); }
  ~SilentLibrary() { av_log_set_level(before_); }
  SilentLibrary(const SilentLibrary&) = delete;
  SilentLibrary& operator=(const SilentLibrary&) = delete;

 private:
  int before_;
};

int even(int side) {
  return side + side % 2;
}

[[noreturn]] void refuse(const std::string& problem) {
  throw InputError("libavcodec", problem, "a libavcodec with libx264 and an H.264 decoder");
}

Codec open_encoder(const cv::Size& size, int crf) {
  const AVCodec* const kind = avcodec_find_encoder_by_name("libx264");
  if (kind == nullptr) refuse("has no libx264");
  Codec encoder(avcodec_alloc_context3(kind));
  encoder->width = even(size.width);
  encoder->height = even(size.height);
  encoder->time_base = {1, 60};
  encoder->framerate = {60, 1};
  encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  encoder->color_range = AVCOL_RANGE_JPEG;
  encoder->thread_count = 1;
  av_opt_set(encoder->priv_data, "crf", std::to_string(crf).c_str(), 0);
  if (avcodec_open2(encoder.get(), kind, nullptr) < 0) refuse("cannot open libx264");
  return encoder;
}

Codec open_decoder() {
  const AVCodec* const kind = avcodec_find_decoder(AV_CODEC_ID_H264);
  if (kind == nullptr) refuse("has no H.264 decoder");
  Codec decoder(avcodec_alloc_context3(kind));
  decoder->thread_count = 1;
  if (avcodec_open2(decoder.get(), kind, nullptr) < 0) refuse("cannot open the H.264 decoder");
  return decoder;
}

/// Makes the frame that shows a picture, without colour.
Frame frame_of(const cv::Mat& picture, const AVCodecContext& encoder, std::int64_t time) {
  Frame frame(av_frame_alloc());
  frame->format = encoder.pix_fmt;
  frame->width = encoder.width;
  frame->height = encoder.height;
  frame->color_range = encoder.color_range;
  frame->pts = time;
  if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
  cv::Mat luma(encoder.height, encoder.width, CV_8UC1, frame->data[0],
               static_cast<size_t>(frame->linesize[0]));
  cv::copyMakeBorder(picture, luma, 0, encoder.height - picture.rows, 0,
                     encoder.width - picture.cols, cv::BORDER_REPLICATE);
  constexpr int kNoColour = 128;
  for (int plane = 1; plane < 3; ++plane)
    std::memset(frame->data[plane], kNoColour,
                static_cast<size_t>(frame->linesize[plane] * (encoder.height / 2)));
  return frame;
}

/// Takes all frames that the decoder has ready.
void collect(AVCodecContext* decoder, const cv::Size& size, std::vector<cv::Mat>& pictures) {
  const Frame frame(av_frame_alloc());
  while (avcodec_receive_frame(decoder, frame.get()) >= 0) {
    const cv::Mat luma(frame->height, frame->width, CV_8UC1, frame->data[0],
                       static_cast<size_t>(frame->linesize[0]));
    pictures.push_back(luma(cv::Rect(cv::Point(), size)).clone());
  }
}

/// Hands all packets that the encoder has ready to the decoder.
void pass_on(AVCodecContext* encoder, AVCodecContext* decoder, const cv::Size& size,
             std::vector<cv::Mat>& pictures) {
  const Packet packet(av_packet_alloc());
  while (avcodec_receive_packet(encoder, packet.get()) >= 0) {
    if (avcodec_send_packet(decoder, packet.get()) < 0) refuse("cannot decode what it encoded");
    av_packet_unref(packet.get());
    collect(decoder, size, pictures);
  }
}

}  // namespace

std::vector<cv::Mat> through_h264(const std::vector<cv::Mat>& pictures, int crf) {
  std::vector<cv::Mat> decoded;
  if (pictures.empty()) return decoded;
  const SilentLibrary silent;
  const cv::Size size = pictures.front().size();
  const Codec encoder = open_encoder(size, crf);
  const Codec decoder = open_decoder();
  std::int64_t time = 0;
  for (const cv::Mat& picture : pictures) {
    assert(picture.type() == CV_8UC1 && picture.size() == size);
    const Frame frame = frame_of(picture, *encoder, time++);
    if (avcodec_send_frame(encoder.get(), frame.get()) < 0) refuse("cannot encode a picture");
    pass_on(encoder.get(), decoder.get(), size, decoded);
  }
  avcodec_send_frame(encoder.get(), nullptr);
  pass_on(encoder.get(), decoder.get(), size, decoded);
  avcodec_send_packet(decoder.get(), nullptr);
  collect(decoder.get(), size, decoded);
  if (decoded.size() != pictures.size()) refuse("lost pictures");
  return decoded;
}

}  // namespace clothfit
