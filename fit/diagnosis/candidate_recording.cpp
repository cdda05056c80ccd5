#include "fit/diagnosis/candidate_recording.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "calib/camera/projection.h"
#include "data/algebra/dense_factors.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/predictor.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

constexpr double kDegrees = std::numbers::pi / 180;

std::vector<Eigen::Vector3d> held_places(const FitProblem& problem) {
  std::vector<Eigen::Vector3d> places;
  for (const HeldVertexWeights& held : problem.cloth.held) {
    places.emplace_back(Eigen::Vector3d::Zero());
    for (const HeldVertexWeights::Weight& at : held.weights)
      places.back() += at.weight * problem.placed_sheet_m.col(at.vertex);
  }
  return places;
}

/// Directions of the placed sheet, as it lies.
struct SheetAxes {
  Eigen::Vector3d along_s, normal, down;
};

SheetAxes axes_of(const FitProblem& problem) {
  const Mesh& mesh = problem.cloth.mesh;
  const auto corner = [&](int i, int j) {
    return Eigen::Vector3d(problem.placed_sheet_m.col(mesh.vertex(i, j)));
  };
  SheetAxes axes;
  axes.along_s = (corner(0, mesh.columns - 1) - corner(0, 0)).normalized();
  axes.normal = axes.along_s.cross(corner(mesh.rows - 1, 0) - corner(0, 0)).normalized();
  axes.down = problem.gravity_m_per_s2.stableNormalized();
  return axes;
}

/// The line through the held points. Through a single one it is level and in the sheet.
struct HeldLine {
  Eigen::Vector3d point_m, along;
  bool single = false;
};

/// Finds the line through the held points, or nothing where they lie on none.
std::optional<HeldLine> held_line(const FitProblem& problem) {
  constexpr double kStraight = 1e-3;  // of the cloth's size
  const std::vector<Eigen::Vector3d> places = held_places(problem);
  if (places.empty()) return std::nullopt;
  const SheetAxes axes = axes_of(problem);
  HeldLine line{.point_m = Eigen::Vector3d::Zero(), .along = axes.along_s};
  for (const Eigen::Vector3d& place : places)
    line.point_m += place / static_cast<double>(places.size());
  Eigen::Matrix3Xd around(3, static_cast<Eigen::Index>(places.size()));
  for (size_t n = 0; n < places.size(); ++n)
    around.col(static_cast<Eigen::Index>(n)) = places[n] - line.point_m;
  const SingularVectors svd = left_singular_vectors(around);
  const double small_m =
      kStraight * std::min(problem.cloth.mesh.width_m, problem.cloth.mesh.height_m);
  if (svd.values.size() > 1 && svd.values[1] > small_m) return std::nullopt;
  line.single = svd.values[0] < small_m;
  if (!line.single)
    line.along = svd.vectors.col(0);
  else if (const Eigen::Vector3d level = axes.normal.cross(axes.down); level.norm() > 0.1)
    line.along = level.normalized();
  // The decomposition leaves the sign open.
  if (line.along.dot(axes.along_s) < 0) line.along = -line.along;
  return line;
}

/// A new frame: its time, and the known frame whose rows it repeats.
struct Frame {
  double time_s = 0;
  int like = 0;
};

void set_frames(FitProblem& problem, const std::vector<Frame>& frames) {
  problem.frame_time_s.clear();
  for (const Frame& frame : frames) problem.frame_time_s.push_back(frame.time_s);
  problem.first_held_out = problem.frames();
  for (ObservationSet& set : problem.observations) {
    const std::vector<Observation> known = std::exchange(set.rows, {});
    for (size_t f = 0; f < frames.size(); ++f) {
      const auto same = std::ranges::equal_range(known, frames[f].like, {}, &Observation::frame);
      for (Observation row : same) {
        row.frame = static_cast<int>(f);
        set.rows.push_back(std::move(row));
      }
    }
  }
}

double median_interval_s(const FitProblem& problem) {
  std::vector<double> intervals;
  for (int f = 1; f < problem.first_held_out; ++f) {
    const auto at = static_cast<size_t>(f);
    intervals.push_back(problem.frame_time_s[at] - problem.frame_time_s[at - 1]);
  }
  const auto middle = intervals.begin() + std::ssize(intervals) / 2;
  std::ranges::nth_element(intervals, middle);
  return *middle;
}

double duration_s(const FitProblem& problem) {
  return problem.frame_time_s[static_cast<size_t>(problem.first_held_out - 1)] -
         problem.frame_time_s.front();
}

void make_twice_as_long(FitProblem& problem) {
  const int once = problem.first_held_out;
  const double later_s = duration_s(problem) + median_interval_s(problem);
  const double end_s = problem.frame_time_s[static_cast<size_t>(once - 1)];
  std::vector<Frame> frames;
  for (int f = 0; f < 2 * once; ++f)
    frames.push_back(
        {.time_s = problem.frame_time_s[static_cast<size_t>(f % once)] + (f < once ? 0 : later_s),
         .like = f % once});
  set_frames(problem, frames);
  for (HeldVertexWeights& held : problem.cloth.held) {
    if (!held.motion) continue;
    // A path ends where its file does. Turned about its end it goes on with the same velocity.
    held.motion = [known = held.motion, end_s](double time_s) -> Eigen::Vector3d {
      if (time_s <= end_s) return known(time_s);
      return 2 * known(end_s) - known(2 * end_s - time_s);
    };
  }
}

