#include "model/rest/lattice_multigrid.h"

#include <algorithm>
#include <cassert>

#include "data/parallel.h"

namespace clothfit {
namespace {

/// Rows and columns up to this many are not made coarser.
constexpr int kCoarsest = 6;
/// Steps of the smoother before and after the coarse correction, and the damped share of the
/// spectrum: the eigenvalues from 2 / kSmoothedRange to 2.
constexpr int kSmoothing = 2;
constexpr double kSmoothedRange = 6;
constexpr int kRowsPerTask = 32;

/// The vertices of a row (or column) that a coarse one keeps.
struct CoarseAxis {
  std::vector<int> fine;  ///< index on the fine axis of every coarse vertex

  static CoarseAxis of(int count) {
    CoarseAxis axis;
    const int step = count > kCoarsest ? 2 : 1;
    for (int k = 0; k < count - 1; k += step) axis.fine.push_back(k);
    axis.fine.push_back(count - 1);
    return axis;
  }
  int count() const { return static_cast<int>(fine.size()); }
  int at(int coarse) const { return fine[static_cast<size_t>(coarse)]; }
  /// Returns the fine intervals in the one that begins at a coarse vertex: 1 or 2.
  int width(int coarse) const { return at(coarse + 1) - at(coarse); }
  /// Calls `use(fine, weight)` for the fine vertices that take their value from a coarse one.
  template <class Use>
  void for_weights(int coarse, const Use& use) const {
    if (coarse > 0 && width(coarse - 1) == 2) use(at(coarse) - 1, 0.5);
    use(at(coarse), 1.0);
    if (coarse + 1 < count() && width(coarse) == 2) use(at(coarse) + 1, 0.5);
  }
};

template <class Work>
void for_rows(int rows, const Work& work) {
  if (rows <= 2 * kRowsPerTask) {
    for (int i = 0; i < rows; ++i) work(i);
    return;
  }
  const int tasks = (rows + kRowsPerTask - 1) / kRowsPerTask;
  for_each_index(static_cast<size_t>(tasks), [&](size_t task) {
    const int n = static_cast<int>(task);
    const int end = std::min(rows, (n + 1) * kRowsPerTask);
    for (int i = n * kRowsPerTask; i < end; ++i) work(i);
  });
}

/// Computes out = sum of the fine plane's values by the transpose of the bilinear interpolation.
void restrict_plane(const FieldLayout& fine, const CoarseAxis& down, const CoarseAxis& across,
                    const double* from, const FieldLayout& coarse, double* to) {
  for_rows(coarse.rows, [&](int i) {
    // The padding of rows, and what lies before them in the row above, is zero.
    thread_local Eigen::ArrayXd row;
    row.setZero(fine.stride);
    down.for_weights(i, [&](int fine_row, double weight) {
      row += weight * Eigen::Map<const Eigen::ArrayXd>(from + fine.at(fine_row, 0), fine.stride);
    });
    double* const out = to + coarse.at(i, 0);
    for (int j = 0; j < coarse.columns; ++j) {
      double sum = 0;
      across.for_weights(j,
                         [&](int fine_column, double weight) { sum += weight * row[fine_column]; });
      out[j] = sum;
    }
  });
}

/// Computes to += the bilinear interpolation of the coarse plane.
void add_prolongated_plane(const FieldLayout& coarse, const CoarseAxis& down,
                           const CoarseAxis& across, const double* from, const FieldLayout& fine,
                           double* to) {
  for_rows(coarse.rows, [&](int i) {
    thread_local Eigen::ArrayXd row;
    const Eigen::Map<const Eigen::ArrayXd> here(from + coarse.at(i, 0), coarse.stride);
    const auto add_row = [&](int fine_row) {
      double* const out = to + fine.at(fine_row, 0);
      for (int j = 0; j < coarse.columns; ++j) {
        out[across.at(j)] += row[j];
        if (j + 1 < coarse.columns && across.width(j) == 2)
          out[across.at(j) + 1] += 0.5 * (row[j] + row[j + 1]);
      }
    };
    row = here;
    add_row(down.at(i));
    if (i + 1 < coarse.rows && down.width(i) == 2) {
      row = 0.5 *
            (here + Eigen::Map<const Eigen::ArrayXd>(from + coarse.at(i + 1, 0), coarse.stride));
      add_row(down.at(i) + 1);
    }
  });
}

struct Block {
  double xx, yy, zz, xy, xz, yz;
};

Block inverse(const Block& m) {
  const double cxx = m.yy * m.zz - m.yz * m.yz;
  const double cxy = m.xz * m.yz - m.xy * m.zz;
  const double cxz = m.xy * m.yz - m.xz * m.yy;
  const double determinant = m.xx * cxx + m.xy * cxy + m.xz * cxz;
  const double s = 1 / determinant;
  return {cxx * s, (m.xx * m.zz - m.xz * m.xz) * s, (m.xx * m.yy - m.xy * m.xy) * s, cxy * s,
          cxz * s, (m.xy * m.xz - m.xx * m.yz) * s};
}

/// Calls `use(row begin, row length)` for all of a plane, in parallel where it is large.
template <class Work>
void for_segments(const FieldLayout& layout, const Work& work) {
  if (layout.rows <= 2 * kRowsPerTask) {
    work(std::ptrdiff_t{0}, layout.plane());
    return;
  }
  const int tasks = (layout.rows + kRowsPerTask - 1) / kRowsPerTask;
  for_each_index(static_cast<size_t>(tasks), [&](size_t task) {
    const int n = static_cast<int>(task);
    const int begin = n * kRowsPerTask, end = std::min(layout.rows, begin + kRowsPerTask);
    work(layout.at(begin, 0), (end - begin) * layout.stride);
  });
}

}  // namespace

struct LatticeMultigrid::Level {
  FieldLayout layout;
  std::vector<int> fixed;
  CoarseAxis down, across;  ///< to the next level

