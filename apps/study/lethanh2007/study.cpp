#include "apps/study/lethanh2007/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "data/input_error.h"
#include "data/pattern_file.h"
#include "fit/jobs/journal_key.h"
#include "model/garment/mannequin.h"
#include "model/topology/correspondence.h"

namespace clothfit {
namespace {

using Json = nlohmann::json;
using Method = GarmentOptions::Method;

/// A run to do. The paper's method at all spacings shows how its time grows; the others are
/// compared where they still end.
struct Task {
  size_t pattern = 0;
  Method method = Method::newton;
  bool single = false;
  double spacing_m = 0;
};

std::vector<Task> tasks_of(const Lethanh2007Options& options) {
  std::vector<Task> tasks;
  for (size_t p = 0; p < options.patterns.size(); ++p)
    for (const double spacing_m : options.spacings_m) {
      const bool has_levels = 2 * spacing_m <= options.spacings_m.front() * (1 + 1e-9);
      for (const Method method :
           {Method::conjugate_gradients, Method::newton, Method::time_steps}) {
        tasks.push_back({p, method, true, spacing_m});
        if (has_levels && method != Method::time_steps)
          tasks.push_back({p, method, false, spacing_m});
      }
    }
  return tasks;
}

Json json_of(const GarmentRun& run) {
  Json steps = Json::array();
  for (const GarmentStep& step : run.steps)
    steps.push_back({step.seconds, step.energy_j, step.imbalance, step.spring_error_m});
  return {{"garment", run.garment},
          {"method", static_cast<int>(run.method)},
          {"single", run.single},
          {"spacing_m", run.spacing_m},
          {"particles", run.particles},
          {"seconds", run.seconds},
          {"iterations", run.iterations},
          {"evaluations", run.evaluations},
          {"energy_j", run.energy_j},
          {"imbalance", run.imbalance},
          {"spring_error_m", run.spring_error_m},
          {"crossings", run.crossings},
          {"inside", run.inside},
          {"at_rest", run.at_rest},
          {"reached_s", run.reached_s},
          {"steps", steps}};
}

GarmentRun run_of(const std::string& payload) {
  const Json json = Json::parse(payload);
  GarmentRun run;
  run.garment = json.at("garment");
  run.method = static_cast<Method>(json.at("method").get<int>());
  run.single = json.at("single");
  run.spacing_m = json.at("spacing_m");
  run.particles = json.at("particles");
  run.seconds = json.at("seconds");
  run.iterations = json.at("iterations");
  run.evaluations = json.at("evaluations");
  run.energy_j = json.at("energy_j");
  run.imbalance = json.at("imbalance");
  run.spring_error_m = json.at("spring_error_m");
  run.crossings = json.at("crossings");
  run.inside = json.at("inside");
  run.at_rest = json.at("at_rest");
  if (!json.at("reached_s").is_null()) run.reached_s = json.at("reached_s");
  for (const Json& step : json.at("steps"))
    run.steps.push_back({step[0], step[1], step[2], step[3]});
  return run;
}

constexpr double kCompared = 0.05;  ///< residual force over weight at which times are compared

/// Returns seconds until the residual force stays below a share of the weight; NaN if it does not.
double seconds_to(const GarmentRun& run, double share) {
  double since_s = std::numeric_limits<double>::quiet_NaN();
  for (const GarmentStep& step : run.steps) {
    if (step.imbalance >= share)
      since_s = std::numeric_limits<double>::quiet_NaN();
    else if (std::isnan(since_s))
      since_s = step.seconds;
  }
  return since_s;
}

/// Drapes a garment. Says by its name that it was cancelled: an empty one.
GarmentRun drape(const Pattern& pattern, const Task& task, const Lethanh2007Options& options,
                 const Obstacle& body, const std::function<bool(const GarmentProgress&)>& go_on) {
  GarmentOptions garment;
  garment.springs = options.springs;
  garment.method = task.method;
  garment.single = task.single;
  garment.spacing_m = task.spacing_m;
  garment.coarsest_m = options.spacings_m.front();
  garment.tolerance = options.tolerance;
  garment.most_iterations = options.most_iterations;
  garment.go_on = go_on;
  const GarmentDrape drape = drape_garment(pattern, {}, &body, garment);
  if (drape.state == GarmentState::cancelled) return {};
  if (drape.levels.empty() || drape.levels.front().steps.empty())
    throw InputError(pattern.file, "the pattern cannot be sewn around the mannequin",
                     "a garment in the mannequin's size", "clothfit drape says more");
  const GarmentLevel& finest = drape.levels.back();
  GarmentRun run{.garment = pattern.name,
                 .method = task.method,
                 .single = task.single,
                 .spacing_m = task.spacing_m,
                 .particles = finest.particles,
                 .iterations = finest.work.iterations,
                 .evaluations = finest.work.evaluations,
                 .energy_j = finest.work.energy_j,
                 .imbalance = drape.imbalance,
                 .spring_error_m = finest.steps.back().spring_error_m,
                 .crossings = drape.crossings,
                 .inside = drape.inside,
                 .at_rest = drape.state == GarmentState::at_rest,
                 .steps = {}};
  const double begin_s = drape.levels.front().steps.front().seconds;
  for (const GarmentLevel& level : drape.levels)
    for (GarmentStep step : level.steps) {
      step.seconds -= begin_s;
      run.steps.push_back(step);
    }
  run.seconds = run.steps.back().seconds;
  // A page needs no more of a curve than it can show.
  constexpr size_t kMostSteps = 400;
  const size_t stride = run.steps.size() / kMostSteps + 1;
  std::vector<GarmentStep> shown;
  for (size_t n = 0; n < run.steps.size(); n += stride) shown.push_back(run.steps[n]);
  if ((run.steps.size() - 1) % stride != 0) shown.push_back(run.steps.back());
  run.reached_s = seconds_to(run, kCompared);
  run.steps = shown;
  return run;
}

/// A square lattice of one metre with n x n squares, each cut in two.
struct Lattice {
  Eigen::Matrix2Xd point_m;
  Eigen::Matrix3Xi triangle;