void double_frame_rate(FitProblem& problem) {
  std::vector<Frame> frames;
  for (int f = 0; f < problem.first_held_out; ++f) {
    const double time_s = problem.frame_time_s[static_cast<size_t>(f)];
    if (f > 0) frames.push_back({.time_s = 0.5 * (frames.back().time_s + time_s), .like = f - 1});
    frames.push_back({.time_s = time_s, .like = f});
  }
  set_frames(problem, frames);
}

void turn_about(FitProblem& problem, const HeldLine& line, double angle) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, line.along).toRotationMatrix();
  problem.placed_sheet_m =
      (turn * (problem.placed_sheet_m.colwise() - line.point_m)).colwise() + line.point_m;
}

/// Adds a motion of the supports with constants that nobody has to find.
void shake(FitProblem& problem, const Eigen::Vector3d& amplitude_m, double frequency_hz) {
  // A quarter of a turn on, the sine begins at rest.
  const std::map<std::string, double> numbers{{"amplitude_x", amplitude_m.x()},
                                              {"amplitude_y", amplitude_m.y()},
                                              {"amplitude_z", amplitude_m.z()},
                                              {"frequency", frequency_hz},
                                              {"phase", 0.25},
                                              {"point", 0}};
  add_effect(problem.cloth, "support_motion", "a candidate recording");
  std::vector<Binding> bindings;
  for (const EffectParameter& parameter : problem.cloth.effect_descriptions.back().parameters)
    bindings.push_back({.parameter = -1, .constant = numbers.at(parameter.name)});
  problem.effects.push_back(std::move(bindings));
}

/// Turns the cloth in its plane by as many quarters. Vertices come to lie where others lay, and
/// those that lie at the held points are held.
void turn_in_plane(FitProblem& problem, int quarters) {
  const Mesh& mesh = problem.cloth.mesh;
  const Eigen::Matrix3Xd places = problem.placed_sheet_m;
  std::vector<int> vertex_at(static_cast<size_t>(mesh.vertex_count()));
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const int place = quarters == 1 ? mesh.vertex(j, mesh.rows - 1 - i)
                                      : mesh.vertex(mesh.rows - 1 - i, mesh.columns - 1 - j);
      problem.placed_sheet_m.col(mesh.vertex(i, j)) = places.col(place);
      vertex_at[static_cast<size_t>(place)] = mesh.vertex(i, j);
    }
  }
  for (HeldVertexWeights& held : problem.cloth.held)
    for (HeldVertexWeights::Weight& at : held.weights)
      at.vertex = vertex_at[static_cast<size_t>(at.vertex)];
}

/// Adds a camera as far from the sheet as the first one, with its lens.
void add_camera(FitProblem& problem) {
  ObservationSet beside = problem.observations.front();
  CameraParameters& camera = *beside.camera;
  const Eigen::Vector3d middle_m = problem.placed_sheet_m.rowwise().mean();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(std::numbers::pi / 4, problem.gravity_m_per_s2.stableNormalized()));
  const Rigid3 pose = camera_from_world(camera) * Rigid3{turn, middle_m - turn * middle_m};
  camera.name = beside.kind = camera.name + " moved";
  camera.camera_from_world =
      CameraPose{.rotation = pose.rotation, .translation_m = pose.translation_m, .covariance = {}};
  problem.observations.push_back(std::move(beside));
}

bool may_touch(const FitProblem& problem) {
  return problem.cloth.obstacle ||
         std::ranges::any_of(problem.cloth.effect_descriptions,
                             [](const EffectDescription& of) { return of.touches; });
}

void add_attitudes(const FitProblem& problem, const HeldLine& line,
                   std::vector<CandidateRecording>& candidates) {
  constexpr double kTurns[] = {-40, -20, 20, 40};
  constexpr double kFurthest = 120;  // beyond it the sheet stands on its supports
  constexpr double kLevel = 0.3;
  const Eigen::Vector3d down = axes_of(problem).down;
  const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean() - line.point_m;
  const Eigen::Vector3d along = line.along;
  const Eigen::Vector3d hanging = middle - middle.dot(along) * along;
  const double now = std::atan2(down.cross(hanging).dot(along), down.dot(hanging)) / kDegrees;
  for (const double turn : kTurns) {
    const double then = now + turn;
    if (std::abs(then) > kFurthest) continue;
    const std::string what =
        std::abs(along.dot(down)) > kLevel
            ? fmt::format("let go turned by {:.0f} degrees about its held points", turn)
            : fmt::format("let go {:.0f} degrees out of the vertical{}, not {:.0f}", std::abs(then),
                          then * now < 0 ? " on the other side" : "", std::abs(now));
    candidates.push_back({.kind = CandidateKind::attitude,
                          .what = what,
                          .change = [line, turn](FitProblem& changed) {
                            turn_about(changed, line, turn * kDegrees);
                          }});
  }
}

