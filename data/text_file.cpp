#include "data/text_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "data/file_bytes.h"
#include "data/input_error.h"
#include "data/reading.h"
#include "data/text_writer.h"

namespace clothfit {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

[[noreturn]] void refuse_nul(const std::string& file, int line) {
  throw InputError(file, line, "a NUL byte, which no text holds", "text in UTF-8",
                   "save it as UTF-8, or name the file that holds the text");
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

TextLines::TextLines(const std::filesystem::path& file)
    // Room for the longest line, its end, and the block in which it ends.
    : file_(file.string()), bytes_(file), buffer_(4 * kMostLineBytes, '\0') {
  while (end_ < kByteOrderMark.size() && read_on()) continue;
  if (std::string_view(buffer_.data(), end_).starts_with(kByteOrderMark))
    begin_ = kByteOrderMark.size();
}

bool TextLines::read_on() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const size_t count = bytes_.read(buffer_.data() + end_, buffer_.size() - end_);
  end_ += count;
  return count > 0;
}

bool TextLines::next() {
  ++line_;
  size_t searched = 0;
  for (bool more = true;;) {
    const std::string_view rest(buffer_.data() + begin_, end_ - begin_);
    // `\r` as the last byte read may be the first half of `\r\n`.
    const size_t found = rest.find_first_of(std::string_view("\r\n\0", 3), searched);
    const bool ends_here = found != std::string_view::npos &&
                           (rest[found] != '\r' || found + 1 < rest.size() || !more);
    const size_t length = found == std::string_view::npos ? rest.size() : found;
    if (length > kMostLineBytes)
      throw InputError(file_, line_, fmt::format("a line of more than {} bytes", kMostLineBytes),
                       "text in short lines", "look at what the file holds");
    if (ends_here || !more) {
      if (!ends_here && rest.empty()) return false;
      text_ = rest.substr(0, length);
      if (ends_here && rest[found] == '\0') refuse_nul(file_, line_);
      begin_ += length;
      if (ends_here) begin_ += rest.substr(found).starts_with("\r\n") ? 2 : 1;
      return true;
    }
    searched = length;
    more = read_on();
  }
}

namespace {

std::string unpacked_text(const std::filesystem::path& file, std::uintmax_t most_bytes) {
  UnpackedBytes bytes(file);
  std::string text;
  for (;;) {
    constexpr size_t kBlockBytes = 1 << 16;
    const size_t filled = text.size();
    text.resize(filled + kBlockBytes);
    const size_t count = bytes.read(text.data() + filled, kBlockBytes);
    text.resize(filled + count);
    if (count == 0) break;
    if (text.size() > most_bytes) refuse_file_size(file, most_bytes);
  }
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  unify_line_ends(text);
  if (const size_t nul = text.find('\0'); nul != std::string::npos)
    refuse_nul(file.string(),
               1 + static_cast<int>(std::count(text.begin(), text.begin() + nul, '\n')));
  return text;
}

}  // namespace

std::string read_text(const std::filesystem::path& file, std::uintmax_t most_bytes) {
  return reading(file, [&] { return unpacked_text(file, most_bytes); });
}

void write_text(std::string_view text, const std::filesystem::path& file) {
  TextWriter out(file);
  out.append(text);
  out.close();
}

}  // namespace clothfit