  MatrixSprings springs;
  /// The finest level's springs in their shorter form: a third of the memory to walk through.
  const EnergyTangent* tangent = nullptr;
  MatrixPlanes ground;            ///< stiffness of each vertex against its place
  MatrixPlanes inverse_diagonal;  ///< zero where fixed
  MeshField right, solution, product, step;
  std::vector<std::vector<double>> scratch;

  explicit Level(const FieldLayout& where)
      : layout(where),
        down(CoarseAxis::of(where.rows)),
        across(CoarseAxis::of(where.columns)),
        right(where),
        solution(where),
        product(where),
        step(where) {
    springs.layout = where;
    for (auto& type : springs.stiffness_n_per_m)
      for (Eigen::ArrayXd& plane : type) plane.setZero(where.plane() + kLanes);
    for (Eigen::ArrayXd& plane : ground) plane.setZero(where.plane());
    for (Eigen::ArrayXd& plane : inverse_diagonal) plane.setZero(where.plane());
  }
  bool coarsest() const { return down.count() == layout.rows && across.count() == layout.columns; }

  void multiply_all(const MeshField& v) {
    if (tangent != nullptr)
      clothfit::multiply(*tangent, v, product, scratch);
    else
      clothfit::multiply(springs, v, product, scratch);
    for_segments(layout, [&](std::ptrdiff_t begin, std::ptrdiff_t count) {
      const auto part = [&](const Eigen::ArrayXd& plane) { return plane.data() + begin; };
      const double *xx = part(ground[0]), *yy = part(ground[1]), *zz = part(ground[2]),
                   *xy = part(ground[3]), *xz = part(ground[4]), *yz = part(ground[5]);
      const double *x = v.plane(0) + begin, *y = v.plane(1) + begin, *z = v.plane(2) + begin;
      double *px = product.plane(0) + begin, *py = product.plane(1) + begin,
             *pz = product.plane(2) + begin;
#pragma GCC ivdep
      for (std::ptrdiff_t k = 0; k < count; ++k) {
        px[k] += xx[k] * x[k] + xy[k] * y[k] + xz[k] * z[k];
        py[k] += xy[k] * x[k] + yy[k] * y[k] + yz[k] * z[k];
        pz[k] += xz[k] * x[k] + yz[k] * y[k] + zz[k] * z[k];
      }
    });
  }

