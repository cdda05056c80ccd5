#include "apps/steps/recording_draft.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "data/input_error.h"
#include "data/number_text.h"
#include "vision/ingest/frame_list.h"
#include "vision/ingest/frame_times.h"
#include "vision/look/seen_motion.h"
#include "vision/look/sheet_match.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Returns text as a YAML string, whatever is in it.
std::string yaml_text(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

/// A corner of the cloth, and its words.
struct ClothCorner {
  const char* name;
  double s, t;  ///< shares of width and height
};
constexpr std::array kCorners = {ClothCorner{"top left", 0, 0}, ClothCorner{"top right", 1, 0},
                                 ClothCorner{"bottom left", 0, 1},
                                 ClothCorner{"bottom right", 1, 1}};

struct ClothSide {
  const char* name;
  double s, t;   ///< one of its ends
  bool along_s;  ///< it runs along s
};
constexpr std::array kSides = {ClothSide{"top", 0, 0, true}, ClothSide{"bottom", 0, 1, true},
                               ClothSide{"left", 0, 0, false}, ClothSide{"right", 1, 0, false}};

/// A sheet, and how its tags or dots move.
class MovingSheet {
 public:
  MovingSheet(const Recording& sheet, SeenMotion motion)
      : sheet_(sheet), motion_(std::move(motion)) {}

  const SeenMotion& motion() const { return motion_; }
  bool moves() const { return motion_.typical_px > kMoves_px; }

  /// Says whether the cloth hardly moves at a place (shares of width and height) of its border.
  bool rests_at(double s, double t) const {
    const double way_px = way_at({s * sheet_.cloth.width_m, t * sheet_.cloth.height_m});
    return way_px < kRests * motion_.typical_px;
  }

  /// Says whether it hardly moves all along a side.
  bool rests_along(const ClothSide& side) const {
    constexpr int kPlaces = 8;
    for (int i = 0; i <= kPlaces; ++i) {
      const double along = static_cast<double>(i) / kPlaces;
      if (!rests_at(side.along_s ? along : side.s, side.along_s ? side.t : along)) return false;
    }
    return true;
  }

 private:
  static constexpr double kMoves_px = 3;  // beyond noise and a camera that shakes
  /// Share of the way of most tags. Raised: cloth near a held point is taken for held itself.
  static constexpr double kRests = 0.12;

  /// Returns the way at a place, continued linearly from the four nearest tags or dots: they do not
  /// reach the border.
  double way_at(const Eigen::Vector2d& place_m) const {
    std::vector<std::pair<double, const SeenWay*>> nearest;
    for (const SeenWay& way : motion_.ways)
      nearest.emplace_back((way.place_m - place_m).norm(), &way);
    std::ranges::stable_sort(nearest, {}, [](const auto& one) { return one.first; });
    constexpr size_t kWays = 4;
    if (nearest.size() < kWays) return INFINITY;
    Eigen::Matrix<double, kWays, 3> plane;
    Eigen::Matrix<double, kWays, 1> ways_px;
    for (size_t i = 0; i < kWays; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::Vector2d apart_m = nearest[i].second->place_m - place_m;
      plane.row(row) << 1, apart_m.x(), apart_m.y();
      ways_px[row] = nearest[i].second->way_px;
    }
    // Four in a line leave the slope across it open; the smallest one is taken then.
    return plane.completeOrthogonalDecomposition().solve(ways_px)[0];
  }

  const Recording& sheet_;
  SeenMotion motion_;
};

/// Writes the draft part by part.
class Draft {
 public:
  Draft(const DraftInput& input, const std::string& name, const fs::path& folder)
      : input_(input),
        folder_(folder),
        moving_(input.sheet, measure_motion(input.footage.front().seen, input.sheet.markers)) {
    yaml_ = fmt::format("format: clothfit-recording/1\nname: {}\n", yaml_text(name));
  }

  RecordingDraft write() {
    require_sheet();
    cloth();
    time();
    cameras();
    reference();
    held();
    start();
    held_out();
    return {.yaml = yaml_, .assumed = std::move(assumed_), .needed = std::move(needed_)};
  }

 private:
  template <class... Values>
  void line(fmt::format_string<Values...> text, Values&&... values) {
    yaml_ += fmt::format(text, std::forward<Values>(values)...) + "\n";
  }
  std::string relative(const fs::path& path) const {
    return fs::proximate(fs::absolute(path), fs::absolute(folder_)).string();
  }

  bool of_dots() const { return input_.sheet.markers.kind == MarkerKind::dots; }
  const char* word() const { return of_dots() ? "dots" : "tags"; }

  /// Refuses footage that shows another sheet, and says how much of the sheet it shows.
  void require_sheet() {
    const MarkerSet& markers = input_.sheet.markers;
    for (const LookedFootage& footage : input_.footage) {
      const SheetMatch match = match_sheet(footage.seen, markers);
      const std::string seen =
          fmt::format("shows {} of the {} {} of the sheet", match.shown, match.listed, word());
      std::string others;
      if (!match.others.empty())
        others = fmt::format(", and {} tags that it does not list: {}", match.others.size(),
                             list_numbers({match.others.begin(), match.others.end()}));
      if (match.shown == 0)
        throw InputError(footage.images.string(), seen + others,
                         of_dots() ? "the dots of the sheet, 4 px wide or more"
                                   : fmt::format("tags of {}", markers.family),
                         footage.seen.turned.empty() ? "give the sheet that is on the cloth"
                                                     : footage.seen.turned);
      if (match.is_another())
        throw InputError(footage.images.string(),
                         match.misplaced > 0
                             ? fmt::format("{}{}; {} of {} neighbours do not lie as it says", seen,
                                           others, match.misplaced, match.pairs)
                             : seen + others,
                         "the sheet that is on the cloth",
                         "look at the ids with clothfit detect, and give that sheet");
      assumed_.push_back(
          fmt::format("the sheet: {} {}{}", footage.images.filename().string(), seen, others));
    }
  }

  void cloth() {
    const ClothDescription& cloth = input_.sheet.cloth;
    line("cloth:");
    line("  size: [{}, {}]  # m, of the sheet", number_text(cloth.width_m),
         number_text(cloth.height_m));
    if (input_.mass_kg) {
      line("  mass: {}  # kg", number_text(*input_.mass_kg));
    } else {
      line("  mass: null  # NEEDED, kg: weigh the dry cloth with its print");
      needed_.push_back(
          "the mass of the cloth: weigh it (without it only ratios to the mass are found)");
    }
    if (cloth.masses == MassDistribution::equal) line("  masses: equal  # as the sheet has it");
    line("  mesh: {{columns: {}, rows: {}}}", cloth.mesh_columns, cloth.mesh_rows);
    const std::string& family = input_.sheet.markers.family;
    line("markers: {{kind: {},{} file: markers.csv}}", to_string(input_.sheet.markers.kind),
         family.empty() ? "" : fmt::format(" family: {},", family));
    const Eigen::Vector3d& gravity = input_.sheet.gravity_m_per_s2;
    line("gravity: [{}, {}, {}]  # m/s2", number_text(gravity.x()), number_text(gravity.y()),
         number_text(gravity.z()));
    assumed_.push_back(
        fmt::format("of the sheet's recording: masses {}, a mesh of {} x {}, gravity",
                    cloth.masses == MassDistribution::equal ? "equal" : "by area",
                    cloth.mesh_columns, cloth.mesh_rows));
  }

  void time() {
    const bool states_times = std::ranges::all_of(
        input_.footage, [](const LookedFootage& one) { return !one.seen.times_s.empty(); });
    if (input_.frame_rate_hz) {
      // A rate that a video's own times contradict is refused here, as it would be when tracked.
      for (const LookedFootage& footage : input_.footage)
        if (footage.seen.times_s.size() > 1)
          number_by_rate(footage.seen.times_s, *input_.frame_rate_hz, footage.images.string(),
                         "--frame-rate");
      line("time: {{frame_rate: {}}}", number_text(*input_.frame_rate_hz));
    } else if (states_times) {
      line(
          "# time: left out, the videos state it. A video that plays slower than it was filmed "
          "needs its true rate: time: {{frame_rate: ...}} and times.csv");
      assumed_.push_back(
          "times: those in the videos, which are true unless a video plays slower "
          "than it was filmed");
    } else {
      throw InputError(input_.footage.front().images.string(),
                       "pictures do not say how many were taken in a second",
                       "the frame rate of the camera", "give --frame-rate");
    }
  }

  void cameras() {
    if (input_.footage.size() > 1)
      assumed_.push_back(
          "cameras: their pictures of one number, or time, were taken at one moment, which no "
          "picture tells");
    line("cameras:");
    std::set<std::string> names;
    for (const LookedFootage& footage : input_.footage) {
      std::string name = footage.images.stem().string();
      while (!names.insert(name).second) name += "_";
      line("  - name: {}", yaml_text(name));
      line("    images: {}", yaml_text(relative(footage.images)));
      board(name);
    }
  }

  void board(const std::string& camera) {
    // One set of stills shows the lens of one camera.
    const SeenBoard* board = boards_given_++ == 0 ? usual_board() : nullptr;
    if (board == nullptr) {
      line("    # NEEDED: file: cameras/{}.yaml, or stills of a chessboard:", camera);
      line(
          "    # calibration: {{images: STILLS, board: {{kind: chessboard, columns: 9, rows: 6, "
          "square: 0.02}}}}");
      needed_.push_back(
          fmt::format("the lens of camera '{}': film or photograph a chessboard with "
                      "it (clothfit sheet board)",
                      camera));
      return;
    }
    const double square_m = input_.square_m.value_or(0.02);
    line("    calibration:");
    line("      images: {}", yaml_text(relative(*input_.board)));
    line("      board: {{kind: chessboard, columns: {}, rows: {}, square: {}}}  # m",
         board->columns, board->rows, number_text(square_m));
    assumed_.push_back(fmt::format("the board: {} x {} inner corners, seen in the stills",
                                   board->columns, board->rows));
    if (!input_.square_m)
      needed_.push_back("the side of the board's fields: measure it; 0.02 m stands there");
  }

  /// Returns the board that most stills show; nothing where none shows any.
  const SeenBoard* usual_board() const {
    if (!input_.board_seen) return nullptr;
    std::map<std::pair<int, int>, int> count;
    for (const SeenPicture& still : input_.board_seen->pictures)
      if (still.board) ++count[{still.board->columns, still.board->rows}];
    const SeenBoard* best = nullptr;
    int most = 0;
    for (const SeenPicture& still : input_.board_seen->pictures) {
      if (!still.board) continue;
      const int n = count.at({still.board->columns, still.board->rows});
      if (n > most) best = &*still.board;
      most = std::max(most, n);
    }
    return best;
  }

  void reference() {
    std::set<int> others;
    for (const LookedFootage& footage : input_.footage)
      others.merge(match_sheet(footage.seen, input_.sheet.markers).others);
    line(
        "# NEEDED: reference: reference.csv, fixed points that say where the vertical is "
        "(point,x,y,z,tag,corner)");
    needed_.push_back(
        others.empty()
            ? "fixed reference points: without them nothing says where the vertical is"
            : fmt::format("where the tags {} stand: they are not on the cloth. Measure their "
                          "corners, and write them to reference.csv",
                          list_numbers({others.begin(), others.end()})));
  }

  void held() {
    std::vector<std::string> entries, words;
    if (moving_.moves()) {
      for (const ClothSide& side : kSides)
        if (moving_.rests_along(side)) {
          entries.push_back(fmt::format("{{edge: {}, motion: fixed}}", side.name));
          words.push_back(fmt::format("the {} edge", side.name));
        }
      const bool edges = !entries.empty();
      for (const ClothCorner& corner : kCorners)
        if (!edges && moving_.rests_at(corner.s, corner.t)) {
          entries.push_back(fmt::format("{{at: [{}, {}], motion: fixed}}",
                                        number_text(corner.s * input_.sheet.cloth.width_m),
                                        number_text(corner.t * input_.sheet.cloth.height_m)));
          words.push_back(fmt::format("the {} corner", corner.name));
        }
    }
    if (entries.empty()) {
      line("held: []  # NEEDED: {{at: [s, t], motion: fixed}}, or {{edge: top, motion: fixed}}");
      needed_.push_back("which points are held: none was seen to rest while the cloth moves");
      return;
    }
    line("held:  # s to the right and t down from the top left of the print; correct the places");
    for (const std::string& entry : entries) line("  - {}", entry);
    assumed_.push_back(fmt::format("held: {}, where the {} hardly move while most move {:.0f} px",
                                   fmt::join(words, " and "), word(), moving_.motion().typical_px));
  }

  void start() {
    constexpr double kInMotion = 0.6;  // 1/3 is a release, 1 is motion
    constexpr double kFlat = 0.01;     // of the sheet's size; a strong lens bends by as much
    const SeenMotion& motion = moving_.motion();
    if (moving_.moves() && !motion.first_step) {
      line("start: unknown  # NEEDED: released_flat, at_rest or unknown (in motion)");
      needed_.push_back(
          "how the motion starts: the first three frames were not all seen. released_flat is a "
          "flat "
          "sheet let go in frame 0");
      return;
    }
    const bool rests = !moving_.moves() || *motion.first_step < kInMotion;
    const bool flat = motion.not_flat.value_or(1) < kFlat;
    const char* start = !rests ? "unknown" : flat && moving_.moves() ? "released_flat" : "at_rest";
    line("start: {}  # released_flat, at_rest or unknown (in motion)", start);
    assumed_.push_back(fmt::format("start: {}, since the cloth {} in the first frame and is {}",
                                   start, rests ? "rests" : "moves already",
                                   flat ? "flat there" : "not flat there"));
  }

  void held_out() {
    const std::vector<SeenPicture>& pictures = input_.footage.front().seen.pictures;
    const int frames = pictures.empty() ? 0 : pictures.back().frame + 1;
    constexpr double kFitted = 0.7;
    const int from = static_cast<int>(std::lround(kFitted * frames));
    if (from < 1 || from >= frames) return;
    line("held_out: {{from_frame: {}}}  # frames for judging only", from);
    assumed_.push_back(fmt::format("frames from {} on are held out, to judge by", from));
  }

  const DraftInput& input_;
  fs::path folder_;
  MovingSheet moving_;
  int boards_given_ = 0;
  std::string yaml_;
  std::vector<std::string> assumed_, needed_;
};

}  // namespace

void refuse_without_sheet(const LookedFootage& footage) {
  std::set<int> ids;
  std::string family;
  for (const SeenPicture& picture : footage.seen.pictures)
    for (const SeenTag& tag : picture.tags) {
      if (family.empty()) family = tag.family;
      if (tag.family == family && tag.reading.good()) ids.insert(tag.reading.tag.id);
    }
  const std::string images = footage.images.string();
  if (ids.empty())
    throw InputError("--sheet", "missing, and " + images + " shows no tag",
                     "the sheet on the cloth", "print one: clothfit sheet tags");
  throw InputError(
      "--sheet",
      fmt::format("missing; {} shows {} tags of {}: {}", images, ids.size(), family,
                  list_numbers({ids.begin(), ids.end()})),
      "the folder that says where on the cloth they are",
      fmt::format("give that of your print or, where a grid of them covers the cloth, make it: "
                  "clothfit sheet tags --size WIDTHxHEIGHT --grid COLUMNSxROWS --tag SIDE "
                  "--family {} --first-id {}",
                  family, *ids.begin()));
}

RecordingDraft draft_recording(const DraftInput& input, const std::string& name,
                               const fs::path& folder) {
  return Draft(input, name, folder).write();
}

}  // namespace clothfit