void add_shaken(const FitProblem& problem, const std::optional<HeldLine>& line,
                std::vector<CandidateRecording>& candidates) {
  constexpr double kOfSide = 0.05, kFrequencies_hz[] = {1.5, 3};
  const SheetAxes axes = axes_of(problem);
  const double amplitude_m =
      kOfSide * std::min(problem.cloth.mesh.width_m, problem.cloth.mesh.height_m);
  std::vector<std::pair<Eigen::Vector3d, std::string>> ways;
  if (!line) {
    ways = {{axes.down, "up and down"}, {axes.along_s, "along the cloth's width"}};
  } else {
    const Eigen::Vector3d across = line->along.cross(axes.down);
    ways.emplace_back(across.norm() > 0.1 ? Eigen::Vector3d(across.normalized()) : axes.normal,
                      line->single ? "to and fro" : "across the line through them");
    if (!line->single) ways.emplace_back(line->along, "along the line through them");
  }
  for (const auto& [direction, text] : ways)
    for (const double frequency_hz : kFrequencies_hz)
      candidates.push_back(
          {.kind = CandidateKind::shaken,
           .what = fmt::format("held points shaken {}, {:.0f} mm at {:g} Hz", text,
                               1e3 * amplitude_m, frequency_hz),
           .change = [way = Eigen::Vector3d(amplitude_m * direction),
                      frequency_hz](FitProblem& changed) { shake(changed, way, frequency_hz); }});
}

void add_turned(const FitProblem& problem, std::vector<CandidateRecording>& candidates) {
  const Mesh& mesh = problem.cloth.mesh;
  const auto add = [&](const char* what, int quarters) {
    candidates.push_back(
        {.kind = CandidateKind::turned, .what = what, .change = [quarters](FitProblem& changed) {
           turn_in_plane(changed, quarters);
         }});
  };
  add("the cloth held upside down", 2);
  if (mesh.columns == mesh.rows && mesh.width_m == mesh.height_m)
    add("the cloth held turned by a quarter in its plane", 1);
}

bool is_in_picture(const CameraParameters& camera, const Eigen::Vector3d& pixel) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= camera.image_width - 0.5 &&
         pixel.y() <= camera.image_height - 0.5;
}

}  // namespace

std::vector<CandidateRecording> candidate_recordings(const FitProblem& problem) {
  std::vector<CandidateRecording> candidates;
  candidates.push_back({.kind = CandidateKind::duration,
                        .what = fmt::format("twice as long ({:.2g} s)", 2 * duration_s(problem)),
                        .change = make_twice_as_long});
  candidates.push_back(
      {.kind = CandidateKind::frame_rate,
       .what = fmt::format("twice the frame rate ({:.0f} Hz)", 2 / median_interval_s(problem)),
       .change = double_frame_rate});
  const std::optional<HeldLine> line = held_line(problem);
  if (problem.start == StartKind::released_flat && line && !may_touch(problem))
    add_attitudes(problem, *line, candidates);
  if (!problem.cloth.held.empty()) {
    // The effect shifts nothing at time 0, whenever the first frame is.
    if (problem.frame_time_s.front() == 0) add_shaken(problem, line, candidates);
    if (problem.start != StartKind::unknown && problem.driving_markers.empty())
      add_turned(problem, candidates);
  }
  if (problem.observations.front().camera)
    candidates.push_back({.kind = CandidateKind::camera,
                          .what = "one more camera, 45 degrees to the side",
                          .change = add_camera});
  return candidates;
}

bool observe(FitProblem& problem, const Eigen::VectorXd& values, const TimeSteps& steps) {
  // With a rolling shutter a marker's row says when it is seen, and that time says where.
  constexpr int kPasses = 3;
  size_t all = 0, seen = 0;
  for (ObservationSet& set : problem.observations) {
    std::erase_if(set.rows,
                  [&](const Observation& row) { return row.frame >= problem.first_held_out; });
    all += set.rows.size();
  }
  const Predictor predictor(problem, values);
  const SimulateResult run =
      run_model(problem, {values}, predictor.frames_to_run(problem.first_held_out), steps,
                predictor.needs_velocities())
          .front();
  if (!run.usable()) return false;
  const MarkerRun markers = marker_run(problem, run);
  for (size_t s = 0; s < problem.observations.size(); ++s) {
    ObservationSet& set = problem.observations[s];
    std::erase_if(set.rows, [&](Observation& row) {
      for (int pass = 0; pass < kPasses; ++pass) {
        const auto predicted = predictor.predict(static_cast<int>(s), row, markers);
        if (!predicted || (set.camera && !is_in_picture(*set.camera, *predicted))) return true;
        row.observed = *predicted;
      }
      return false;
    });
    seen += set.rows.size();
  }
  return 2 * seen > all;
}

}  // namespace clothfit
