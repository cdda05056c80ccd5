#include "model/sheet/block_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cassert>
#include <utility>

namespace clothfit {
namespace {

/// A front takes in a child where the zeros that this stores are below this share of both, or
/// where both are so narrow that loops cost more than zeros.
constexpr double kMostZeros = 0.05, kMostZerosOfNarrow = 0.2;
constexpr int kNarrow = 4;

/// Returns each point's place in an order of little fill.
std::vector<int> order_of_little_fill(int points, const std::vector<BlockEnergy::Pair>& pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [low, high] : pairs) {
    entries.emplace_back(high, low, 1);
    if (low != high) entries.emplace_back(low, high, 1);
  }
  Eigen::SparseMatrix<double> graph(points, points);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);
  std::vector<int> order(static_cast<size_t>(points));
  for (int place = 0; place < points; ++place)
    order[static_cast<size_t>(permutation.indices()[place])] = place;
  return order;
}

/// Neighbours of every point that come before it in the order, in places of the order.
std::vector<std::vector<int>> earlier_neighbours(const std::vector<int>& order,
                                                 const std::vector<BlockEnergy::Pair>& pairs) {
  std::vector<std::vector<int>> earlier(order.size());
  for (const auto& [low, high] : pairs) {
    const auto [first, last] =
        std::minmax({order[static_cast<size_t>(low)], order[static_cast<size_t>(high)]});
    if (first != last) earlier[static_cast<size_t>(last)].push_back(first);
  }
  return earlier;
}

/// Returns the parent of every column in the elimination tree [liu1992]; -1 for a root.
std::vector<int> elimination_tree(const std::vector<std::vector<int>>& earlier) {
  const size_t count = earlier.size();
  std::vector<int> parent(count, -1), ancestor(count, -1);
  for (size_t j = 0; j < count; ++j)
    for (int i : earlier[j])
      while (i != -1 && i != static_cast<int>(j)) {
        const int next = std::exchange(ancestor[static_cast<size_t>(i)], static_cast<int>(j));
        if (next == -1) parent[static_cast<size_t>(i)] = static_cast<int>(j);
        i = next;
      }
  return parent;
}

/// Returns the places of columns in an order in which those below a column of the tree come right
/// before it.
std::vector<int> postorder(const std::vector<int>& parent) {
  const int count = static_cast<int>(parent.size());
  std::vector<std::vector<int>> children(parent.size() + 1);
  for (int j = count - 1; j >= 0; --j) {
    const int of = parent[static_cast<size_t>(j)];
    children[static_cast<size_t>(of < 0 ? count : of)].push_back(j);
  }
  std::vector<int> place(parent.size(), -1), open{count};
  int next = 0;
  while (!open.empty()) {
    std::vector<int>& of = children[static_cast<size_t>(open.back())];
    if (!of.empty()) {
      open.push_back(of.back());
      of.pop_back();
      continue;
    }
    if (open.back() < count) place[static_cast<size_t>(open.back())] = next++;
    open.pop_back();
  }
  return place;
}

/// Returns the rows below the diagonal of every column of the factor.
std::vector<std::vector<int>> rows_of_factor(const std::vector<std::vector<int>>& earlier,
                                             const std::vector<int>& parent) {
  std::vector<std::vector<int>> below(parent.size());
  for (size_t j = 0; j < earlier.size(); ++j)
    for (const int i : earlier[j]) below[static_cast<size_t>(i)].push_back(static_cast<int>(j));
  for (size_t j = 0; j < below.size(); ++j) {
    std::vector<int>& rows = below[j];
    std::ranges::sort(rows);
    const auto repeated = std::ranges::unique(rows);
    rows.erase(repeated.begin(), repeated.end());
    if (parent[j] < 0) continue;
    std::vector<int>& above = below[static_cast<size_t>(parent[j])];
    for (const int row : rows)
      if (row != parent[j]) above.push_back(row);
  }
  return below;
}

}  // namespace

BlockCholesky::BlockCholesky(int points, const std::vector<Pair>& pairs)
    : order_(order_of_little_fill(points, pairs)) {
  const std::vector<int> place = postorder(elimination_tree(earlier_neighbours(order_, pairs)));
  for (int& of : order_) of = place[static_cast<size_t>(of)];
  const auto earlier = earlier_neighbours(order_, pairs);
  const std::vector<int> parent = elimination_tree(earlier);
  make_fronts(rows_of_factor(earlier, parent), parent);
  find_places(pairs);
}

void BlockCholesky::make_fronts(const std::vector<std::vector<int>>& below,
                                const std::vector<int>& parent) {
  const int count = static_cast<int>(below.size());
  std::vector<int> front_of(below.size());
  // A column joins the front before it where that one's first row is this column: the front's last
  // child in the tree. The front's other rows are then among this column's.
  for (int j = 0; j < count; ++j) {
    const auto& rows = below[static_cast<size_t>(j)];
    Front alone;
    alone.first = j;
    alone.columns = 1;
    alone.rows = rows;
    while (!fronts_.empty()) {
      const Front& child = fronts_.back();
      const bool is_last_child = parent[static_cast<size_t>(alone.first - 1)] >= alone.first &&
                                 child.rows.front() < alone.first + alone.columns;
      if (!is_last_child) break;
      const int columns = child.columns + alone.columns;
      const double zeros =
          child.zeros + alone.zeros +
          child.columns * (alone.points() - static_cast<double>(child.rows.size()));
      const double all = columns * (static_cast<double>(alone.points()) + child.columns);
      if (zeros > (columns <= kNarrow ? kMostZerosOfNarrow : kMostZeros) * all) break;
      alone.zeros = zeros;
      alone.first = child.first;
      alone.columns += child.columns;
      fronts_.pop_back();
    }
    fronts_.push_back(std::move(alone));
  }
  for (size_t f = 0; f < fronts_.size(); ++f)
    for (int k = 0; k < fronts_[f].columns; ++k)
      front_of[static_cast<size_t>(fronts_[f].first + k)] = static_cast<int>(f);
  for (size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    if (front.rows.empty()) continue;
    front.parent = front_of[static_cast<size_t>(front.rows.front())];
    Front& above = fronts_[static_cast<size_t>(front.parent)];
    above.children.push_back(static_cast<int>(f));
    for (const int row : front.rows) front.in_parent.push_back(place_in(above, row));
  }
}

