#pragma once

#include <Eigen/Core>
#include <utility>

#include "model/kernels/aligned_numbers.h"

namespace clothfit {

/// An Eigen array of `rows` x a number of columns set when it is made, in aligned memory. It reads
/// and writes like any other; an assigned array or expression sets its size. A vector that begins
/// inside may reach up to kPadding numbers past the last one; their values count for nothing.
template <class Number, int rows>
class AlignedArray : public Eigen::Map<Eigen::Array<Number, rows, Eigen::Dynamic>> {
  using Plain = Eigen::Array<Number, rows, Eigen::Dynamic>;
  using Map = Eigen::Map<Plain>;

 public:
  static constexpr int kPadding = 7;

  AlignedArray() : Map(nullptr, rows, 0) {}
  AlignedArray(Eigen::Index, Eigen::Index columns) : Map(nullptr, rows, 0) { resize(columns); }
  AlignedArray(const AlignedArray& other) : AlignedArray(rows, other.cols()) {
    Map::operator=(other);
  }
  AlignedArray(AlignedArray&& other) noexcept : Map(nullptr, rows, 0) { swap(other); }
  template <class Derived>
  AlignedArray(const Eigen::DenseBase<Derived>& values) : AlignedArray(rows, values.cols()) {
    Map::operator=(values);
  }

  AlignedArray& operator=(const AlignedArray& other) {
    if (this->cols() != other.cols()) resize(other.cols());
    Map::operator=(other);
    return *this;
  }
  AlignedArray& operator=(AlignedArray&& other) noexcept {
    swap(other);
    return *this;
  }
  template <class Derived>
  AlignedArray& operator=(const Eigen::DenseBase<Derived>& values) {
    if (this->cols() != values.cols()) return *this = AlignedArray(values);
    Map::operator=(values);
    return *this;
  }

 private:
  /// Resizes and leaves zeros.
  void resize(Eigen::Index columns) {
    numbers_ = AlignedNumbers<Number>(static_cast<size_t>(rows * columns + kPadding));
    look_at(columns);
  }
  void swap(AlignedArray& other) noexcept {
    std::swap(numbers_, other.numbers_);
    const Eigen::Index columns = this->cols();
    look_at(other.cols());
    other.look_at(columns);
  }
  /// Points the Map elsewhere, in Eigen's way.
  void look_at(Eigen::Index columns) noexcept {
    new (static_cast<Map*>(this)) Map(numbers_.data(), rows, columns);
  }

  AlignedNumbers<Number> numbers_;
};

}  // namespace clothfit
