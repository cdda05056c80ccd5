// Checks videos that would lead elsewhere or overwhelm a decoder: playlists, references, sizes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <turbojpeg.h>
#include <unistd.h>

extern "C" {
#include <libavformat/avformat.h>
}

#include <array>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/ingest/picture_headers.h"
#include "tests/vision/ingest/written_video.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

/// Notices whether a file is opened.
class OpenWatch {
 public:
  explicit OpenWatch(const fs::path& file) : descriptor_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    EXPECT_GE(inotify_add_watch(descriptor_, file.c_str(), IN_OPEN), 0);
  }
  ~OpenWatch() { close(descriptor_); }
  OpenWatch(const OpenWatch&) = delete;
  OpenWatch& operator=(const OpenWatch&) = delete;

  bool opened() const {
    std::array<char, 4096> events{};
    return read(descriptor_, events.data(), events.size()) > 0;
  }

 private:
  int descriptor_;
};

WrittenVideo bright_film(int width = 128, int height = 96) {
  WrittenVideo video;
  for (int n = 0; n < 4; ++n) {
    cv::Mat grey(height, width, CV_8UC1);
    cv::RNG random(static_cast<std::uint64_t>(n) + 1);
    random.fill(grey, cv::RNG::UNIFORM, 90, 166);
    video.pictures.push_back(grey);
    video.times_s.push_back(0.04 * n);
  }
  return video;
}

int whole_pictures_in(const fs::path& file, std::string* said = nullptr) {
  const auto images = open_images(file);
  cv::Mat grey;
  int whole = 0;
  while (images->next(grey)) whole += images->damage().empty() ? 1 : 0;
  for (const Finding& finding : images->findings())
    if (said != nullptr) *said += finding.found + "\n";
  return whole;
}

TEST(HostileVideo, ThatIsAPlaylistIsRefusedAndNothingElseIsOpened) {
  const TemporaryFolder folder;
  write_video(bright_film(), folder / "other.mp4");
  ASSERT_EQ(whole_pictures_in(folder / "other.mp4"), 4);
  const std::string other = (folder / "other.mp4").string();
  const std::vector<std::string> playlists = {
      "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nother.mp4\n#EXT-X-ENDLIST\n",
      "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfile://" + other + "\n#EXT-X-ENDLIST\n",
      "#EXTM3U\n#EXT-X-MAP:URI=\"" + other + "\"\n#EXTINF:1,\n" + other + "\n",
      "ffconcat version 1.0\nfile other.mp4\n",
      "ffconcat version 1.0\nfile '" + other + "'\n",
      "<?xml version=\"1.0\"?><MPD xmlns=\"urn:mpeg:dash:schema:mpd:2011\" "
      "type=\"static\"><Period><AdaptationSet mimeType=\"video/mp4\"><Representation id=\"0\">"
      "<BaseURL>other.mp4</BaseURL></Representation></AdaptationSet></Period></MPD>",
      "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\n"
      "a=rtpmap:96 H264/90000\n",
      "[playlist]\nFile1=other.mp4\n",
      "<smil><body><video src=\"other.mp4\"/></body></smil>",
      "rtsp://127.0.0.1/other.mp4\n"};
  const OpenWatch watch(folder / "other.mp4");
  for (const std::string& playlist : playlists)
    for (const char* name : {"film.mp4", "film.m3u8", "film.mkv", "film"}) {
      SCOPED_TRACE(playlist);
      folder.write(name, playlist);
      expect_refused(folder, std::string(name) + ": no picture can be read",
                     [&] { whole_pictures_in(folder / name); });
    }
  EXPECT_FALSE(watch.opened());
}

/// Returns the bytes of a QuickTime box with its length.
std::string box(const std::string& type, const std::string& content) {
  const auto length = static_cast<std::uint32_t>(8 + content.size());
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(length >> shift);
  return bytes + type + content;
}

/// Makes the data reference inside a film's boxes name another file, as an alias of QuickTime does.
std::string refer_to(const std::string& boxes, const std::string& path) {
  std::string result;
  for (size_t at = 0; at + 8 <= boxes.size();) {
    std::uint32_t length = 0;
    for (size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<std::uint8_t>(boxes[at + i]);
    const std::string type = boxes.substr(at + 4, 4);
    std::string content = boxes.substr(at + 8, length - 8);
    if (type == "moov" || type == "trak" || type == "mdia" || type == "minf" || type == "dinf")
      content = refer_to(content, path);
    if (type == "dref") {
      std::string alias(150, '\0');  // names of volume and file, and levels to it: none
      const std::string padded = path + std::string(path.size() % 2, '\0');
      const std::string length_of_path{static_cast<char>(padded.size() >> 8),
                                       static_cast<char>(padded.size())};
      alias += std::string("\0\x02", 2) + length_of_path + padded +  // the absolute path
               std::string("\xff\xff\0\0", 4);
      content = content.substr(0, 8) + box("alis", std::string(4, '\0') + alias);
    }
    result += box(type, content);
    at += length;
  }
  return result;
}

TEST(HostileVideo, ThatRefersToAnotherFileDoesNotOpenIt) {
  const TemporaryFolder folder;
  write_video(bright_film(), folder / "other.mp4");
  write_bytes(refer_to(file_bytes(folder / "other.mp4"), (folder / "other.mp4").string()),
              folder / "film.mov");
  const OpenWatch watch(folder / "other.mp4");
  try {
    EXPECT_EQ(whole_pictures_in(folder / "film.mov"), 0);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("film.mov: no picture can be read"));
  }
  EXPECT_FALSE(watch.opened());
}

