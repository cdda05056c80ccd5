// Checks searches on disk: what is read back, and what is refused. Not checked here: that a search
// goes on from a state in memory (cma_es_test.cpp, evolutionary_strategy_test.cpp), power cuts.

#include "fit/search/search_checkpoint.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <limits>
#include <sstream>

#include "fit/jobs/checksum.h"
#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kProblem = "rastrigin, unit metres";

std::vector<SearchParameter> ranges() {
  return {{.name = "stiffness of all", .lower = 0.1, .upper = 7, .log_scale = true},
          {.name = "angle", .lower = -5, .upper = 5},
          {.name = "c", .lower = -1.0 / 3, .upper = 5}};
}

/// Evaluates a cost of many optima; a part of the ranges diverges.
Eigen::VectorXd bumpy(const Eigen::MatrixXd& individuals) {
  Eigen::VectorXd costs(individuals.cols());
  for (Eigen::Index k = 0; k < costs.size(); ++k) {
    const Eigen::ArrayXd x = individuals.col(k).array() - 0.4;
    costs[k] = x[1] > 3 ? NAN : (x.square() - 3 * (6 * x).cos() + 3).sum();
  }
  return costs;
}

using Bits = std::vector<std::uint64_t>;

Bits bits_of(const double* numbers, std::ptrdiff_t count) {
  Bits bits;
  for (std::ptrdiff_t k = 0; k < count; ++k)
    bits.push_back(std::bit_cast<std::uint64_t>(numbers[k]));
  return bits;
}
Bits bits_of(const Eigen::MatrixXd& numbers) {
  return bits_of(numbers.data(), numbers.size());
}
Bits bits_of(const std::vector<double>& numbers) {
  return bits_of(numbers.data(), std::ssize(numbers));
}
Bits bits_of(double number) {
  return bits_of(&number, 1);
}

void expect_same(const EvolutionState& a, const EvolutionState& b) {
  EXPECT_EQ(a.evaluations, b.evaluations);
  EXPECT_EQ(bits_of(a.best_cost), bits_of(b.best_cost));
  ASSERT_EQ(a.population.size(), b.population.size());
  for (size_t k = 0; k < a.population.size(); ++k) {
    EXPECT_EQ(bits_of(a.population[k].values), bits_of(b.population[k].values));
    EXPECT_EQ(bits_of(a.population[k].cost), bits_of(b.population[k].cost));
    EXPECT_EQ(a.population[k].origin, b.population[k].origin);
    EXPECT_EQ(a.population[k].parent_ranks, b.population[k].parent_ranks);
  }
}

void expect_same(const CmaOptimum& a, const CmaOptimum& b) {
  EXPECT_EQ(bits_of(a.values), bits_of(b.values));
  EXPECT_EQ(bits_of(a.cost), bits_of(b.cost));
  EXPECT_EQ(a.end, b.end);
  EXPECT_EQ(a.evaluations, b.evaluations);
}

void expect_same(const CmaState& a, const CmaState& b) {
  EXPECT_EQ(a.population, b.population);
  EXPECT_EQ(bits_of(a.mean), bits_of(b.mean));
  EXPECT_EQ(bits_of(a.step), bits_of(b.step));
  EXPECT_EQ(a.covariance.rows(), b.covariance.rows());
  EXPECT_EQ(bits_of(a.covariance), bits_of(b.covariance));
  EXPECT_EQ(bits_of(a.covariance_path), bits_of(b.covariance_path));
  EXPECT_EQ(bits_of(a.step_path), bits_of(b.step_path));
  EXPECT_EQ(a.generation, b.generation);
  EXPECT_EQ(bits_of(a.recent_best), bits_of(b.recent_best));
  expect_same(a.so_far, b.so_far);
  ASSERT_EQ(a.optima.size(), b.optima.size());
  for (size_t k = 0; k < a.optima.size(); ++k) expect_same(a.optima[k], b.optima[k]);
  EXPECT_EQ(bits_of(a.best_cost), bits_of(b.best_cost));
  EXPECT_EQ(a.evaluations, b.evaluations);
}

CmaOptions cma_options() {
  return {.restarts = 1, .growth = 1.5, .cost_tolerance = 1e-6, .seed = 18446744073709551615u};
}

EvolutionOptions evolution_options() {
  EvolutionOptions options;
  options.population = 20;
  options.generations = 25;
  options.mutation = MutationLaw::gaussian;
  options.least_gain = 0;
  options.seed = 12;
  return options;
}

