#include "fit/problem/box.h"

#include "fit/problem/parameter_space.h"

namespace clothfit {

std::vector<bool> Box::blocked(const Eigen::VectorXd& x, const Eigen::VectorXd& gradient) const {
  std::vector<bool> held(static_cast<size_t>(x.size()));
  for (Eigen::Index p = 0; p < x.size(); ++p)
    held[static_cast<size_t>(p)] = blocks(p, x[p], gradient[p]);
  return held;
}

Box box_of(const ParameterSpace& space) {
  Eigen::VectorXd lower(space.size()), upper(space.size());
  for (int p = 0; p < space.size(); ++p) {
    lower[p] = space.parameters[static_cast<size_t>(p)].lower;
    upper[p] = space.parameters[static_cast<size_t>(p)].upper;
  }
  return {.lower = space.coordinates(lower), .upper = space.coordinates(upper)};
}

}  // namespace clothfit
