#include "vision/ingest/libav.h"

extern "C" {
#include <libavutil/imgutils.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <fmt/core.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "data/file_bytes.h"
#include "data/input_error.h"
#include "vision/ingest/picture_limits.h"

namespace clothfit::libav {
namespace {

std::atomic<long> errors = 0;

/// Counts libav's errors instead of printing its messages.
void count_errors(void* /*context*/, int level, const char* /*format*/, va_list /*values*/) {
  if (level <= AV_LOG_ERROR) ++errors;
}

/// Keeps libav's own messages off the terminal, from the first use on, and bounds every single
/// piece of memory that it takes: by the largest picture in four colours of 16 bits, with its
/// margins.
void prepare() {
  static const bool done = [] {
    av_log_set_callback(count_errors);
    constexpr size_t kMargins = size_t{1} << 26;
    av_max_alloc(8 * size_t{kMostPixels} + kMargins);
    return true;
  }();
  static_cast<void>(done);
}

/// Refuses every further file that a container names.
int open_nothing(AVFormatContext* /*format*/, AVIOContext** /*io*/, const char* /*url*/,
                 int /*flags*/, AVDictionary** /*options*/) {
  return AVERROR(EPERM);
}

/// Containers that cameras and video programs write. Playlists are left out, and raw streams, whose
/// times libav would invent.
constexpr const char* kContainers =
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,ogg,flv,asf,ivf,yuv4mpegpipe,mxf,dv,nut";

/// Looks into the streams of a container. Their own decoders, which this opens, are bounded as
/// well.
int find_streams(AVFormatContext& format) {
  std::vector<AVDictionary*> options(format.nb_streams, nullptr);
  for (AVDictionary*& of_stream : options)
    av_dict_set_int(&of_stream, "max_pixels", kMostPixels, 0);
  const size_t count = options.size();
  const int found = avformat_find_stream_info(&format, count > 0 ? options.data() : nullptr);
  for (AVDictionary*& of_stream : options) av_dict_free(&of_stream);
  return found;
}

/// Converts a frame into another pixel format of the same size.
cv::Mat converted(const AVFrame& frame, AVPixelFormat format, int type) {
  cv::Mat result(frame.height, frame.width, type);
  const std::unique_ptr<SwsContext, void (*)(SwsContext*)> scaler(
      sws_getContext(frame.width, frame.height, static_cast<AVPixelFormat>(frame.format),
                     frame.width, frame.height, format, SWS_POINT | SWS_ACCURATE_RND, nullptr,
                     nullptr, nullptr),
      sws_freeContext);
  if (!scaler) return {};
  const std::array<uint8_t*, 4> to{result.data};
  const std::array<int, 4> stride{static_cast<int>(result.step)};
  if (sws_scale(scaler.get(), frame.data, frame.linesize, 0, frame.height, to.data(),
                stride.data()) != frame.height)
    return {};
  return result;
}

GreyLevels grey_of_colours(const AVFrame& frame, int bits) {
  GreyLevels grey{.levels = {}, .bits = bits > 8 ? 16 : 8};
  const cv::Mat colours = bits > 8 ? converted(frame, AV_PIX_FMT_BGR48LE, CV_16UC3)
                                   : converted(frame, AV_PIX_FMT_BGR24, CV_8UC3);
  if (!colours.empty()) cv::cvtColor(colours, grey.levels, cv::COLOR_BGR2GRAY);
  return grey;
}

/// Stretches video levels, where black is 16 and white 235 of 8 bits, to the full range.
void stretch_video_range(GreyLevels& grey) {
  const double step = 1 << (grey.bits - 8);
  const double white = (1 << grey.bits) - 1;
  const double factor = white / (219 * step);
  grey.levels.convertTo(grey.levels, -1, factor, -16 * step * factor);
  if (grey.bits > 8 && grey.bits < 16) cv::min(grey.levels, white, grey.levels);
}

GreyLevels grey_of_luma(const AVFrame& frame, const AVPixFmtDescriptor& format) {
  const AVComponentDescriptor& luma = format.comp[0];
  GreyLevels grey{.levels = {}, .bits = luma.depth};
  const bool wide = luma.depth > 8;
  const bool plain = luma.offset == 0 && luma.shift == 0 && luma.step == (wide ? 2 : 1) &&
                     (!wide || (format.flags & AV_PIX_FMT_FLAG_BE) == 0);
  if (plain) {
    cv::Mat(frame.height, frame.width, wide ? CV_16UC1 : CV_8UC1, frame.data[luma.plane],
            static_cast<size_t>(frame.linesize[luma.plane]))
        .copyTo(grey.levels);
  } else {
    const std::array<const uint8_t*, 4> data{frame.data[0], frame.data[1], frame.data[2],
                                             frame.data[3]};
    grey.levels.create(frame.height, frame.width, CV_16UC1);
    for (int y = 0; y < frame.height; ++y)
      av_read_image_line(grey.levels.ptr<uint16_t>(y), const_cast<const uint8_t**>(data.data()),
                         frame.linesize, &format, 0, y, 0, frame.width, 0);
    if (!wide) grey.levels.convertTo(grey.levels, CV_8U);
  }
  return grey;
}

void refuse_transparent(const AVFrame& frame, const std::string& where) {
  const cv::Mat pixels = converted(frame, AV_PIX_FMT_BGRA, CV_8UC4);
  if (pixels.empty()) return;
  cv::Mat alpha;
  cv::extractChannel(pixels, alpha, 3);
  const int clear = static_cast<int>(pixels.total()) - cv::countNonZero(alpha == 255);
  if (clear > 0)
    throw InputError(where, fmt::format("{} of its pixels are transparent", clear),
                     "a picture whose every pixel has a grey level",
                     "render or save it on an opaque background");
}

}  // namespace

long errors_logged() {
  return errors;
}

std::string error_text(int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return text.data();
}

/// Hands libav the bytes of one file.
struct Container::Bytes {
  explicit Bytes(const std::filesystem::path& path)
      : file(fdopen(open_regular_file(path), "rb"), std::fclose) {
    if (!file)
      throw InputError(path.string(), fmt::format("cannot be opened: {}", std::strerror(errno)),
                       "a readable file");
    constexpr int kBlock = 1 << 16;
    auto* block = static_cast<unsigned char*>(av_malloc(kBlock));
    io = avio_alloc_context(block, kBlock, 0, this, read, nullptr, seek);
  }
  ~Bytes() {
    if (io != nullptr) av_freep(&io->buffer);
    avio_context_free(&io);
  }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;

  static int read(void* self, uint8_t* to, int size) {
    const size_t got =
        std::fread(to, 1, static_cast<size_t>(size), static_cast<Bytes*>(self)->file.get());
    return got > 0 ? static_cast<int>(got) : AVERROR_EOF;
  }
  static int64_t seek(void* self, int64_t offset, int from) {
    std::FILE* file = static_cast<Bytes*>(self)->file.get();
    const int64_t here = std::ftell(file);
    if (from == AVSEEK_SIZE) {
      std::fseek(file, 0, SEEK_END);
      const int64_t size = std::ftell(file);
      std::fseek(file, here, SEEK_SET);
      return size;
    }
    return std::fseek(file, offset, from & ~AVSEEK_FORCE) == 0 ? std::ftell(file) : AVERROR(EIO);
  }

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file;
  AVIOContext* io = nullptr;
};

Container::Container(const std::filesystem::path& file) : bytes_(std::make_unique<Bytes>(file)) {
  prepare();
  format_ = avformat_alloc_context();
  format_->pb = bytes_->io;
  format_->flags |= AVFMT_FLAG_CUSTOM_IO;
  format_->io_open = open_nothing;
  AVDictionary* options = nullptr;
  av_dict_set(&options, "format_whitelist", kContainers, 0);
  av_dict_set(&options, "protocol_whitelist", "none", 0);
  for (const char* references : {"enable_drefs", "use_absolute_path"})  // of a QuickTime film
    av_dict_set(&options, references, "0", 0);
  const int opened = avformat_open_input(&format_, nullptr, nullptr, &options);
  av_dict_free(&options);
  const int found = opened < 0 ? opened : find_streams(*format_);
  if (found >= 0) return;
  close();
  throw InputError(file.string(),
                   fmt::format("no picture can be read from it ({})", error_text(found)),
                   "a folder of pictures or a video",
                   "check that the file is whole and that a video player shows it");
}

Container::~Container() {
  close();
}

void Container::close() {
  avformat_close_input(&format_);
}

GreyLevels grey_levels(const AVFrame& frame, const std::string& where) {
  const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
  if (format == nullptr || frame.width <= 0 || frame.height <= 0) return {};
  const bool palette = (format->flags & AV_PIX_FMT_FLAG_PAL) != 0;
  if (palette || (format->flags & AV_PIX_FMT_FLAG_ALPHA) != 0) refuse_transparent(frame, where);
  const bool bits_or_tiles =
      (format->flags & (AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL)) != 0;
  if (palette || bits_or_tiles || (format->flags & AV_PIX_FMT_FLAG_RGB) != 0)
    return grey_of_colours(frame, format->comp[0].depth);
  GreyLevels grey = grey_of_luma(frame, *format);
  // Grey alone has no chroma, and the whole range unless it says otherwise.
  const bool colour = format->nb_components >= 3;
  const bool full = frame.color_range == AVCOL_RANGE_JPEG ||
                    (frame.color_range == AVCOL_RANGE_UNSPECIFIED && !colour) ||
                    std::string(format->name).starts_with("yuvj");
  if (!full) stretch_video_range(grey);
  return grey;
}

GreyLevels decode_still(std::string bytes, AVCodecID codec, const std::string& where,
                        std::string& damage) {
  prepare();
  const AVCodec* decoder = avcodec_find_decoder(codec);
  const Codec context(avcodec_alloc_context3(decoder));
  // Of a TIFF's many optional tags the decoder knows some, and would take others for errors.
  context->err_recognition =
      codec == AV_CODEC_ID_TIFF ? AV_EF_CRCCHECK : AV_EF_CRCCHECK | AV_EF_EXPLODE;
  context->max_pixels = kMostPixels;
  context->thread_count = 1;
  const Packet packet(av_packet_alloc());
  const Frame frame(av_frame_alloc());
  int code = decoder == nullptr ? AVERROR_DECODER_NOT_FOUND
                                : avcodec_open2(context.get(), decoder, nullptr);
  // Decoders read ahead into the padding. A copy would double the memory of a large file.
  packet->size = static_cast<int>(bytes.size());
  bytes.append(AV_INPUT_BUFFER_PADDING_SIZE, '\0');
  packet->data = reinterpret_cast<uint8_t*>(bytes.data());
  packet->buf = av_buffer_create(
      packet->data, bytes.size(), [](void*, uint8_t*) {}, nullptr, AV_BUFFER_FLAG_READONLY);
  const long before = errors_logged();
  if (code >= 0) code = avcodec_send_packet(context.get(), packet.get());
  if (code >= 0) code = avcodec_send_packet(context.get(), nullptr);
  if (code >= 0) code = avcodec_receive_frame(context.get(), frame.get());
  if (code < 0) {
    damage = error_text(code);
    return {};
  }
  if (errors_logged() != before || frame->decode_error_flags != 0 ||
      (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0)
    damage = "its data are damaged";
  // TIFF's YCbCr has the whole range, unlike a video's, unless ReferenceBlackWhite says otherwise.
  if (codec == AV_CODEC_ID_TIFF && frame->color_range == AVCOL_RANGE_UNSPECIFIED)
    frame->color_range = AVCOL_RANGE_JPEG;
  return grey_levels(*frame, where);
}

}  // namespace clothfit::libav
