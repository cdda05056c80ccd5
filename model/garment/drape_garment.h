#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/garment/garment_mesh.h"
#include "model/garment/spring_cloth.h"
#include "model/rest/minimise.h"
#include "model/topology/obstacle.h"

namespace clothfit {

/// What a garment's draping does at the moment.
struct GarmentProgress {
  bool sewing = false;  ///< seams are drawn together; else the sewn garment comes to rest
  double spacing_m = 0;
  int particles = 0;
  int iteration = 0;
  double widest_gap_m = 0;  ///< of the seams, while they are open
  double imbalance = 0;     ///< residual force on all particles, as a share of the weight
};

struct GarmentOptions {
  double spacing_m = 0.02;    ///< of the finest mesh
  double coarsest_m = 0.04;   ///< seams are closed on the first mesh at least as fine; the next
                              ///< are each half as wide
  double hold_off_m = 0.003;  ///< distance from the body at which cloth begins to feel it
  /// Distance from itself below which cloth presses on itself; a tenth of the spacing on meshes
  /// where that is more. 0: not looked for.
  double self_distance_m = 0.002;
  /// In place of fabrics: the cloth of [lethanh2007].
  std::optional<PaperSprings> springs;
  /// How the sewn garment comes to rest; others than `newton` are for comparison.
  enum class Method { newton, conjugate_gradients, time_steps } method = Method::newton;
  bool keep_shapes = false;    ///< in the result's `shapes`: to show how it was sewn
  bool single = false;         ///< from the mesh of the seams to the finest at once, for comparison
  double tolerance = 1e-3;     ///< imbalance that counts as rest
  int most_iterations = 1000;  ///< on each mesh, and at each pull of the threads
  std::function<bool(const GarmentProgress&)> go_on;  ///< `false` cancels; may be empty

  void validate() const;  ///< throws InputError
};

/// A place on a garment's way to rest.
struct GarmentStep {
  double seconds = 0;  ///< since the draping began
  double energy_j = 0;
  double imbalance = 0;  ///< residual force on all particles, as a share of the weight
  /// Mean difference between the length of an edge of the mesh and that in the flat cloth: the
  /// average spring error of [lethanh2007].
  double spring_error_m = 0;
};

struct GarmentLevel {
  double spacing_m = 0;
  int particles = 0, triangles = 0;
  MinimiseResult work;
  std::vector<GarmentStep> steps;  ///< from its start on
};

/// A shape on the way from the panels that wait to the garment at rest.
struct GarmentShape {
  double seconds = 0;           ///< since the draping began
  Eigen::Matrix3Xd position_m;  ///< 3 x vertices of the finest mesh
};

enum class GarmentState {
  at_rest,
  not_at_rest,  ///< the finest mesh ran out of iterations, or no step lowers its energy
  too_tight,    ///< sewn, but with `stretched_share` of its cloth torn: more than kMostStretched
  not_sewn,     ///< a seam stays open: `widest_gap_m`, of `widest_seam`
  inside_body,  ///< `inside` places: too tight a garment, or a body that passed through it
  cancelled
};

/// Of a garment that is worn, no more than so much is stretched by half: fabrics tear before.
inline constexpr double kMostStretched = 0.05;

struct GarmentDrape {
  GarmentState state = GarmentState::not_at_rest;
  GarmentMesh mesh;                  ///< the finest reached
  Eigen::Matrix3Xd position_m;       ///< 3 x vertices; those of a seam in one place once sewn
  std::vector<GarmentLevel> levels;  ///< coarsest first
  std::vector<GarmentShape> shapes;  ///< if asked for, from where panels wait to position_m
  double widest_gap_m = 0;           ///< of the seams when they were closed
  int widest_seam = -1;
  double imbalance = 0;  ///< as a share of the weight
  double weight_n = 0;
  /// Share of the edges of its triangles that are longer than flat by half or more.
  double stretched_share = 0;
  int crossings = 0;     ///< edges of the cloth that pass through its triangles, by an exact test
  int inside = 0;        ///< places of the cloth beneath the body's surface
  double deepest_m = 0;  ///< of them
  bool usable() const { return state == GarmentState::at_rest; }
};

/// Sews a pattern around a body and lets it come to rest under its weight: a minimum of its energy
/// [lethanh2007]. On the coarsest mesh threads draw the seams together, without weight; then sides
/// become one, and the shape goes from mesh to mesh by its correspondences, coming to rest on each.
/// `body` may be null.
///
/// Throws InputError for an impossible pattern, fabric or option, for a body that is open or faces
/// inwards, and for a pattern that begins inside the body.
GarmentDrape drape_garment(const Pattern& pattern, const std::vector<MeasuredFabric>& fabrics,
                           const Obstacle* body, const GarmentOptions& options);

}  // namespace clothfit
