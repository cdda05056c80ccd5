#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace clothfit {

/// A point of the cloth that can be measured, in material coordinates: metres on the flat cloth. s
/// runs along the columns (to the right on the printed side), t along the rows (down).
struct Marker {
  std::string name;
  double s_m = 0;
  double t_m = 0;
  std::optional<int> tag;     ///< id of the tag that carries it
  std::optional<int> corner;  ///< 0 bottom left, 1 bottom right, 2 top right, 3 top left
};

enum class MarkerKind { apriltag, dots, texture, none };

struct MarkerSet {
  MarkerKind kind = MarkerKind::none;
  std::string family;  ///< tag family, such as tag36h11; empty where there are no tags
  std::vector<Marker> markers;
  std::unordered_map<std::string, int> index;  ///< name -> place in `markers`
};

inline constexpr double kPlaceRounding_m = 1e-6;  ///< largest rounding error of a place

/// Says whether (s, t) lies on a cloth of width x height metres, its edges included.
bool lies_on_cloth(double s_m, double t_m, double width_m, double height_m);

/// Reads the rows of markers.csv. Refuses duplicate names, a tag without a corner, and a marker
/// outside a cloth of `width_m` x `height_m`. Throws InputError.
std::vector<Marker> read_markers(const std::filesystem::path& file, double width_m,
                                 double height_m);
void write_markers(const std::vector<Marker>& markers, const std::filesystem::path& file);

/// A fixed point of the scene, in world coordinates.
struct ReferencePoint {
  std::string name;
  double x_m = 0, y_m = 0, z_m = 0;
  std::optional<int> tag;
  std::optional<int> corner;
};
std::vector<ReferencePoint> read_reference_points(const std::filesystem::path& file);
void write_reference_points(const std::vector<ReferencePoint>& points,
                            const std::filesystem::path& file);

}  // namespace clothfit
