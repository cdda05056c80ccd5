#include "vision/encode/encode_picture.h"

#include <png.h>
#include <turbojpeg.h>
#include <zlib.h>

#include <bit>
#include <cassert>
#include <csetjmp>
#include <memory>
#include <stdexcept>

#include "data/text_file.h"

// OpenCV's codecs would do, but bring a hundred libraries that every start of the program must
// load.
namespace clothfit {
namespace {

void append(png_structp png, png_bytep data, size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(data), size);
}

void flush(png_structp) {}

/// libpng jumps here on failure, so nothing in this function may need a destructor.
bool put_png(png_structp png, png_infop info, const cv::Mat& picture, std::string& bytes) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, &bytes, append, flush);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.cols),
               static_cast<png_uint_32>(picture.rows), picture.depth() == CV_8U ? 8 : 16,
               picture.channels() == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_bgr(png);
  if constexpr (std::endian::native == std::endian::little)
    png_set_swap(png);  // levels of 16 bits lie in a file with their high byte first
  for (int row = 0; row < picture.rows; ++row) png_write_row(png, picture.ptr(row));
  png_write_end(png, info);
  return true;
}

}  // namespace

std::string encode_png(const cv::Mat& picture) {
  assert(picture.depth() == CV_8U || picture.depth() == CV_16U);
  assert(picture.channels() == 1 || picture.channels() == 3);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::string bytes;
  const bool written = put_png(png, info, picture, bytes);
  png_destroy_write_struct(&png, &info);
  if (!written) throw std::runtime_error("libpng encoded no picture");
  return bytes;
}

void write_png(const cv::Mat& picture, const std::filesystem::path& file) {
  write_text(encode_png(picture), file);
}

std::string encode_jpeg(const cv::Mat& grey, int quality) {
  assert(grey.type() == CV_8UC1);
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int failed =
      tjCompress2(encoder.get(), grey.data, grey.cols, static_cast<int>(grey.step), grey.rows,
                  TJPF_GRAY, &data, &size, TJSAMP_GRAY, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> held(data, tjFree);
  if (failed != 0) throw std::runtime_error(tjGetErrorStr2(encoder.get()));
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace clothfit