TEST(SearchCheckpoint, OfCmaAtEveryGenerationLeadsToTheEndOfTheUninterruptedSearch) {
  const TemporaryFolder folder;
  const auto file = folder / "search";
  const CmaOptions options = cma_options();
  const CmaResult whole = search_by_cma(ranges(), options, bumpy, start_cma(ranges(), options));
  ASSERT_EQ(whole.state.optima.size(), 2u);

  // The search dies after each generation and is resumed from its file.
  struct Died {};
  save_checkpoint(file, kProblem, ranges(), options, start_cma(ranges(), options));
  for (int generation = 1;; ++generation) {
    SCOPED_TRACE(generation);
    try {
      const CmaResult last = search_by_cma(
          ranges(), options, bumpy, load_cma_checkpoint(file, kProblem, ranges(), options), {},
          [&](const CmaState& state) {
            save_checkpoint(file, kProblem, ranges(), options, state);
            expect_same(load_cma_checkpoint(file, kProblem, ranges(), options), state);
            throw Died();
          });
      EXPECT_EQ(last.stop, whole.stop);
      expect_same(last.state, whole.state);
      EXPECT_EQ(generation, whole.state.generations() + 1);
      return;
    } catch (const Died&) {
      ASSERT_LE(generation, whole.state.generations());
    }
  }
}

TEST(SearchCheckpoint, OfEvolutionAtEveryGenerationLeadsToTheEndOfTheUninterruptedSearch) {
  const TemporaryFolder folder;
  const EvolutionOptions options = evolution_options();
  const auto file_of = [&](int generation) {
    return folder / (std::to_string(generation) + ".gz");  // compressed as any text file
  };
  const EvolutionResult whole = evolve(
      ranges(), options, bumpy, {}, {Eigen::Vector3d(1, 4, 1)}, [&](const EvolutionState& state) {
        save_checkpoint(file_of(state.generations()), kProblem, ranges(), options, state);
        expect_same(
            load_evolution_checkpoint(file_of(state.generations()), kProblem, ranges(), options),
            state);
      });
  ASSERT_EQ(whole.state.generations(), 25);

  for (int generation = 1; generation <= 25; ++generation) {
    SCOPED_TRACE(generation);
    int seen = generation;
    const EvolutionResult rest = resume_evolution(
        ranges(), options, bumpy,
        load_evolution_checkpoint(file_of(generation), kProblem, ranges(), options), {},
        [&](const EvolutionState& state) { EXPECT_EQ(state.generations(), ++seen); });
    EXPECT_EQ(seen, 25);
    EXPECT_EQ(rest.stop, whole.stop);
    expect_same(rest.state, whole.state);
  }
}

TEST(SearchCheckpoint, KeepsTheBitsOfNumbersThatAreHardToWrite) {
  const TemporaryFolder folder;
  CmaState state = start_cma(ranges(), {});
  state.mean = Eigen::Vector3d(0.1, -0.0, 5e-324);
  state.covariance << kInfinity, -kInfinity, NAN, -NAN, 1.0 / 3, std::nextafter(1.0, 2.0),
      std::numeric_limits<double>::max(), std::numeric_limits<double>::denorm_min(),
      2.2250738585072011e-308;
  state.best_cost = {kInfinity, 1e22, 123456789012345680.0};
  state.optima.push_back({.end = CmaEnd::nothing_finite});

  save_checkpoint(folder / "search", kProblem, ranges(), CmaOptions{}, state);

  expect_same(load_cma_checkpoint(folder / "search", kProblem, ranges(), {}), state);
}

