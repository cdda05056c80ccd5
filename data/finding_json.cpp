#include "data/finding_json.h"

#include <nlohmann/json.hpp>

namespace clothfit {

nlohmann::ordered_json to_json(const Finding& finding) {
  return {{"check", finding.check},
          {"found", finding.found},
          {"where", finding.where},
          {"expected", finding.expected},
          {"remedy", finding.remedy}};
}

}  // namespace clothfit
