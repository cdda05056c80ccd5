// Checkpoints of both searches: the input is what follows the header, which holds the version of
// the program. Each line gets the checksum that it needs, or all would end there.

#include <fmt/format.h>

#include <fstream>
#include <functional>

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

/// Returns the header of what `save` writes, its last line included, without checksums.
std::string header_of(const std::function<void(const std::filesystem::path&)>& save) {
  const auto file = write_scratch("header.txt", "");
  save(file);
  std::ifstream in(file);
  std::string header, line;
  while (std::getline(in, line)) {
    line.resize(line.rfind(' '));
    header += line + "\n";
    if (line == "state") break;
  }
  return header;
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
  const EvolutionOptions evolution{.population = 4};
  const CmaOptions cma{.population = 4, .most_evaluations = 40};
  static const std::string evolution_header = header_of([&](const auto& file) {
    save_checkpoint(file, "p", parameters, evolution,
                    first_generation(parameters, evolution, no_costs));
  });
  static const std::string cma_header = header_of([&](const auto& file) {
    save_checkpoint(file, "p", parameters, cma, start_cma(parameters, cma));
  });
  const std::string state(text_of(data, size));
  read_or_refuse([&] {
    const auto file = write_scratch("search.txt", with_checksums(evolution_header + state));
    next_generation(parameters, evolution, no_costs,
                    load_evolution_checkpoint(file, "p", parameters, evolution));
  });
  read_or_refuse([&] {
    const auto file = write_scratch("search.txt", with_checksums(cma_header + state));
    next_cma_generation(parameters, cma, no_costs, load_cma_checkpoint(file, "p", parameters, cma));
  });
  return 0;
}