TEST(SearchCheckpoint, RefusesAnotherSearch) {
  const TemporaryFolder folder;
  const CmaOptions options = cma_options();
  save_checkpoint(folder / "cma", kProblem, ranges(), options, start_cma(ranges(), options));
  const auto load_with = [&](const std::function<void(std::string&, std::vector<SearchParameter>&,
                                                      CmaOptions&)>& change) {
    return [&, change] {
      std::string problem = kProblem;
      std::vector<SearchParameter> parameters = ranges();
      CmaOptions changed = options;
      change(problem, parameters, changed);
      load_cma_checkpoint(folder / "cma", problem, parameters, changed);
    };
  };
  const auto refused = [&](const std::string& beginning, const auto& change) {
    expect_refused(folder, beginning, load_with(change));
  };

  refused(
      "cma:2: belongs to a search with `problem rastrigin, unit metres`; this search has "
      "`problem towel`; give what it was started with, or another file",
      [](auto& problem, auto&, auto&) { problem = "towel"; });
  refused(
      "cma:4: belongs to a search with `option population 0`; this search has `option "
      "population 10`",
      [](auto&, auto&, auto& o) { o.population = 10; });
  refused("cma:5: belongs", [](auto&, auto&, auto& o) { o.initial_step = 0.2; });
  refused("cma:6: belongs", [](auto&, auto&, auto& o) { o.growth = 2; });
  refused("cma:7: belongs", [](auto&, auto&, auto& o) { o.cost_tolerance = 0; });
  refused("cma:8: belongs", [](auto&, auto&, auto& o) { o.step_tolerance = 0; });
  refused("cma:9: belongs", [](auto&, auto&, auto& o) { o.seed = 2; });
  refused("cma:10: belongs", [](auto&, auto& p, auto&) { p[0].name = "stiffness"; });
  refused("cma:11: belongs", [](auto&, auto& p, auto&) { p[1].lower = -5.0000000000000009; });
  refused("cma:12: belongs", [](auto&, auto& p, auto&) { p[2].upper = 6; });
  refused("cma:10: belongs", [](auto&, auto& p, auto&) { p[0].log_scale = false; });
  refused("cma:12: belongs", [](auto&, auto& p, auto&) { p.pop_back(); });
  refused("cma:13: belongs", [](auto&, auto& p, auto&) { p.push_back({.name = "d"}); });
  expect_refused(folder, "cma:3: belongs to a search with `method cma_es`", [&] {
    load_evolution_checkpoint(folder / "cma", kProblem, ranges(), evolution_options());
  });
  expect_refused(folder, "none: there is no such file",
                 [&] { load_cma_checkpoint(folder / "none", kProblem, ranges(), options); });

  // Rules that end the search may change.
  EXPECT_NO_THROW(load_with([](auto&, auto&, auto& o) {
    o.restarts = 20;
    o.most_evaluations = 7;
    o.cost_below = 1;
  })());

  const EvolutionOptions evolution = evolution_options();
  save_checkpoint(folder / "evolution", kProblem, ranges(), evolution,
                  first_generation(ranges(), evolution, bumpy));
  const auto evolution_refused = [&](const std::string& beginning, const auto& change) {
    expect_refused(folder, beginning, [&] {
      EvolutionOptions changed = evolution;
      change(changed);
      load_evolution_checkpoint(folder / "evolution", kProblem, ranges(), changed);
    });
  };
  evolution_refused("evolution:4: belongs", [](auto& o) { o.population = 21; });
  evolution_refused("evolution:5: belongs", [](auto& o) { o.kept = 0.4; });
  evolution_refused("evolution:6: belongs", [](auto& o) { o.mutated = 0.3; });
  evolution_refused("evolution:7: belongs", [](auto& o) { o.mutation_parents = 0.5; });
  evolution_refused("evolution:8: belongs", [](auto& o) { o.mutation = MutationLaw::redraw; });
  evolution_refused("evolution:9: belongs", [](auto& o) { o.mutation_step = 0.2; });
  evolution_refused("evolution:10: belongs", [](auto& o) { o.seed = 13; });
}

/// Returns both kinds of checkpoint, small ones.
std::vector<std::pair<std::string, std::function<void()>>> small_checkpoints(
    const TemporaryFolder& folder) {
  EvolutionOptions evolution = evolution_options();
  evolution.population = 3;
  EvolutionState population = first_generation(ranges(), evolution, bumpy);
  population = next_generation(ranges(), evolution, bumpy, population);
  save_checkpoint(folder / "evolution", kProblem, ranges(), evolution, population);
  const CmaOptions cma = cma_options();
  CmaState state = start_cma(ranges(), cma);
  state = next_cma_generation(ranges(), cma, bumpy, state);
  state.optima = {state.so_far, {.end = CmaEnd::nothing_finite}};
  save_checkpoint(folder / "cma", kProblem, ranges(), cma, state);
  return {{"evolution",
           [&folder, evolution] {
             load_evolution_checkpoint(folder / "damaged", kProblem, ranges(), evolution);
           }},
          {"cma",
           [&folder, cma] { load_cma_checkpoint(folder / "damaged", kProblem, ranges(), cma); }}};
}

/// Returns the text of a checkpoint with another line in one place and the checksums for it.
std::string with_line(const std::string& text, const std::string& name, const std::string& line) {
  std::istringstream lines(text);
  std::string result, old;
  std::uint64_t sum = kEmptyChecksum;
  while (std::getline(lines, old)) {
    old.resize(old.size() - 17);  // a blank and the checksum
    const std::string& taken = old.starts_with(name + " ") ? line : old;
    sum = checksum("\n", checksum(taken, sum));
    result += fmt::format("{} {:016x}\n", taken, sum);
  }
  return result;
}

TEST(SearchCheckpoint, RefusesAnotherVersionOfTheProgramByName) {
  const TemporaryFolder folder;
  const auto [name, load_damaged] = small_checkpoints(folder).back();
  const std::string whole = read_text(folder / name);
  folder.write("damaged", with_line(whole, "step", "step 0.25"));
  ASSERT_NO_THROW(load_damaged());

  folder.write("damaged", with_line(whole, "program", "program clothfit 0.0.1, glibc 2.36"));
  expect_refused(folder, "damaged:13: belongs to a search with `program clothfit 0.0.1, ",
                 load_damaged);
}

