#include "apps/study/recordings/marker_weights.h"

#include <algorithm>

#include "data/csv_reader.h"
#include "data/input_error.h"

namespace clothfit {

MarkerWeights read_marker_weights(const std::filesystem::path& file) {
  CsvReader table(file, {{.name = "marker"}, {.name = "weight"}});
  MarkerWeights weights;
  while (table.next()) {
    const double weight = table.number(1);
    if (weight < 0) table.refuse("weight = " + std::string(table.text(1)), "a number of 0 or more");
    const std::string name = table.name(0);
    if (!weights.emplace(name, weight).second)
      table.refuse("marker " + name + " stands here again", "one row per marker");
  }
  table.require_rows("weights");
  if (std::ranges::all_of(weights, [](const auto& named) { return named.second == 0; }))
    throw InputError(file.string(), "all weights are 0", "at least one marker that counts");
  return weights;
}

std::vector<double> weights_of(const MarkerSet& markers, const MarkerWeights& weights) {
  std::vector<double> result(markers.markers.size(), 0.0);
  for (const auto& [name, weight] : weights) {
    const auto found = markers.index.find(name);
    if (found == markers.index.end())
      throw InputError("--weights", "names marker " + name + ", which the recording does not have",
                       "markers of every recording of the study");
    result[static_cast<size_t>(found->second)] = weight;
  }
  return result;
}

}  // namespace clothfit