  /// Computes step = keep * step + gain * D^-1 (right - product) and solution += step.
  void smooth_step(double keep, double gain) {
    for_segments(layout, [&](std::ptrdiff_t begin, std::ptrdiff_t count) {
      const auto part = [&](const Eigen::ArrayXd& plane) { return plane.data() + begin; };
      const double *xx = part(inverse_diagonal[0]), *yy = part(inverse_diagonal[1]),
                   *zz = part(inverse_diagonal[2]), *xy = part(inverse_diagonal[3]),
                   *xz = part(inverse_diagonal[4]), *yz = part(inverse_diagonal[5]);
      const double *rx = right.plane(0) + begin, *ry = right.plane(1) + begin,
                   *rz = right.plane(2) + begin;
      const double *px = product.plane(0) + begin, *py = product.plane(1) + begin,
                   *pz = product.plane(2) + begin;
      double *sx = step.plane(0) + begin, *sy = step.plane(1) + begin, *sz = step.plane(2) + begin;
      double *x = solution.plane(0) + begin, *y = solution.plane(1) + begin,
             *z = solution.plane(2) + begin;
#pragma GCC ivdep
      for (std::ptrdiff_t k = 0; k < count; ++k) {
        const double a = rx[k] - px[k], b = ry[k] - py[k], c = rz[k] - pz[k];
        sx[k] = keep * sx[k] + gain * (xx[k] * a + xy[k] * b + xz[k] * c);
        sy[k] = keep * sy[k] + gain * (xy[k] * a + yy[k] * b + yz[k] * c);
        sz[k] = keep * sz[k] + gain * (xz[k] * a + yz[k] * b + zz[k] * c);
        x[k] += sx[k];
        y[k] += sy[k];
        z[k] += sz[k];
      }
    });
  }

  /// Iterates by Chebyshev's method on the upper part of the spectrum.
  void smooth(bool from_zero) {
    const double upper = 2, lower = 2 / kSmoothedRange;
    const double centre = 0.5 * (upper + lower), half = 0.5 * (upper - lower);
    double ratio = half / centre;
    const double first = ratio;
    for (int n = 0; n < kSmoothing; ++n) {
      if (n == 0 && from_zero)
        product.values.setZero();
      else
        multiply_all(solution);
      if (n == 0) {
        smooth_step(0, 1 / centre);
      } else {
        const double next = 1 / (2 / first - ratio);
        smooth_step(next * ratio, 2 * next / half);
        ratio = next;
      }
    }
  }

  void release_fixed(MeshField& field) const {
    for (const int vertex : fixed) field.set(vertex, Eigen::Vector3d::Zero());
  }