TEST(SearchCheckpoint, RefusesCountsThatNoSearchReaches) {
  const TemporaryFolder folder;
  const auto [name, load_damaged] = small_checkpoints(folder).back();
  const std::string whole = read_text(folder / name);
  for (const std::string line :
       {"population 3", "population 2147483647", "generation 2", "generation -1",
        "evaluations 9223372036854775807", "optima 18446744073709551615"}) {
    SCOPED_TRACE(line);
    folder.write("damaged", with_line(whole, line.substr(0, line.find(' ')), line));
    EXPECT_THROW(load_damaged(), InputError);
  }
}

TEST(SearchCheckpoint, NamesTheLineOfAnyChangedBit) {
  const TemporaryFolder folder;
  for (const auto& [name, load_damaged] : small_checkpoints(folder)) {
    const std::string whole = read_text(folder / name);
    folder.write("damaged", whole);
    ASSERT_NO_THROW(load_damaged());

    int line = 1;
    for (size_t at = 0; at < whole.size(); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        SCOPED_TRACE(testing::Message() << name << ", byte " << at << ", bit " << bit);
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
        folder.write("damaged", damaged);
        expect_refused(folder, "damaged:" + std::to_string(line) + ": ", load_damaged);
      }
      if (whole[at] == '\n') ++line;
    }
  }
}

TEST(SearchCheckpoint, NamesTheLineWhereAFileWasCutSwappedOrGoesOn) {
  const TemporaryFolder folder;
  for (const auto& [name, load_damaged] : small_checkpoints(folder)) {
    SCOPED_TRACE(name);
    const std::string whole = read_text(folder / name);
    std::vector<std::string> lines;
    for (size_t begin = 0; begin < whole.size();) {
      const size_t end = whole.find('\n', begin) + 1;
      lines.push_back(whole.substr(begin, end - begin));
      begin = end;
    }
    const auto line_name = [](size_t k) { return "damaged:" + std::to_string(k + 1) + ": "; };

    int line = 1;
    for (size_t size = 20; size < whole.size(); ++size) {
      if (whole[size - 1] == '\n') ++line;
      folder.write("damaged", whole.substr(0, size));
      expect_refused(folder, size < lines[0].size() ? "damaged:1: " : line_name(line - 1u),
                     load_damaged);
    }
    for (size_t k = 1; k + 1 < lines.size(); ++k) {
      std::string dropped, twice, swapped;
      for (size_t i = 0; i < lines.size(); ++i) {
        dropped += i == k ? "" : lines[i];
        twice += i == k ? lines[i] + lines[i] : lines[i];
        swapped += i == k ? lines[i + 1] : i == k + 1 ? lines[k] : lines[i];
      }
      folder.write("damaged", dropped);
      expect_refused(folder, line_name(k) + "does not match its checksum", load_damaged);
      folder.write("damaged", twice);
      expect_refused(folder, line_name(k + 1) + "does not match its checksum", load_damaged);
      folder.write("damaged", swapped);
      expect_refused(folder, line_name(k) + "does not match its checksum", load_damaged);
    }
    folder.write("damaged", whole + "\n");
    expect_refused(folder, line_name(lines.size()) + "the file goes on after its end; nothing",
                   load_damaged);
    folder.write("damaged", "");
    expect_refused(folder, "damaged:1: is no checkpoint of a search", load_damaged);
    folder.write("damaged", "clothfit-search/3 0\n");
    expect_refused(folder, "damaged:1: is a checkpoint of version `clothfit-search/3`",
                   load_damaged);
  }
}

TEST(SearchCheckpoint, LeavesTheOlderOneWhenItCannotBeWritten) {
  // Given a system that lets files grow to 100 bytes,
  const TemporaryFolder folder;
  const CmaState start = start_cma(ranges(), {});
  save_checkpoint(folder / "search", kProblem, ranges(), CmaOptions{}, start);
  const std::string before = read_text(folder / "search");
  const auto earlier_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit whole{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &whole), 0);
  rlimit little = whole;
  little.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);

  CmaState later = start;
  later.evaluations = 99;
  EXPECT_THROW(save_checkpoint(folder / "search", kProblem, ranges(), CmaOptions{}, later),
               InputError);

  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &whole), 0);
  std::signal(SIGXFSZ, earlier_handler);
  EXPECT_EQ(read_text(folder / "search"), before);
  save_checkpoint(folder / "search", kProblem, ranges(), CmaOptions{}, later);
  EXPECT_EQ(load_cma_checkpoint(folder / "search", kProblem, ranges(), {}).evaluations, 99);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    EXPECT_EQ(entry.path().filename(), "search");
}

}  // namespace
}  // namespace clothfit
