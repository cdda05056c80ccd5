#include "data/text_writer.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr size_t kWriteBlockBytes = 1 << 18;

[[noreturn]] void refuse_writing(const std::string& file, int error_number) {
  throw InputError(file, std::string("cannot be written: ") + std::strerror(error_number),
                   error_number == ELOOP || error_number == EEXIST
                       ? "a free name"
                       : "a writable place with room on its disk");
}

/// A descriptor that is written whole blocks at a time.
class BlockFile {
 public:
  BlockFile(std::string file, WriteStart start) : file_(std::move(file)) {
    const int mode = start == WriteStart::create ? O_EXCL : O_TRUNC;
    descriptor_ =
        open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | mode, 0666);
    if (descriptor_ < 0) refuse_writing(file_, errno);
    block_.reserve(kWriteBlockBytes);
  }
  ~BlockFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  BlockFile(const BlockFile&) = delete;
  BlockFile& operator=(const BlockFile&) = delete;

  void append(const char* bytes, size_t count) {
    block_.append(bytes, count);
    if (block_.size() >= kWriteBlockBytes) flush();
  }
  void close() {
    flush();
    if (::close(std::exchange(descriptor_, -1)) != 0) refuse_writing(file_, errno);
  }

 private:
  void flush() {
    for (size_t done = 0; done < block_.size();) {
      const ssize_t count = ::write(descriptor_, block_.data() + done, block_.size() - done);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) refuse_writing(file_, errno);
      done += static_cast<size_t>(count);
    }
    block_.clear();
  }

  std::string file_;
  int descriptor_ = -1;
  std::string block_;
};

/// Packs text into gzip's frame, which states no time and no name.
class GzipPacker {
 public:
  explicit GzipPacker(BlockFile& out) : out_(out), packed_(1 << 16) {
    constexpr int kGzipWindow = 15 + 16, kMemoryLevel = 8;
    if (deflateInit2(&stream_, 9, Z_DEFLATED, kGzipWindow, kMemoryLevel, Z_DEFAULT_STRATEGY) !=
        Z_OK)
      throw std::bad_alloc();
  }
  ~GzipPacker() { deflateEnd(&stream_); }
  GzipPacker(const GzipPacker&) = delete;
  GzipPacker& operator=(const GzipPacker&) = delete;

  void pack(std::string_view text, int flush) {
    constexpr size_t kPiece = 1 << 30;  // zlib counts in 32 bits
    do {
      const std::string_view piece = text.substr(0, kPiece);
      text.remove_prefix(piece.size());
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(piece.data()));
      stream_.avail_in = static_cast<uInt>(piece.size());
      do {
        stream_.next_out = packed_.data();
        stream_.avail_out = static_cast<uInt>(packed_.size());
        deflate(&stream_, text.empty() ? flush : Z_NO_FLUSH);
        out_.append(reinterpret_cast<const char*>(packed_.data()),
                    packed_.size() - stream_.avail_out);
      } while (stream_.avail_out == 0);
    } while (!text.empty());
  }

 private:
  BlockFile& out_;
  std::vector<Bytef> packed_;
  z_stream stream_{};
};

}  // namespace

/// Where text goes.
class TextWriter::Sink {
 public:
  virtual ~Sink() = default;
  virtual void append(std::string_view text) = 0;
  virtual void close() = 0;
};

namespace {

class PlainSink : public TextWriter::Sink {
 public:
  PlainSink(const std::filesystem::path& file, WriteStart start) : out_(file.string(), start) {}
  void append(std::string_view text) override { out_.append(text.data(), text.size()); }
  void close() override { out_.close(); }

 private:
  BlockFile out_;
};

class GzipSink : public TextWriter::Sink {
 public:
  GzipSink(const std::filesystem::path& file, WriteStart start)
      : out_(file.string(), start), packer_(out_) {}
  void append(std::string_view text) override { packer_.pack(text, Z_NO_FLUSH); }
  void close() override {
    packer_.pack({}, Z_FINISH);
    out_.close();
  }

 private:
  BlockFile out_;
  GzipPacker packer_;
};

}  // namespace

TextWriter::TextWriter(const std::filesystem::path& file, WriteStart start) {
  if (file.extension() == ".gz")
    sink_ = std::make_unique<GzipSink>(file, start);
  else
    sink_ = std::make_unique<PlainSink>(file, start);
}

TextWriter::~TextWriter() = default;

void TextWriter::append(std::string_view text) {
  sink_->append(text);
}

void TextWriter::close() {
  sink_->close();
}

}  // namespace clothfit