int BlockCholesky::place_in(const Front& front, int point) const {
  if (point < front.first + front.columns) return point - front.first;
  const auto at = std::ranges::lower_bound(front.rows, point);
  assert(at != front.rows.end() && *at == point);
  return front.columns + static_cast<int>(at - front.rows.begin());
}

void BlockCholesky::find_places(const std::vector<Pair>& pairs) {
  std::vector<int> front_of(order_.size());
  for (size_t f = 0; f < fronts_.size(); ++f)
    for (int k = 0; k < fronts_[f].columns; ++k)
      front_of[static_cast<size_t>(fronts_[f].first + k)] = static_cast<int>(f);
  pairs_of_.resize(fronts_.size());
  panel_.resize(fronts_.size());
  for (size_t p = 0; p < pairs.size(); ++p) {
    const int low = order_[static_cast<size_t>(pairs[p].low)],
              high = order_[static_cast<size_t>(pairs[p].high)];
    const auto [column, row] = std::minmax({low, high});
    const int front = front_of[static_cast<size_t>(column)];
    const Front& of = fronts_[static_cast<size_t>(front)];
    place_.push_back({front, place_in(of, row), column - of.first, low > high});
    pairs_of_[static_cast<size_t>(front)].push_back(static_cast<int>(p));
  }
}

bool BlockCholesky::factorise(const std::vector<Eigen::Matrix3d>& blocks) {
  assert(blocks.size() == place_.size());
  // What a front leaves to its parent; gone once that has taken it in.
  std::vector<Eigen::MatrixXd> left(fronts_.size());
  for (size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    const Eigen::Index columns = 3 * front.columns, rows = 3 * front.points() - columns;
    Eigen::MatrixXd& panel = panel_[f];
    panel.setZero(columns + rows, columns);
    Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(rows, rows);
    for (const int p : pairs_of_[f]) {
      const Place& place = place_[static_cast<size_t>(p)];
      const Eigen::Matrix3d& block = blocks[static_cast<size_t>(p)];
      if (place.turned)
        panel.block<3, 3>(3 * place.row, 3 * place.column) = block.transpose();
      else
        panel.block<3, 3>(3 * place.row, 3 * place.column) = block;
    }
    for (const int c : front.children) {
      const std::vector<int>& places = fronts_[static_cast<size_t>(c)].in_parent;
      Eigen::MatrixXd& of_child = left[static_cast<size_t>(c)];
      for (size_t b = 0; b < places.size(); ++b)
        for (size_t a = b; a < places.size(); ++a) {
          const auto block = of_child.block<3, 3>(static_cast<Eigen::Index>(3 * a),
                                                  static_cast<Eigen::Index>(3 * b));
          if (places[b] < front.columns)
            panel.block<3, 3>(3 * places[a], 3 * places[b]) += block;
          else
            rest.block<3, 3>(3 * places[a] - columns, 3 * places[b] - columns) += block;
        }
      of_child.resize(0, 0);
    }
    auto diagonal = panel.topRows(columns);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(diagonal);
    if (factor.info() != Eigen::Success) return false;
    if (rows == 0) continue;
    auto under = panel.bottomRows(rows);
    diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(under);
    rest.selfadjointView<Eigen::Lower>().rankUpdate(under, -1);
    left[f] = std::move(rest);
  }
  return true;
}

Eigen::VectorXd BlockCholesky::solve(const Eigen::VectorXd& right) const {
  Eigen::VectorXd x(right.size());
  for (size_t v = 0; v < order_.size(); ++v)
    x.segment<3>(3 * order_[v]) = right.segment<3>(static_cast<Eigen::Index>(3 * v));
  for (size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    auto own = x.segment(3 * front.first, 3 * front.columns);
    panel_[f].topRows(own.size()).triangularView<Eigen::Lower>().solveInPlace(own);
    const Eigen::VectorXd below = panel_[f].bottomRows(panel_[f].rows() - own.size()) * own;
    for (size_t k = 0; k < front.rows.size(); ++k)
      x.segment<3>(3 * front.rows[k]) -= below.segment<3>(static_cast<Eigen::Index>(3 * k));
  }
  for (size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    Eigen::VectorXd below(static_cast<Eigen::Index>(3 * front.rows.size()));
    for (size_t k = 0; k < front.rows.size(); ++k)
      below.segment<3>(static_cast<Eigen::Index>(3 * k)) = x.segment<3>(3 * front.rows[k]);
    auto own = x.segment(3 * front.first, 3 * front.columns);
    own.noalias() -= panel_[f].bottomRows(below.size()).transpose() * below;
    panel_[f].topRows(own.size()).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  Eigen::VectorXd result(right.size());
  for (size_t v = 0; v < order_.size(); ++v)
    result.segment<3>(static_cast<Eigen::Index>(3 * v)) = x.segment<3>(3 * order_[v]);
  return result;
}

double BlockCholesky::stored_numbers() const {
  double numbers = 0;
  for (const Front& front : fronts_) numbers += 9.0 * front.columns * front.points();
  return numbers;
}

}  // namespace clothfit