  explicit Lattice(int n) : point_m(2, (n + 1) * (n + 1)), triangle(3, 2 * n * n) {
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const int v = i * (n + 1) + j;
        point_m.col(v) << j / double(n), i / double(n);
        if (i == n || j == n) continue;
        triangle.col(2 * (i * n + j)) << v, v + 1, v + n + 1;
        triangle.col(2 * (i * n + j) + 1) << v + 1, v + n + 2, v + n + 1;
      }
  }
};

template <class Work>
double seconds_of(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::vector<CorrespondenceTime> time_correspondences() {
  constexpr int kMostByAll = 10'000;
  std::vector<CorrespondenceTime> times;
  for (const int n : {32, 64, 96, 172, 244, 346}) {
    const Lattice fine(n), coarse(n / 2);
    CorrespondenceTime time{static_cast<int>(fine.point_m.cols()),
                            static_cast<int>(coarse.triangle.cols())};
    Correspondence found, reference;
    time.by_boxes_s =
        seconds_of([&] { found = correspond(fine.point_m, coarse.point_m, coarse.triangle); });
    if (time.particles <= kMostByAll)
      time.by_all_s = seconds_of(
          [&] { reference = correspond_by_all(fine.point_m, coarse.point_m, coarse.triangle); });
    times.push_back(time);
  }
  return times;
}

const GarmentRun* find_run(const Lethanh2007Study& study, const std::string& garment, Method method,
                           bool single, double spacing_m) {
  for (const GarmentRun& run : study.runs)
    if (run.garment == garment && run.method == method && run.single == single &&
        run.spacing_m == spacing_m)
      return &run;
  return nullptr;
}

/// The times of a garment's runs on the finest mesh at once, against the number of particles.
struct Growth {
  std::vector<double> count, seconds;

  void add(const GarmentRun& run, double of_seconds) {
    if (!(of_seconds > 0)) return;
    count.push_back(run.particles);
    seconds.push_back(of_seconds);
  }
};

std::vector<std::string> garments_of(const Lethanh2007Study& study) {
  std::vector<std::string> names;
  for (const GarmentRun& run : study.runs)
    if (std::ranges::find(names, run.garment) == names.end()) names.push_back(run.garment);
  return names;
}

PaperClaim growth_claim(const Lethanh2007Study& study) {
  std::string measured;
  int fitted = 0, powers = 0;
  for (const std::string& garment : garments_of(study))
    for (const Method method : {Method::conjugate_gradients, Method::newton}) {
      Growth growth;
      for (const GarmentRun& run : study.runs)
        if (run.garment == garment && run.method == method && run.single)
          growth.add(run, run.reached_s);
      const double exponent = growth_exponent(growth.count, growth.seconds);
      if (std::isnan(exponent)) continue;
      ++fitted;
      const bool is_power = !grows_exponentially(growth.count, growth.seconds);
      powers += is_power;
      measured +=
          fmt::format("{}{} by {}: n^{:.2f}, {} fits better", measured.empty() ? "" : "; ", garment,
                      describe(method), exponent, is_power ? "a power" : "an exponential");
    }
  return {"“The computing times grows exponentially” with the resolution (section 2)",
          fitted ? fmt::format("time to {:g} of the weight: {}", kCompared, measured)
                 : "too few runs came so far",
          fitted == 0        ? "open"
          : powers == fitted ? "refuted: powers of the number of particles"
          : powers == 0      ? "confirmed"
                             : "open: some one way, some the other"};
}

PaperClaim iteration_claim(const Lethanh2007Study& study) {
  Growth growth;
  for (const GarmentRun& run : study.runs)
    if (run.method == Method::conjugate_gradients && run.single && run.evaluations > 0)
      growth.add(run, run.seconds / run.evaluations);
  const double exponent = growth_exponent(growth.count, growth.seconds);
  constexpr double kLess = 0.8, kMore = 1.2;
  return {"One iteration takes a time proportional to the number of particles (equations 9 to 11)",
          std::isnan(exponent)
              ? "too few runs"
              : fmt::format("time per evaluation ~ n^{:.2f}, collisions included", exponent),
          std::isnan(exponent) ? "open"
          : exponent < kLess   ? "it grows less than that"
          : exponent < kMore   ? "confirmed"
                               : "refuted"};
}

PaperClaim hierarchy_claim(const Lethanh2007Study& study) {
  // “Much less” begins at this ratio.
  constexpr double kMuch = 1.5;
  std::string measured;
  int faster = 0, compared = 0;
  for (const GarmentRun& levels : study.runs) {
    if (levels.single || levels.method != Method::conjugate_gradients) continue;
    const GarmentRun* at_once =
        find_run(study, levels.garment, levels.method, true, levels.spacing_m);
    if (!at_once) continue;
    const auto text = [](const GarmentRun& run) {
      return std::isnan(run.reached_s) ? fmt::format("not in {:.0f} s", run.seconds)
                                       : fmt::format("{:.1f} s", run.reached_s);
    };
    measured += fmt::format("{}{} at {:g} mm: {}, at once {}", measured.empty() ? "" : "; ",
                            levels.garment, 1e3 * levels.spacing_m, text(levels), text(*at_once));
    if (std::isnan(levels.reached_s) && std::isnan(at_once->reached_s)) continue;
    ++compared;
    // A run that did not come so far took longer than it ran.
    const double at_once_s = std::isnan(at_once->reached_s) ? at_once->seconds : at_once->reached_s;
    faster += at_once_s >= kMuch * levels.reached_s;
  }
  return {"The hierarchy reaches the finest resolution's minimum in much less time (section 4)",
          compared ? fmt::format("to {:g} of the weight: {}", kCompared, measured)
                   : "no run over several meshes came so far",
          compared == 0        ? "open"
          : faster == compared ? "confirmed"
          : faster == 0        ? "refuted"
                               : fmt::format("in {} of {}", faster, compared)};
}

PaperClaim correspondence_claim(const Lethanh2007Study& study) {
  std::vector<double> count, boxes, naive_count, naive;
  for (const CorrespondenceTime& time : study.correspondences) {
    count.push_back(time.particles);
    boxes.push_back(std::max(time.by_boxes_s, 1e-6));
    if (time.by_all_s < 0) continue;
    naive_count.push_back(time.particles);
    naive.push_back(time.by_all_s);
  }
  const double by_boxes = growth_exponent(count, boxes),
               by_all = growth_exponent(naive_count, naive);
  return {"Correspondences take O(K^2) by all triangles and O(K) by boxes (section 4)",
          fmt::format("K^{:.2f} by all, K^{:.2f} by boxes", by_all, by_boxes),
          by_all > 1.7 && by_boxes < 1.3 ? "confirmed" : "not confirmed"};
}

}  // namespace

const char* describe(GarmentOptions::Method method) {
  switch (method) {
    case Method::newton:
      return "Newton steps";
    case Method::conjugate_gradients:
      return "conjugate gradients";
    case Method::time_steps:
      break;
  }
  return "time steps";
}

namespace {

/// The straight line of least squares.
struct Line2 {
  double slope = 0, squares = 0;  ///< sum of squared residuals
};

Line2 line_through(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0, yy = 0;
  for (size_t k = 0; k < x.size(); ++k) mean_x += x[k] / n, mean_y += y[k] / n;
  for (size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - mean_x) * (x[k] - mean_x);
    xy += (x[k] - mean_x) * (y[k] - mean_y);
    yy += (y[k] - mean_y) * (y[k] - mean_y);
  }
  return {xy / xx, yy - xy * xy / xx};
}

std::vector<double> logarithms(std::vector<double> values) {
  for (double& value : values) value = std::log(value);
  return values;
}

}  // namespace

