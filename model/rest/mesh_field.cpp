#include "model/rest/mesh_field.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/parallel.h"

namespace clothfit {
namespace {

/// Doubles that one task works on; smaller fields stay on the caller's thread.
constexpr std::ptrdiff_t kChunk = 32768;

template <class Work>
void for_chunks(std::ptrdiff_t size, const Work& work) {
  const std::ptrdiff_t chunks = (size + kChunk - 1) / kChunk;
  const auto one = [&](size_t chunk) {
    const auto c = static_cast<std::ptrdiff_t>(chunk);
    const std::ptrdiff_t begin = c * kChunk;
    work(c, begin, std::min(kChunk, size - begin));
  };
  if (chunks == 1)
    one(0);
  else
    for_each_index(static_cast<size_t>(chunks), one);
}

double dot_of_chunk(const double* a, const double* b, std::ptrdiff_t count) {
  // An 8-fold vector unit and plain code both keep these partial sums in the same order.
  Eigen::Array<double, kLanes, 1> sums = Eigen::Array<double, kLanes, 1>::Zero();
  using Lanes = Eigen::Map<const Eigen::Array<double, kLanes, 1>>;
  for (std::ptrdiff_t k = 0; k + kLanes <= count; k += kLanes) sums += Lanes(a + k) * Lanes(b + k);
  double sum = 0;
  for (int l = 0; l < kLanes; ++l) sum += sums[l];
  return sum;
}

}  // namespace

MeshField MeshField::of(const FieldLayout& layout, const Eigen::Matrix3Xd& vectors) {
  MeshField field(layout);
  for (int i = 0; i < layout.rows; ++i)
    for (int j = 0; j < layout.columns; ++j)
      for (int axis = 0; axis < 3; ++axis)
        field.plane(axis)[layout.at(i, j)] = vectors(axis, i * layout.columns + j);
  return field;
}

Eigen::Matrix3Xd MeshField::vectors() const {
  Eigen::Matrix3Xd result(3, layout.columns * layout.rows);
  for (int i = 0; i < layout.rows; ++i)
    for (int j = 0; j < layout.columns; ++j)
      for (int axis = 0; axis < 3; ++axis)
        result(axis, i * layout.columns + j) = plane(axis)[layout.at(i, j)];
  return result;
}

double dot(const MeshField& a, const MeshField& b) {
  const std::ptrdiff_t size = a.values.size();  // a multiple of kLanes
  std::vector<double> sums(static_cast<size_t>((size + kChunk - 1) / kChunk));
  for_chunks(size, [&](std::ptrdiff_t c, std::ptrdiff_t begin, std::ptrdiff_t count) {
    sums[static_cast<size_t>(c)] =
        dot_of_chunk(a.values.data() + begin, b.values.data() + begin, count);
  });
  double sum = 0;
  for (const double part : sums) sum += part;
  return sum;
}

double norm(const MeshField& a) {
  return std::sqrt(dot(a, a));
}

void add_scaled(double factor, const MeshField& x, MeshField& y) {
  for_chunks(x.values.size(), [&](std::ptrdiff_t, std::ptrdiff_t begin, std::ptrdiff_t count) {
    y.values.segment(begin, count) += factor * x.values.segment(begin, count);
  });
}

void scale_and_add(const MeshField& x, double factor, MeshField& y) {
  for_chunks(x.values.size(), [&](std::ptrdiff_t, std::ptrdiff_t begin, std::ptrdiff_t count) {
    y.values.segment(begin, count) =
        x.values.segment(begin, count) + factor * y.values.segment(begin, count);
  });
}

}  // namespace clothfit
