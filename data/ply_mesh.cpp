#include "data/ply_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/file_limits.h"
#include "data/input_error.h"
#include "data/little_endian.h"
#include "data/number_limits.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/text_file.h"
#include "data/unpacked_bytes.h"

namespace clothfit {
namespace {

enum class Number { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

size_t bytes_of(Number type) {
  constexpr std::array<size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<size_t>(type)];
}

const std::map<std::string, Number, std::less<>>& number_names() {
  static const std::map<std::string, Number, std::less<>> names{
      {"char", Number::int8},      {"int8", Number::int8},       {"uchar", Number::uint8},
      {"uint8", Number::uint8},    {"short", Number::int16},     {"int16", Number::int16},
      {"ushort", Number::uint16},  {"uint16", Number::uint16},   {"int", Number::int32},
      {"int32", Number::int32},    {"uint", Number::uint32},     {"uint32", Number::uint32},
      {"float", Number::float32},  {"float32", Number::float32}, {"double", Number::float64},
      {"float64", Number::float64}};
  return names;
}

template <class Value>
double value_of(const char* bytes) {
  Value value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

/// Returns a number from its bytes, the lowest first.
double number_of(Number type, const char* bytes) {
  switch (type) {
    case Number::int8:
      return value_of<std::int8_t>(bytes);
    case Number::uint8:
      return value_of<std::uint8_t>(bytes);
    case Number::int16:
      return value_of<std::int16_t>(bytes);
    case Number::uint16:
      return value_of<std::uint16_t>(bytes);
    case Number::int32:
      return value_of<std::int32_t>(bytes);
    case Number::uint32:
      return value_of<std::uint32_t>(bytes);
    case Number::float32:
      return value_of<float>(bytes);
    case Number::float64:
      break;
  }
  return value_of<double>(bytes);
}

struct Property {
  std::string name;
  Number type = Number::float32;
  bool list = false;
  Number count_type = Number::uint8;  ///< of a list
};

struct Element {
  std::string name;
  size_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { text, little_endian, big_endian };

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t";
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
    if (line.empty()) return words;
    words.push_back(line.substr(0, line.find_first_of(kBlank)));
    line.remove_prefix(words.back().size());
  }
}

/// Reads a file from its beginning: lines of the header, then numbers.
class PlyReader {
 public:
  PlyReader(const std::filesystem::path& file, std::string bytes)
      : file_(file.string()), bytes_(std::move(bytes)) {
    read_header();
  }

  SurfaceMesh read() {
    for (const Element& element : elements_) {
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face") {
        read_faces(element);
      } else {
        for (size_t n = 0; n < element.count && !element.properties.empty(); ++n)
          pass_over(element.properties);
      }
    }
    line_ = 0;
    if (corners_.empty()) fail("no faces", "a surface: element `face` with vertex_indices");
    return {Eigen::Map<const Eigen::Matrix3Xd>(coordinates_.data(), 3,
                                               static_cast<Eigen::Index>(coordinates_.size() / 3)),
            Eigen::Map<const Eigen::Matrix3Xi>(corners_.data(), 3,
                                               static_cast<Eigen::Index>(corners_.size() / 3))};
  }

 private:
  [[noreturn]] void fail(const std::string& problem, const std::string& expected) const {
    if (line_ > 0 && encoding_ == Encoding::text) throw InputError(file_, line_, problem, expected);
    throw InputError(file_, problem, expected);
  }

