// Checkpoints of both searches. Each line gets the checksum that it needs, or all would end there.

#include <fmt/format.h>

#include "fit/jobs/checksum.h"
#include "fit/search/search_checkpoint.h"
#include "tests/fuzz/scratch_folder.h"

namespace clothfit {
namespace {

std::string with_checksums(std::string_view text) {
  std::string result;
  std::uint64_t sum = kEmptyChecksum;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    sum = checksum("\n", checksum(line, sum));
    result += fmt::format("{} {:016x}\n", line, sum);
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return result;
}

/// Makes one generation more from a checkpoint, as a resumed search does.
Eigen::VectorXd no_costs(const Eigen::MatrixXd& individuals) {
  return Eigen::VectorXd::LinSpaced(individuals.cols(), 1, 2);
}

}  // namespace
}  // namespace clothfit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const std::vector<SearchParameter> parameters = {{.name = "a"}, {.name = "b"}};
  const auto file = write_scratch("search.txt", with_checksums(text_of(data, size)));
  const EvolutionOptions evolution{.population = 4};
  const CmaOptions cma{.population = 4, .most_evaluations = 40};
  read_or_refuse([&] {
    const EvolutionState state = load_evolution_checkpoint(file, "p", parameters, evolution);
    next_generation(parameters, evolution, no_costs, state);
  });
  read_or_refuse([&] {
    const CmaState state = load_cma_checkpoint(file, "p", parameters, cma);
    next_cma_generation(parameters, cma, no_costs, state);
  });
  return 0;
}