  void set_diagonal() {
    MatrixPlanes diagonal = ground;
    const std::ptrdiff_t s = layout.stride;
    const std::array<std::array<std::ptrdiff_t, 2>, kSpringTypes> ends = {
        {{0, s}, {0, 1}, {0, s + 1}, {s, 1}, {0, 2 * s}, {0, 2}}};
    for_each_index(6, [&](size_t c) {
      for (size_t t = 0; t < kSpringTypes; ++t)
        for (const std::ptrdiff_t end : ends[t])
          if (layout.plane() > end)
            diagonal[c].tail(layout.plane() - end) +=
                springs.stiffness_n_per_m[t][c].head(layout.plane() - end);
    });
    for_rows(layout.rows, [&](int i) {
      for (std::ptrdiff_t k = layout.at(i, 0); k < layout.at(i, layout.columns); ++k) {
        const Block inv = inverse({diagonal[0][k], diagonal[1][k], diagonal[2][k], diagonal[3][k],
                                   diagonal[4][k], diagonal[5][k]});
        const std::array<double, 6> entries = {inv.xx, inv.yy, inv.zz, inv.xy, inv.xz, inv.yz};
        for (size_t c = 0; c < 6; ++c) inverse_diagonal[c][k] = entries[c];
      }
    });
    for (const int vertex : fixed)
      for (size_t c = 0; c < 6; ++c) inverse_diagonal[c][layout.at(vertex)] = 0;
    // The next level gets the stiffness that keeps it from moving fixed vertices between its own.
    fixed_diagonal.resize(fixed.size());
    for (size_t n = 0; n < fixed.size(); ++n)
      for (size_t c = 0; c < 6; ++c) fixed_diagonal[n][c] = diagonal[c][layout.at(fixed[n])];
  }
  std::vector<std::array<double, 6>> fixed_diagonal;
};

namespace {

/// Computes the springs that stand for those of a lattice twice as fine.
void coarsen_springs(const MatrixSprings& fine, const CoarseAxis& down, const CoarseAxis& across,
                     MatrixSprings& coarse) {
  const FieldLayout& f = fine.layout;
  const FieldLayout& to = coarse.layout;
  for_rows(to.rows, [&](int i) {
    const auto set = [&](size_t type, int j, const auto& for_parts) {
      std::array<double, 6> sum{};
      for_parts([&](int fine_i, int fine_j, double weight) {
        for (size_t c = 0; c < 6; ++c)
          sum[c] += weight * fine.stiffness_n_per_m[type][c][f.at(fine_i, fine_j)];
      });
      for (size_t c = 0; c < 6; ++c) coarse.stiffness_n_per_m[type][c][to.at(i, j)] = sum[c];
    };
    for (int j = 0; j < to.columns; ++j) {
      const bool below = i + 1 < to.rows, right = j + 1 < to.columns;
      // A coarse spring's ends are `width` times as far apart as a fine one's. As many fine ones
      // lie between them.
      if (below) {
        const int width = down.width(i);
        set(structural_t, j, [&](const auto& add) {
          across.for_weights(j, [&](int fine_j, double weight) {
            for (int n = 0; n < width; ++n) add(down.at(i) + n, fine_j, weight / (width * width));
          });
        });
      }
      if (right) {
        const int width = across.width(j);
        set(structural_s, j, [&](const auto& add) {
          down.for_weights(i, [&](int fine_i, double weight) {
            for (int n = 0; n < width; ++n) add(fine_i, across.at(j) + n, weight / (width * width));
          });
        });
      }
      if (below && right) {
        for (const size_t type : {size_t{shear_down}, size_t{shear_up}})
          set(type, j, [&](const auto& add) {
            const int high = down.width(i), wide = across.width(j);
            for (int m = 0; m < high; ++m)
              for (int n = 0; n < wide; ++n)
                add(down.at(i) + m, across.at(j) + n, 1.0 / (high * wide));
          });
      }
      // Flexion springs belong to the vertex in their middle.
      if (i + 2 < to.rows) {
        const double ratio = 2.0 / (down.at(i + 2) - down.at(i));
        set(flexion_t, j, [&](const auto& add) {
          across.for_weights(j, [&](int fine_j, double weight) {
            down.for_weights(i + 1, [&](int middle, double share) {
              if (middle >= 1 && middle + 1 < f.rows)
                add(middle - 1, fine_j, weight * share * ratio * ratio);
            });
          });
        });
      }
      if (j + 2 < to.columns) {
        const double ratio = 2.0 / (across.at(j + 2) - across.at(j));
        set(flexion_s, j, [&](const auto& add) {
          down.for_weights(i, [&](int fine_i, double weight) {
            across.for_weights(j + 1, [&](int middle, double share) {
              if (middle >= 1 && middle + 1 < f.columns)
                add(fine_i, middle - 1, weight * share * ratio * ratio);
            });
          });
        });
      }
    }
  });
}

}  // namespace

LatticeMultigrid::~LatticeMultigrid() = default;

LatticeMultigrid::LatticeMultigrid(const FieldLayout& layout, const std::vector<int>& fixed) {
  levels_.push_back(std::make_unique<Level>(layout));
  levels_.back()->fixed = fixed;
  while (!levels_.back()->coarsest()) {
    const Level& fine = *levels_.back();
    auto coarse = std::make_unique<Level>(FieldLayout::of(fine.across.count(), fine.down.count()));
    for (const int vertex : fine.fixed) {
      const auto find = [](const CoarseAxis& axis, int index) {
        const auto found = std::ranges::lower_bound(axis.fine, index);
        return *found == index ? static_cast<int>(found - axis.fine.begin()) : -1;
      };
      const int i = find(fine.down, vertex / fine.layout.columns);
      const int j = find(fine.across, vertex % fine.layout.columns);
      if (i >= 0 && j >= 0) coarse->fixed.push_back(i * coarse->layout.columns + j);
    }
    levels_.push_back(std::move(coarse));
  }
}

void LatticeMultigrid::set(const EnergyTangent& clamped, const Eigen::ArrayXd& shift_n_per_m) {
  Level& finest = *levels_.front();
  finest.tangent = &clamped;
  const std::ptrdiff_t s = finest.layout.stride;
  const std::array<std::array<std::ptrdiff_t, 2>, kSpringTypes> ends = {
      {{0, s}, {0, 1}, {0, s + 1}, {s, 1}, {0, 2 * s}, {0, 2}}};
  const double *x = clamped.position_m.plane(0), *y = clamped.position_m.plane(1),
               *z = clamped.position_m.plane(2);
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const auto [a, b] = ends[t];
    // Springs that would leave the mesh have no stiffness; their far ends must not be read.
    const std::ptrdiff_t last = finest.layout.plane() - std::max(a, b);
    auto& k = finest.springs.stiffness_n_per_m[t];
    const Eigen::ArrayXd& transverse = clamped.transverse_n_per_m[t];
    const Eigen::ArrayXd& longitudinal = clamped.longitudinal_n_per_m3[t];
    for_rows(finest.layout.rows, [&](int i) {
      const std::ptrdiff_t end = std::min(last, finest.layout.at(i + 1, 0));
#pragma GCC ivdep
      for (std::ptrdiff_t at = finest.layout.at(i, 0); at < end; ++at) {
        const double dx = x[at + b] - x[at + a], dy = y[at + b] - y[at + a],
                     dz = z[at + b] - z[at + a];
        const double along = longitudinal[at];
        k[0][at] = transverse[at] + along * dx * dx;
        k[1][at] = transverse[at] + along * dy * dy;
        k[2][at] = transverse[at] + along * dz * dz;
        k[3][at] = along * dx * dy;
        k[4][at] = along * dx * dz;
        k[5][at] = along * dy * dz;
      }
    });
  }
  for (size_t c = 0; c < 3; ++c) finest.ground[c] = shift_n_per_m.head(finest.layout.plane());
  finest.set_diagonal();
  for (size_t l = 1; l < levels_.size(); ++l) {
    Level& fine = *levels_[l - 1];
    Level& coarse = *levels_[l];
    coarsen_springs(fine.springs, fine.down, fine.across, coarse.springs);
    MatrixPlanes ground = fine.ground;
    for (size_t n = 0; n < fine.fixed.size(); ++n)
      for (size_t c = 0; c < 6; ++c)
        ground[c][fine.layout.at(fine.fixed[n])] += fine.fixed_diagonal[n][c];
    for (size_t c = 0; c < 6; ++c)
      restrict_plane(fine.layout, fine.down, fine.across, ground[c].data(), coarse.layout,
                     coarse.ground[c].data());
    coarse.set_diagonal();
  }