  std::string_view next_line() {
    if (at_ >= bytes_.size()) fail("ends within its header", "a line `end_header`");
    const size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view line = std::string_view(bytes_).substr(at_, end - at_);
    at_ = end + 1;
    ++line_;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  void read_header() {
    if (next_line() != "ply") fail("does not begin with `ply`", "a PLY file");
    while (true) {
      const std::string_view line = next_line();
      const std::vector<std::string_view> words = words_of(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") {
        ++line_;
        break;
      }
      if (words[0] == "format" && words.size() == 3) {
        read_encoding(words[1]);
      } else if (words[0] == "element" && words.size() == 3) {
        read_element(words);
      } else if (words[0] == "property" && !elements_.empty()) {
        elements_.back().properties.push_back(property_of(words));
      } else {
        fail("header line `" + shown_text(line) + "`", "format, element, property or comment");
      }
    }
  }

  void read_encoding(std::string_view word) {
    if (word == "ascii")
      encoding_ = Encoding::text;
    else if (word == "binary_little_endian")
      encoding_ = Encoding::little_endian;
    else if (word == "binary_big_endian")
      encoding_ = Encoding::big_endian;
    else
      fail("format `" + shown_text(word) + "`", "ascii, binary_little_endian or binary_big_endian");
  }

  void read_element(const std::vector<std::string_view>& words) {
    const auto count = parse_whole_number(words[2]);
    if (!count || *count < 0) fail("element count `" + shown_text(words[2]) + "`", "0 or more");
    if (static_cast<size_t>(*count) > kMostObjElements)
      fail(fmt::format("{} elements", *count), fmt::format("{} at most", kMostObjElements));
    elements_.push_back({std::string(words[1]), static_cast<size_t>(*count), {}});
  }

  Number type_of(std::string_view word) const {
    const auto found = number_names().find(word);
    if (found == number_names().end())
      fail("type `" + shown_text(word) + "`", "a number type of PLY, such as float or int32");
    return found->second;
  }

  Property property_of(const std::vector<std::string_view>& words) const {
    if (words.size() == 3) return {.name = std::string(words[2]), .type = type_of(words[1])};
    if (words.size() == 5 && words[1] == "list")
      return {.name = std::string(words[4]),
              .type = type_of(words[3]),
              .list = true,
              .count_type = type_of(words[2])};
    fail("a property of " + std::to_string(words.size()) + " words",
         "`property TYPE NAME` or `property list TYPE TYPE NAME`");
  }

  double next_number(Number type) {
    if (encoding_ == Encoding::text) return next_text_number();
    const size_t size = bytes_of(type);
    if (bytes_.size() < size || at_ > bytes_.size() - size)
      fail("ends before its last element", "as many elements as its header says");
    std::array<char, 8> word{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at_), size, word.begin());
    at_ += size;
    const bool turn =
        (encoding_ == Encoding::little_endian) != (std::endian::native == std::endian::little);
    if (turn) std::reverse(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(size));
    return number_of(type, word.data());
  }

  double next_text_number() {
    constexpr std::string_view kBlank = " \t\r\n";
    while (at_ < bytes_.size() && kBlank.find(bytes_[at_]) != std::string_view::npos) {
      line_ += bytes_[at_] == '\n';
      ++at_;
    }
    if (at_ >= bytes_.size())
      fail("ends before its last element", "as many elements as its header says");
    const size_t end = std::min(bytes_.find_first_of(kBlank, at_), bytes_.size());
    const std::string_view word = std::string_view(bytes_).substr(at_, end - at_);
    at_ = end;
    const auto number = parse_number(word);
    if (!number) fail("number `" + shown_text(word) + "`", "a number");
    return *number;
  }

  size_t list_length(const Property& property) {
    const double count = next_number(property.count_type);
    constexpr double kMostCorners = 1000;
    if (!(count >= 0 && count <= kMostCorners && count == std::floor(count)))
      fail(fmt::format("a list of {:g}", count), "up to a thousand numbers");
    return static_cast<size_t>(count);
  }

  void pass_over(const Property& property) {
    const size_t count = property.list ? list_length(property) : 1;
    for (size_t n = 0; n < count; ++n) next_number(property.type);
  }
  void pass_over(const std::vector<Property>& properties) {
    for (const Property& property : properties) pass_over(property);
  }

