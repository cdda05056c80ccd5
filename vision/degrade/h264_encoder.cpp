#include "vision/degrade/h264_encoder.h"

extern "C" {
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <cstring>
#include <new>

#include "data/input_error.h"

namespace clothfit::h264 {
namespace {

int even(int side) {
  return side + side % 2;
}

}  // namespace

SilentLibrary::SilentLibrary() : before_(av_log_get_level()) {
  av_log_set_level(AV_LOG_QUIET);
}

SilentLibrary::~SilentLibrary() {
  av_log_set_level(before_);
}

void refuse(const std::string& problem) {
  throw InputError("libavcodec", problem, "a libavcodec with libx264 and an H.264 decoder");
}

Codec open_encoder(const cv::Size& size, int crf, const EncoderSetting& setting) {
  const AVCodec* const kind = avcodec_find_encoder_by_name("libx264");
  if (kind == nullptr) refuse("has no libx264");
  Codec encoder(avcodec_alloc_context3(kind));
  encoder->width = even(size.width);
  encoder->height = even(size.height);
  encoder->time_base = setting.tick_s;
  encoder->framerate = setting.rate_hz;
  encoder->pix_fmt = AV_PIX_FMT_YUV420P;
  encoder->color_range = AVCOL_RANGE_JPEG;
  encoder->thread_count = 1;
  if (setting.header_apart) encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  av_opt_set(encoder->priv_data, "crf", std::to_string(crf).c_str(), 0);
  if (avcodec_open2(encoder.get(), kind, nullptr) < 0) refuse("cannot open libx264");
  return encoder;
}

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

}  // namespace clothfit::h264
