#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace clothfit {

/// A tree of boxes over triangles that move: built once over where they lie first, its boxes
/// updated when they have moved [lethanh2007, section 5].
class TriangleTree {
 public:
  struct Box {
    Eigen::Vector3d low, high;
    void include(const Eigen::Vector3d& place) {
      low = low.cwiseMin(place);
      high = high.cwiseMax(place);
    }
    bool meets(const Box& other) const {
      return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
    }
  };

  TriangleTree() = default;
  /// `centre`: 3 x triangles.
  explicit TriangleTree(const Eigen::Matrix3Xd& centre);

  /// Takes over a box for every triangle.
  void update(const std::vector<Box>& boxes);

  /// Calls `visit(a, b)` once for every two triangles whose boxes meet. The order depends on the
  /// boxes alone.
  template <class Visit>
  void for_meetings(const Visit& visit) const {
    if (!nodes_.empty()) among(0, visit);
  }

 private:
  struct Node {
    Box box;
    int first = 0;  ///< a leaf's triangle, otherwise the second child; the first comes next
    bool leaf = false;
  };
  void build(std::vector<int>& triangles, int first, int last, const Eigen::Matrix3Xd& centre);

  template <class Visit>
  void among(int node, const Visit& visit) const {
    const Node& here = nodes_[static_cast<size_t>(node)];
    if (here.leaf) return;
    among(node + 1, visit);
    among(here.first, visit);
    between(node + 1, here.first, visit);
  }
  template <class Visit>
  void between(int a, int b, const Visit& visit) const {
    const Node &of_a = nodes_[static_cast<size_t>(a)], &of_b = nodes_[static_cast<size_t>(b)];
    if (!of_a.box.meets(of_b.box)) return;
    if (of_a.leaf && of_b.leaf) {
      visit(of_a.first, of_b.first);
    } else if (of_b.leaf || (!of_a.leaf && size_of(of_a.box) >= size_of(of_b.box))) {
      between(a + 1, b, visit);
      between(of_a.first, b, visit);
    } else {
      between(a, b + 1, visit);
      between(a, of_b.first, visit);
    }
  }
  static double size_of(const Box& box) { return (box.high - box.low).squaredNorm(); }

  std::vector<Node> nodes_;
};

}  // namespace clothfit
