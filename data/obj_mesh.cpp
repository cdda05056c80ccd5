#include "data/obj_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "data/input_error.h"
#include "data/number_limits.h"
#include "data/number_text.h"
#include "data/reading.h"
#include "data/shown_text.h"
#include "data/text_file.h"

namespace clothfit {
namespace {

/// Takes the next word off the beginning of `rest`; empty at the end.
std::string_view next_word(std::string_view& rest) {
  constexpr std::string_view kBlank = " \t";
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
  const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
  rest.remove_prefix(word.size());
  return word;
}

SurfaceMesh parsed_obj(const std::filesystem::path& file) {
  TextLines lines(file);
  std::vector<double> coordinates;
  std::vector<int> corners;
  while (lines.next()) {
    const int line = lines.line();
    std::string_view text = lines.text().substr(0, lines.text().find('#'));
    const std::string_view kind = next_word(text);
    if (std::max(coordinates.size(), corners.size()) > 3 * kMostObjElements)
      throw InputError(file.string(), line,
                       fmt::format("more than {} vertices or triangles", kMostObjElements),
                       "a coarser surface", "an obstacle needs no finer mesh than the cloth");
    if (kind == "v") {
      for (int axis = 0; axis < 3; ++axis) {
        const std::string_view word = next_word(text);
        const auto number = parse_number(word);
        if (!number)
          throw InputError(file.string(), line, "coordinate `" + shown_text(word) + "`",
                           "a vertex is three numbers, in metres");
        if (std::abs(*number) > kFarthest_m)
          throw InputError(file.string(), line, "coordinate `" + shown_text(word) + "`",
                           fmt::format("metres, {:g} at most", kFarthest_m));
        coordinates.push_back(*number);
      }
    } else if (kind == "f") {
      const int vertices = static_cast<int>(coordinates.size() / 3);
      std::vector<int> face;
      for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
        // VERTEX, VERTEX/TEXTURE, VERTEX//NORMAL or VERTEX/TEXTURE/NORMAL
        const auto index = parse_whole_number(word.substr(0, word.find('/')));
        if (!index || *index == 0 || *index > vertices || *index < -vertices)
          throw InputError(
              file.string(), line, "corner `" + shown_text(word) + "`",
              "corners are the numbers of vertices above, 1 to " + std::to_string(vertices));
        face.push_back(*index > 0 ? *index - 1 : vertices + *index);
      }
      if (face.size() < 3)
        throw InputError(file.string(), line,
                         "a face with " + std::to_string(face.size()) + " corners",
                         "a face has three or more");
      for (size_t n = 2; n < face.size(); ++n)
        corners.insert(corners.end(), {face[0], face[n - 1], face[n]});
    }
  }
  if (corners.empty())
    throw InputError(file.string(), "no faces", "a surface of triangles: lines `f a b c`");
  const SurfaceMesh mesh{
      Eigen::Map<const Eigen::Matrix3Xd>(coordinates.data(), 3,
                                         static_cast<Eigen::Index>(coordinates.size() / 3)),
      Eigen::Map<const Eigen::Matrix3Xi>(corners.data(), 3,
                                         static_cast<Eigen::Index>(corners.size() / 3))};
  if (!has_area(mesh))
    throw InputError(file.string(), "no face has an area",
                     "a surface: faces whose corners do not lie on a line");
  return mesh;
}

}  // namespace

bool has_area(const SurfaceMesh& mesh) {
  return std::ranges::any_of(mesh.triangle.colwise(), [&](const auto& corners) {
    const Eigen::Matrix3d at_m = mesh.vertex_m(Eigen::all, corners);
    return (at_m.col(1) - at_m.col(0)).cross(at_m.col(2) - at_m.col(0)).norm() > 0;
  });
}

SurfaceMesh read_obj(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_obj(file); });
}

void write_obj(const SurfaceMesh& mesh, const std::filesystem::path& file) {
  std::string text = "# metres, world axes\n";
  for (const auto& p : mesh.vertex_m.colwise())
    text += fmt::format("v {} {} {}\n", number_text(p.x()), number_text(p.y()), number_text(p.z()));
  for (const auto& t : mesh.triangle.colwise())  // OBJ counts from 1
    text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  write_text(text, file);
}

}  // namespace clothfit
