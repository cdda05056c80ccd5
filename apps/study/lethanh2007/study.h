#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "data/progress.h"
#include "data/sewing_pattern.h"
#include "fit/jobs/journal.h"
#include "model/garment/drape_garment.h"

namespace clothfit {

/// The founding paper's experiment [lethanh2007]: garments come to rest over meshes of several
/// resolutions, and on the finest at once.
struct Lethanh2007Options {
  std::vector<std::filesystem::path> patterns;  ///< of the garments; read_pattern() reads them
  std::vector<double> spacings_m{0.04, 0.028, 0.02, 0.014, 0.01};  ///< falling
  PaperSprings springs;
  int most_iterations = 3000;  ///< on each mesh, and at each pull of the threads
  double tolerance = 1e-3;     ///< residual force at rest, as a share of the weight

  void validate() const;    ///< throws InputError
  std::string key() const;  ///< of its journal
};

/// One way in which a garment came to rest.
struct GarmentRun {
  std::string garment;
  GarmentOptions::Method method = GarmentOptions::Method::newton;
  bool single = false;  ///< from the mesh of the seams to the finest at once
  double spacing_m = 0;
  int particles = 0;
  double seconds = 0;                   ///< from the sewn garment to the end
  int iterations = 0, evaluations = 0;  ///< on the finest mesh
  double energy_j = 0, imbalance = 0, spring_error_m = 0;
  int crossings = 0, inside = 0;
  bool at_rest = false;
  /// Seconds until the residual force stays below a twentieth of the weight; NaN: never.
  double reached_s = std::numeric_limits<double>::quiet_NaN();
  std::vector<GarmentStep> steps;  ///< of all meshes, seconds from the sewn garment on
};

/// How long it takes to find the correspondences of K particles with the triangles of a mesh twice
/// as coarse [lethanh2007, section 4].
struct CorrespondenceTime {
  int particles = 0, triangles = 0;
  double by_boxes_s = 0;
  double by_all_s = -1;  ///< of the naive search; < 0: not measured
};

struct Lethanh2007Study {
  std::vector<GarmentRun> runs;
  std::vector<CorrespondenceTime> correspondences;
  bool cancelled = false;
};

/// A claim of the paper, what was measured of it, and what follows.
struct PaperClaim {
  std::string claim, measured, verdict;
};

/// Runs the experiment, one run after the other. `journal` may be null.
Lethanh2007Study study_lethanh2007(const Lethanh2007Options& options, Journal* journal,
                                   const ProgressCallback& progress);

/// Returns the claims of the paper with what a study says of them.
std::vector<PaperClaim> paper_claims(const Lethanh2007Study& study);

/// Returns p of time ~ n^p, the slope of least squares over logarithms; NaN for fewer than three
/// points.
double growth_exponent(const std::vector<double>& count, const std::vector<double>& seconds);

/// Says whether time ~ exp(c n) fits better than time ~ n^p, by least squares over log time.
bool grows_exponentially(const std::vector<double>& count, const std::vector<double>& seconds);

const char* describe(GarmentOptions::Method method);

}  // namespace clothfit