double growth_exponent(const std::vector<double>& count, const std::vector<double>& seconds) {
  if (count.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  return line_through(logarithms(count), logarithms(seconds)).slope;
}

bool grows_exponentially(const std::vector<double>& count, const std::vector<double>& seconds) {
  if (count.size() < 3) return false;
  const std::vector<double> log_seconds = logarithms(seconds);
  return line_through(count, log_seconds).squares <
         line_through(logarithms(count), log_seconds).squares;
}

void Lethanh2007Options::validate() const {
  if (patterns.empty()) throw InputError("patterns", "there is none", "one or more");
  if (spacings_m.empty() ||
      std::ranges::adjacent_find(spacings_m, std::less_equal<>()) != spacings_m.end())
    throw InputError("Lethanh2007Options::spacings_m", "they do not fall", "falling spacings");
  springs.validate();
  GarmentOptions garment;
  garment.tolerance = tolerance;
  garment.most_iterations = most_iterations;
  garment.validate();
}

std::string Lethanh2007Options::key() const {
  JournalKey key("lethanh2007/1");
  for (const std::filesystem::path& pattern : patterns) key.add("pattern", pattern.string());
  for (const double spacing_m : spacings_m) key.add("spacing_m", spacing_m);
  key.add("tension", springs.tension_n_per_m)
      .add("shear", springs.shear_n_per_m)
      .add("bending", springs.bending_n_per_m)
      .add("areal_density", springs.areal_density_kg_per_m2)
      .add("most_iterations", most_iterations)
      .add("tolerance", tolerance);
  return key.line();
}

Lethanh2007Study study_lethanh2007(const Lethanh2007Options& options, Journal* journal,
                                   const ProgressCallback& progress) {
  options.validate();
  std::vector<Pattern> patterns;
  for (const std::filesystem::path& file : options.patterns) patterns.push_back(read_pattern(file));
  const Obstacle body(make_mannequin());
  const std::vector<Task> tasks = tasks_of(options);
  Lethanh2007Study study;
  for (size_t n = 0; n < tasks.size(); ++n) {
    const auto index = static_cast<int>(n);
    if (journal && journal->finished().contains(index)) {
      study.runs.push_back(run_of(journal->finished().at(index)));
      continue;
    }
    const Pattern& pattern = patterns[tasks[n].pattern];
    const auto go_on = [&](const GarmentProgress& now) {
      return progress({.stage = fmt::format("{} at {:g} mm, {}", pattern.name,
                                            1e3 * tasks[n].spacing_m, describe(tasks[n].method)),
                       .done = static_cast<double>(n),
                       .total = static_cast<double>(tasks.size()),
                       .unit = "runs",
                       .note = fmt::format("{} {}, residual force {:.2g} of the weight",
                                           now.sewing ? "sewing, step" : "step", now.iteration,
                                           now.imbalance)});
    };
    GarmentRun run = drape(pattern, tasks[n], options, body, go_on);
    if (run.garment.empty()) {
      study.cancelled = true;
      return study;
    }
    if (journal) journal->append(index, json_of(run).dump());
    study.runs.push_back(std::move(run));
  }
  study.correspondences = time_correspondences();
  return study;
}

std::vector<PaperClaim> paper_claims(const Lethanh2007Study& study) {
  return {growth_claim(study), iteration_claim(study), hierarchy_claim(study),
          correspondence_claim(study)};
}

}  // namespace clothfit
