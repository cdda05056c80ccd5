#include "model/topology/triangle_tree.h"

#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace clothfit {

TriangleTree::TriangleTree(const Eigen::Matrix3Xd& centre) {
  std::vector<int> triangles(static_cast<size_t>(centre.cols()));
  std::iota(triangles.begin(), triangles.end(), 0);
  if (!triangles.empty()) build(triangles, 0, static_cast<int>(triangles.size()), centre);
}

void TriangleTree::build(std::vector<int>& triangles, int first, int last,
                         const Eigen::Matrix3Xd& centre) {
  const size_t here = nodes_.size();
  nodes_.emplace_back();
  const auto begin = triangles.begin();
  if (last - first == 1) {
    nodes_[here].first = triangles[static_cast<size_t>(first)];
    nodes_[here].leaf = true;
    return;
  }
  Box box{Eigen::Vector3d::Constant(INFINITY), Eigen::Vector3d::Constant(-INFINITY)};
  for (int t = first; t < last; ++t) box.include(centre.col(triangles[static_cast<size_t>(t)]));
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const int middle = (first + last) / 2;
  // The order is complete, so that the tree does not depend on the library.
  std::nth_element(begin + first, begin + middle, begin + last, [&](int a, int b) {
    return std::pair{centre(axis, a), a} < std::pair{centre(axis, b), b};
  });
  build(triangles, first, middle, centre);
  const auto second = static_cast<int>(nodes_.size());
  build(triangles, middle, last, centre);
  nodes_[here].first = second;
}

void TriangleTree::update(const std::vector<Box>& boxes) {
  assert(2 * boxes.size() == nodes_.size() + (boxes.empty() ? 0 : 1));
  // Children come after their node.
  for (size_t n = nodes_.size(); n-- > 0;) {
    Node& node = nodes_[n];
    if (node.leaf) {
      node.box = boxes[static_cast<size_t>(node.first)];
      continue;
    }
    node.box = nodes_[n + 1].box;
    node.box.include(nodes_[static_cast<size_t>(node.first)].box.low);
    node.box.include(nodes_[static_cast<size_t>(node.first)].box.high);
  }
}

}  // namespace clothfit
