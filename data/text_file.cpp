#include "data/text_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

#include "data/input_error.h"

namespace clothfit {
namespace {

bool is_compressed_name(const std::filesystem::path& file) {
  return file.extension() == ".gz";
}

std::string error_text(int error_number) {
  return std::strerror(error_number);
}

int lines_in(const std::string& text) {
  return 1 + static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

std::string read_compressed(const std::filesystem::path& file) {
  const std::unique_ptr<gzFile_s, decltype(&gzclose_r)> in(gzopen(file.c_str(), "rb"), &gzclose_r);
  if (!in)
    throw InputError(file.string(), "cannot be opened: " + error_text(errno), "a readable file");
  std::string text;
  std::array<char, 1 << 16> block;
  for (;;) {
    const int count = gzread(in.get(), block.data(), static_cast<unsigned>(block.size()));
    if (count > 0) text.append(block.data(), static_cast<size_t>(count));
    int status = Z_OK;
    gzerror(in.get(), &status);
    if (count < 0 || status == Z_BUF_ERROR) {
      const bool cut_short = status == Z_BUF_ERROR;
      throw InputError(
          file.string(), lines_in(text),
          cut_short ? "the compressed data end too early" : "the compressed data are damaged",
          "a whole gzip file", "copy or compress the file again");
    }
    if (count == 0) break;
  }
  if (gzdirect(in.get()) != 0 && !text.empty())
    throw InputError(file.string(), "the content is not gzip-compressed",
                     "gzip data behind a name that ends in .gz", "compress it, or drop the .gz");
  return text;
}

std::string read_plain(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw InputError(file.string(), "cannot be opened: " + error_text(errno), "a readable file");
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad())
    throw InputError(file.string(), "cannot be read: " + error_text(errno), "a readable file");
  if (text.starts_with("\x1f\x8b"))
    throw InputError(file.string(), "the content is gzip-compressed",
                     "plain text behind a name that does not end in .gz",
                     "add .gz to its name, also where recording.yaml names it");
  return text;
}

void unify_line_ends(std::string& text) {
  if (text.find('\r') == std::string::npos) return;
  std::string unified;
  unified.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\r') {
      unified += '\n';
      if (i + 1 < text.size() && text[i + 1] == '\n') ++i;
    } else {
      unified += text[i];
    }
  }
  text = std::move(unified);
}

}  // namespace

std::string read_text(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    throw InputError(file.string(), "there is no such file", "a file", "check the path");
  if (std::filesystem::is_directory(status))
    throw InputError(file.string(), "is a folder", "a file", "name the file inside it");
  std::string text = is_compressed_name(file) ? read_compressed(file) : read_plain(file);
  constexpr const char* kByteOrderMark = "\xef\xbb\xbf";
  if (text.starts_with(kByteOrderMark)) text.erase(0, std::strlen(kByteOrderMark));
  unify_line_ends(text);
  return text;
}

void write_text(const std::string& text, const std::filesystem::path& file) {
  const auto refuse = [&file] {
    throw InputError(file.string(), "cannot be written: " + error_text(errno),
                     "a writable place with room on its disk");
  };
  if (is_compressed_name(file)) {
    const gzFile out = gzopen(file.c_str(), "wb9");
    if (out == nullptr) refuse();
    const bool written = gzfwrite(text.data(), 1, text.size(), out) == text.size();
    const bool closed = gzclose_w(out) == Z_OK;
    if (!written || !closed) refuse();
    return;
  }
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (!out) refuse();
}

}  // namespace clothfit