TEST(HostileVideo, ThatIsAPipeOrADeviceIsRefusedAtOnce) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "film.mp4").c_str(), 0600), 0);
  expect_refused(folder, "film.mp4: is a named pipe", [&] { open_images(folder / "film.mp4"); });
  fs::create_symlink("/dev/zero", folder / "film.mkv");
  expect_refused(folder, "film.mkv: is a device", [&] { open_images(folder / "film.mkv"); });
}

/// Writes pictures that are encoded already, each of any size, as a video that states one.
void write_packets(const std::vector<std::string>& packets, AVCodecID codec, int width, int height,
                   const fs::path& file) {
  AVFormatContext* format = nullptr;
  ASSERT_GE(avformat_alloc_output_context2(&format, nullptr, nullptr, file.c_str()), 0);
  AVStream* stream = avformat_new_stream(format, nullptr);
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = codec;
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  stream->time_base = {1, 1000};
  ASSERT_GE(avio_open(&format->pb, file.c_str(), AVIO_FLAG_WRITE), 0);
  ASSERT_GE(avformat_write_header(format, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  for (size_t n = 0; n < packets.size(); ++n) {
    ASSERT_GE(av_new_packet(packet, static_cast<int>(packets[n].size())), 0);
    packets[n].copy(reinterpret_cast<char*>(packet->data), packets[n].size());
    packet->pts = packet->dts = static_cast<std::int64_t>(40 * n);
    packet->duration = 40;
    packet->flags |= AV_PKT_FLAG_KEY;
    av_packet_rescale_ts(packet, {1, 1000}, stream->time_base);
    ASSERT_GE(av_write_frame(format, packet), 0);
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
  ASSERT_GE(av_write_trailer(format), 0);
  avio_closep(&format->pb);
  avformat_free_context(format);
}

std::string jpeg_of_size(int width, int height) {
  const std::vector<unsigned char> levels(static_cast<size_t>(width) * static_cast<size_t>(height),
                                          100);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const tjhandle encoder = tjInitCompress();
  tjCompress2(encoder, levels.data(), width, 0, height, TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, 90,
              0);
  std::string result(reinterpret_cast<const char*>(bytes), size);
  tjFree(bytes);
  tjDestroy(encoder);
  return result;
}

TEST(HostileVideo, WhoseSizeChangesMidwayIsRefusedWithBothSizes) {
  const TemporaryFolder folder;
  for (const char* name : {"film.mkv", "film.avi", "film.mov"}) {
    write_packets({jpeg_of_size(64, 48), jpeg_of_size(64, 48), jpeg_of_size(96, 64)},
                  AV_CODEC_ID_MJPEG, 64, 48, folder / name);
    expect_refused(folder, std::string(name) + ", picture 2: the picture is 96 x 64; 64 x 48",
                   [&] { whole_pictures_in(folder / name); });
  }
}

double most_memory_of_process_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

TEST(HostileVideo, OfAnImpossibleSizeIsRefusedBeforeAnyMemoryIsTaken) {
  const TemporaryFolder folder;
  const double before_MB = most_memory_of_process_MB();
  for (const auto& [width, height] :
       {std::pair(30000, 30000), std::pair(20000, 20000), std::pair(16, 16), std::pair(4000, 8)})
    for (const bool stated : {true, false})  // by the container too, or by the data only
      for (const char* name : {"film.mkv", "film.mov", "film.avi"}) {
        SCOPED_TRACE(testing::Message() << name << " " << width << " x " << height);
        const std::string png = pictures_of_size(static_cast<std::uint32_t>(width),
                                                 static_cast<std::uint32_t>(height))[0]
                                    .bytes;
        write_packets({png, png, png}, AV_CODEC_ID_PNG, stated ? width : 64, stated ? height : 48,
                      folder / name);
        EXPECT_THROW(whole_pictures_in(folder / name), InputError);
      }
  // 20000 x 20000 pixels are 400 MB at least; sanitizers keep back some of what is freed.
  EXPECT_LT(most_memory_of_process_MB() - before_MB, 100);
}

TEST(HostileVideo, WithAHugePictureMidwayLeavesThatOneOutAndSaysSo) {
  const TemporaryFolder folder;
  const double before_MB = most_memory_of_process_MB();
  std::string huge = jpeg_of_size(64, 48);
  const size_t frame = huge.find("\xff\xc0");
  huge.replace(frame + 5, 4, "\x9c\x40\x9c\x40");  // 40000 x 40000
  write_packets({jpeg_of_size(64, 48), jpeg_of_size(64, 48), huge, jpeg_of_size(64, 48)},
                AV_CODEC_ID_MJPEG, 64, 48, folder / "film.mkv");
  std::string said;
  EXPECT_EQ(whole_pictures_in(folder / "film.mkv", &said), 3);
  EXPECT_THAT(said, HasSubstr("1 of 4 pictures are damaged and left out: 2"));
  EXPECT_LT(most_memory_of_process_MB() - before_MB, 50);
}

}  // namespace
}  // namespace clothfit
