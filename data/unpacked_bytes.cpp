#include "data/unpacked_bytes.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <new>
#include <string_view>
#include <vector>

#include "data/file_bytes.h"
#include "data/file_limits.h"
#include "data/input_error.h"

namespace clothfit {
namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b";
constexpr size_t kBlockBytes = 1 << 16;

/// The bytes of a file as they lie on the disk, a block at a time.
class PackedBlocks {
 public:
  explicit PackedBlocks(const std::filesystem::path& file) : in_(file), block_(kBlockBytes) {
    fill();
  }
  /// Returns what was read and not used yet; empty at the end.
  std::string_view rest() {
    if (rest_.empty()) fill();
    return rest_;
  }
  void use(size_t count) { rest_.remove_prefix(count); }
  std::uintmax_t read_so_far() const { return total_; }

 private:
  void fill() {
    const size_t count = in_.read(block_.data(), block_.size());
    total_ += count;
    rest_ = {block_.data(), count};
  }
  FileBytes in_;
  std::vector<char> block_;
  std::string_view rest_;
  std::uintmax_t total_ = 0;
};

}  // namespace

class UnpackedBytes::Source {
 public:
  virtual ~Source() = default;
  virtual size_t read(char* to, size_t most) = 0;
};

namespace {

class PlainSource : public UnpackedBytes::Source {
 public:
  explicit PlainSource(const std::filesystem::path& file) : packed_(file) {
    if (packed_.rest().starts_with(kGzipMagic))
      throw InputError(file.string(), "the content is gzip-compressed",
                       "plain text behind a name that does not end in .gz",
                       "add .gz to its name, also where recording.yaml names it");
  }
  size_t read(char* to, size_t most) override {
    const size_t count = packed_.rest().copy(to, most);
    packed_.use(count);
    return count;
  }

 private:
  PackedBlocks packed_;
};

class GzipSource : public UnpackedBytes::Source {
 public:
  explicit GzipSource(const std::filesystem::path& file) : file_(file.string()), packed_(file) {
    if (!packed_.rest().empty() && !packed_.rest().starts_with(kGzipMagic))
      throw InputError(file_, "the content is not gzip-compressed",
                       "gzip data behind a name that ends in .gz", "compress it, or drop the .gz");
    constexpr int kGzipWindow = 15 + 16;  // zlib's way to ask for gzip's frame
    if (inflateInit2(&stream_, kGzipWindow) != Z_OK) throw std::bad_alloc();
  }
  ~GzipSource() override { inflateEnd(&stream_); }

  size_t read(char* to, size_t most) override {
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(most);
    while (stream_.avail_out == most && next_member()) inflate_more();
    const size_t count = most - stream_.avail_out;
    unpacked_ += count;
    line_ += static_cast<int>(std::count(to, to + count, '\n'));
    if (unpacked_ > kAlwaysUnpackedBytes &&
        unpacked_ > kMostUnpackedPerPacked * packed_.read_so_far())
      refuse(fmt::format("unpacks to more than {} times its size", kMostUnpackedPerPacked),
             "a table of measurements, which unpacks to 3 to 20 times its size",
             "look at what it holds; where it is right, unpack it and drop the .gz");
    return count;
  }

 private:
  /// Says whether more is to be unpacked; a file may hold several compressed pieces in a row.
  bool next_member() {
    if (!ended_) return true;
    if (packed_.rest().empty()) return false;
    if (packed_.rest().front() != kGzipMagic.front())
      refuse("other bytes follow the compressed data", "nothing behind them",
             "compress or copy the file again");
    inflateReset(&stream_);
    ended_ = false;
    return true;
  }

  void inflate_more() {
    const std::string_view rest = packed_.rest();
    if (rest.empty() && unpacked_ == 0 && packed_.read_so_far() == 0) {
      ended_ = true;  // An empty file holds an empty text.
      return;
    }
    if (rest.empty())
      refuse("the compressed data end too early", "a whole gzip file", "copy or compress it again");
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest.data()));
    stream_.avail_in = static_cast<uInt>(rest.size());
    const int status = inflate(&stream_, Z_NO_FLUSH);
    packed_.use(rest.size() - stream_.avail_in);
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    if (status == Z_STREAM_END)
      ended_ = true;
    else if (status != Z_OK)
      refuse("the compressed data are damaged", "a whole gzip file", "copy or compress it again");
  }

  [[noreturn]] void refuse(const std::string& problem, const std::string& expected,
                           const std::string& remedy) const {
    throw InputError(file_, line_, problem, expected, remedy);
  }

  std::string file_;
  int line_ = 1;  ///< of the text unpacked so far
  PackedBlocks packed_;
  z_stream stream_{};
  bool ended_ = false;  ///< the present piece
  std::uintmax_t unpacked_ = 0;
};

}  // namespace

UnpackedBytes::UnpackedBytes(const std::filesystem::path& file) {
  if (file.extension() == ".gz")
    source_ = std::make_unique<GzipSource>(file);
  else
    source_ = std::make_unique<PlainSource>(file);
}

UnpackedBytes::~UnpackedBytes() = default;

size_t UnpackedBytes::read(char* to, size_t most) {
  return source_->read(to, most);
}

}  // namespace clothfit
