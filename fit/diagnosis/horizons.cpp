#include "fit/diagnosis/horizons.h"

namespace clothfit {

std::vector<double> shares_from(double first) {
  std::vector<double> shares;
  for (double at = first; at < 0.85; at *= 1.6) shares.push_back(at);
  shares.push_back(1);
  return shares;
}

}  // namespace clothfit
