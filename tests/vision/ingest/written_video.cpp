#include "tests/vision/ingest/written_video.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/opt.h>
}

#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

namespace clothfit {
namespace {

constexpr AVRational kMillisecond{1, 1000};

void require(int code, const char* what) {
  if (code < 0) throw std::runtime_error(std::string("writing a video: ") + what);
}

struct Writer {
  AVFormatContext* format = nullptr;
  AVCodecContext* codec = nullptr;
  AVFrame* frame = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();

  ~Writer() {
    av_packet_free(&packet);
    av_frame_free(&frame);
    avcodec_free_context(&codec);
    if (format != nullptr) avio_closep(&format->pb);
    avformat_free_context(format);
  }
};

void open(Writer& writer, const WrittenVideo& video, const std::string& file) {
  av_log_set_level(AV_LOG_QUIET);
  require(avformat_alloc_output_context2(&writer.format, nullptr, nullptr, file.c_str()), "format");
  const AVCodec* encoder = avcodec_find_encoder_by_name(video.encoder);
  require(encoder == nullptr ? -1 : 0, "encoder");
  writer.codec = avcodec_alloc_context3(encoder);
  AVCodecContext& codec = *writer.codec;
  codec.width = video.pictures.front().cols;
  codec.height = video.pictures.front().rows;
  codec.time_base = kMillisecond;
  codec.pix_fmt = AV_PIX_FMT_YUV420P;
  codec.color_range = AVCOL_RANGE_JPEG;
  codec.gop_size = video.key_every;
  codec.thread_count = 1;
  av_opt_set(codec.priv_data, "crf", "10", 0);
  if (video.interlaced) {
    codec.flags |= AV_CODEC_FLAG_INTERLACED_DCT | AV_CODEC_FLAG_INTERLACED_ME;
    codec.field_order = AV_FIELD_TT;
  }
  if ((writer.format->oformat->flags & AVFMT_GLOBALHEADER) != 0)
    codec.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  require(avcodec_open2(&codec, encoder, nullptr), "codec");
  AVStream* stream = avformat_new_stream(writer.format, nullptr);
  require(avcodec_parameters_from_context(stream->codecpar, &codec), "parameters");
  stream->time_base = kMillisecond;
  if (video.turn_deg != 0) {
    uint8_t* matrix =
        av_stream_new_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, 9 * sizeof(int32_t));
    av_display_rotation_set(reinterpret_cast<int32_t*>(matrix), video.turn_deg);
  }
  require(avio_open(&writer.format->pb, file.c_str(), AVIO_FLAG_WRITE), "file");
  require(avformat_write_header(writer.format, nullptr), "header");
}

void write_packets(Writer& writer, const AVFrame* frame) {
  require(avcodec_send_frame(writer.codec, frame), "send");
  while (avcodec_receive_packet(writer.codec, writer.packet) >= 0) {
    writer.packet->duration = 10;  // ms; without one, an edit list would hide the last picture
    av_packet_rescale_ts(writer.packet, kMillisecond, writer.format->streams[0]->time_base);
    require(av_interleaved_write_frame(writer.format, writer.packet), "packet");
  }
}

void fill(AVFrame& frame, const cv::Mat& picture) {
  require(av_frame_make_writable(&frame), "frame");
  for (int y = 0; y < picture.rows; ++y)
    std::memcpy(frame.data[0] + y * frame.linesize[0], picture.ptr(y),
                static_cast<size_t>(picture.cols));
  for (const int plane : {1, 2})
    for (int y = 0; y < picture.rows / 2; ++y)
      std::memset(frame.data[plane] + y * frame.linesize[plane], 128,
                  static_cast<size_t>(picture.cols / 2));
}

}  // namespace

void write_video(const WrittenVideo& video, const std::filesystem::path& file) {
  Writer writer;
  open(writer, video, file.string());
  writer.frame->format = writer.codec->pix_fmt;
  writer.frame->width = writer.codec->width;
  writer.frame->height = writer.codec->height;
  require(av_frame_get_buffer(writer.frame, 0), "buffer");
  for (size_t i = 0; i < video.pictures.size(); ++i) {
    fill(*writer.frame, video.pictures[i]);
    writer.frame->pts = std::lround(1e3 * video.times_s[i]);
    writer.frame->interlaced_frame = video.interlaced ? 1 : 0;
    writer.frame->top_field_first = video.interlaced ? 1 : 0;
    write_packets(writer, writer.frame);
  }
  write_packets(writer, nullptr);
  require(av_write_trailer(writer.format), "trailer");
}

}  // namespace clothfit