  void read_vertices(const Element& element) {
    std::array<bool, 3> known{};
    for (const Property& property : element.properties)
      for (size_t axis = 0; axis < 3; ++axis)
        known[axis] =
            known[axis] || (!property.list && property.name == std::string(1, "xyz"[axis]));
    if (!known[0] || !known[1] || !known[2])
      fail("vertices without x, y and z", "these three as properties of element vertex");
    for (size_t n = 0; n < element.count; ++n) {
      std::array<double, 3> place_m{};
      for (const Property& property : element.properties) {
        const size_t axis = property.name.size() == 1 && !property.list
                                ? std::string_view("xyz").find(property.name[0])
                                : std::string_view::npos;
        if (axis == std::string_view::npos) {
          pass_over(property);
          continue;
        }
        place_m[axis] = next_number(property.type);
        if (!(std::abs(place_m[axis]) <= kFarthest_m))
          fail(fmt::format("coordinate `{:g}` of vertex {}", place_m[axis], n),
               fmt::format("metres, {:g} at most", kFarthest_m));
      }
      coordinates_.insert(coordinates_.end(), place_m.begin(), place_m.end());
    }
  }

  void read_faces(const Element& element) {
    for (size_t n = 0; n < element.count; ++n)
      for (const Property& property : element.properties) {
        if (property.list && (property.name == "vertex_indices" || property.name == "vertex_index"))
          read_face(property, n);
        else
          pass_over(property);
      }
  }

  void read_face(const Property& property, size_t face) {
    std::vector<int> corners;
    const size_t count = list_length(property);
    const auto vertices = static_cast<double>(coordinates_.size() / 3);
    for (size_t k = 0; k < count; ++k) {
      const double corner = next_number(property.type);
      if (!(corner >= 0 && corner < vertices && corner == std::floor(corner)))
        fail(fmt::format("corner {:.10g} of face {}", corner, face),
             fmt::format("numbers of vertices before, 0 to {:.10g}", vertices - 1));
      corners.push_back(static_cast<int>(corner));
    }
    if (count < 3)
      fail(fmt::format("face {} with {} corners", face, count), "a face has three or more");
    for (size_t k = 2; k < count; ++k)
      corners_.insert(corners_.end(), {corners[0], corners[k - 1], corners[k]});
    if (corners_.size() > 3 * kMostObjElements)
      fail(fmt::format("more than {} triangles", kMostObjElements), "a coarser surface");
  }

  std::string file_;
  std::string bytes_;
  size_t at_ = 0;
  int line_ = 0;
  Encoding encoding_ = Encoding::text;
  std::vector<Element> elements_;
  std::vector<double> coordinates_;
  std::vector<int> corners_;
};

std::string bytes_of(const std::filesystem::path& file) {
  UnpackedBytes source(file);
  std::string bytes;
  std::array<char, 65536> part;
  while (const size_t count = source.read(part.data(), part.size())) {
    bytes.append(part.data(), count);
    if (bytes.size() > kMostTextBytes)
      throw InputError(file.string(), "is too long",
                       fmt::format("{} bytes at most", kMostTextBytes));
  }
  return bytes;
}

}  // namespace

SurfaceMesh read_ply(const std::filesystem::path& file) {
  return reading(file, [&] {
    SurfaceMesh mesh = PlyReader(file, bytes_of(file)).read();
    if (!has_area(mesh))
      throw InputError(file.string(), "no face has an area",
                       "a surface: faces whose corners do not lie on a line");
    return mesh;
  });
}

void write_ply(const SurfaceMesh& mesh, const std::filesystem::path& file) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment metres, world axes\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      mesh.vertex_m.cols(), mesh.triangle.cols());
  for (const double coordinate : mesh.vertex_m.reshaped()) append_float64(coordinate, bytes);
  for (const auto& triangle : mesh.triangle.colwise()) {
    bytes += '\3';
    for (const int corner : triangle) append_int32(corner, bytes);
  }
  write_text(bytes, file);
}

SurfaceMesh read_surface(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  return name.ends_with(".ply") ? read_ply(file) : read_obj(file);
}

}  // namespace clothfit