  Level& coarsest = *levels_.back();
  const int size = 3 * coarsest.layout.rows * coarsest.layout.columns;
  Eigen::MatrixXd dense(size, size);
  for (int column = 0; column < size; ++column) {
    coarsest.solution.values.setZero();
    coarsest.solution.set(column / 3, Eigen::Vector3d::Unit(column % 3));
    coarsest.multiply_all(coarsest.solution);
    for (int v = 0; v < size / 3; ++v) dense.block<3, 1>(3 * v, column) = coarsest.product.at(v);
  }
  for (const int vertex : coarsest.fixed) {
    dense.middleRows<3>(3 * vertex).setZero();
    dense.middleCols<3>(3 * vertex).setZero();
    dense.block<3, 3>(3 * vertex, 3 * vertex).setIdentity();
  }
  coarsest_.compute(dense);
}

void LatticeMultigrid::cycle(size_t number) {
  Level& level = *levels_[number];
  level.release_fixed(level.right);
  level.solution.values.setZero();
  if (level.coarsest()) {
    const int vertices = level.layout.rows * level.layout.columns;
    Eigen::VectorXd right(3 * vertices);
    for (int v = 0; v < vertices; ++v) right.segment<3>(3 * v) = level.right.at(v);
    const Eigen::VectorXd solution = coarsest_.solve(right);
    for (int v = 0; v < vertices; ++v) level.solution.set(v, solution.segment<3>(3 * v));
    return;
  }
  level.smooth(true);
  level.multiply_all(level.solution);
  for_segments(level.layout, [&](std::ptrdiff_t begin, std::ptrdiff_t count) {
    for (int axis = 0; axis < 3; ++axis)
      Eigen::Map<Eigen::ArrayXd>(level.product.plane(axis) + begin, count) =
          Eigen::Map<const Eigen::ArrayXd>(level.right.plane(axis) + begin, count) -
          Eigen::Map<const Eigen::ArrayXd>(level.product.plane(axis) + begin, count);
  });
  level.release_fixed(level.product);
  Level& coarse = *levels_[number + 1];
  for (int axis = 0; axis < 3; ++axis)
    restrict_plane(level.layout, level.down, level.across, level.product.plane(axis), coarse.layout,
                   coarse.right.plane(axis));
  cycle(number + 1);
  for (int axis = 0; axis < 3; ++axis)
    add_prolongated_plane(coarse.layout, level.down, level.across, coarse.solution.plane(axis),
                          level.layout, level.solution.plane(axis));
  level.release_fixed(level.solution);
  level.smooth(false);
}

void LatticeMultigrid::apply(const MeshField& r, MeshField& v) {
  levels_.front()->right.values = r.values;
  cycle(0);
  v.values = levels_.front()->solution.values;
}

}  // namespace clothfit
