#include "vision/degrade/h264.h"

#include <cassert>

#include "vision/degrade/h264_encoder.h"

namespace clothfit {
namespace {

using h264::Codec;
using h264::Frame;
using h264::Packet;
using h264::refuse;

Codec open_decoder() {
  const AVCodec* const kind = avcodec_find_decoder(AV_CODEC_ID_H264);
  if (kind == nullptr) refuse("has no H.264 decoder");
  Codec decoder(avcodec_alloc_context3(kind));
  decoder->thread_count = 1;
  if (avcodec_open2(decoder.get(), kind, nullptr) < 0) refuse("cannot open the H.264 decoder");
  return decoder;
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
  const h264::SilentLibrary silent;
  const cv::Size size = pictures.front().size();
  const Codec encoder = h264::open_encoder(size, crf, {});
  const Codec decoder = open_decoder();
  std::int64_t time = 0;
  for (const cv::Mat& picture : pictures) {
    assert(picture.type() == CV_8UC1 && picture.size() == size);
    const Frame frame = h264::frame_of(picture, *encoder, time++);
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
