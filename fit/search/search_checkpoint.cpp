#include "fit/search/search_checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <type_traits>
#include <utility>

#include "data/input_error.h"
#include "data/program_version.h"
#include "data/reading.h"
#include "data/replace_text.h"
#include "data/shown_text.h"
#include "data/text_file.h"
#include "fit/jobs/arithmetic.h"
#include "fit/jobs/checksum.h"
#include "fit/jobs/shown_difference.h"

namespace clothfit {
namespace {

constexpr std::string_view kFormat = "clothfit-search/";
constexpr std::string_view kVersionLine = "clothfit-search/2";
constexpr const char* kDamageRemedy = "take an older copy, or remove it and start from scratch";

template <class Enum, size_t count>
using Words = std::array<std::pair<std::string_view, Enum>, count>;

constexpr Words<Origin, 5> kOrigins = {{{"random", Origin::random},
                                        {"given", Origin::given},
                                        {"kept", Origin::kept},
                                        {"mutated", Origin::mutated},
                                        {"crossed", Origin::crossed}}};
constexpr Words<CmaEnd, 5> kEnds = {{{"costs_equal", CmaEnd::costs_equal},
                                     {"steps_small", CmaEnd::steps_small},
                                     {"ill_conditioned", CmaEnd::ill_conditioned},
                                     {"too_long", CmaEnd::too_long},
                                     {"nothing_finite", CmaEnd::nothing_finite}}};
constexpr Words<MutationLaw, 2> kMutationLaws = {
    {{"redraw", MutationLaw::redraw}, {"gaussian", MutationLaw::gaussian}}};

template <class Enum, size_t count>
std::string_view word_of(Enum value, const Words<Enum, count>& words) {
  const auto found = std::ranges::find(words, value, &std::pair<std::string_view, Enum>::second);
  assert(found != words.end());
  return found->first;
}

/// Returns the end of a line: the checksum of all lines up to it.
std::string line_end(std::uint64_t sum) {
  return fmt::format(" {:016x}", sum);
}

std::uint64_t line_sum(std::string_view line, std::uint64_t before) {
  return checksum("\n", checksum(line, before));
}

class LineWriter {
 public:
  /// Writes one line: the words, separated by spaces.
  template <class... Parts>
  void line(const Parts&... parts) {
    std::string line;
    (append(line, parts), ...);
    line.pop_back();
    assert(line.find('\n') == std::string::npos);
    sum_ = line_sum(line, sum_);
    text_ += line + line_end(sum_) + "\n";
  }
  const std::string& text() const { return text_; }

 private:
  template <class Part>
  static void append(std::string& line, const Part& part) {
    line += fmt::format("{} ", part);
  }
  template <class Number>
  static void append(std::string& line, const std::vector<Number>& numbers) {
    for (const Number& number : numbers) append(line, number);
  }
  static void append(std::string& line, const Eigen::VectorXd& numbers) {
    for (const double number : numbers) append(line, number);
  }

  std::string text_;
  std::uint64_t sum_ = kEmptyChecksum;
};

/// The words of one line of a checkpoint, taken one after another.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file)
      : file_(file.string()), text_(read_text(file)), rest_(text_) {
    if (!rest_.starts_with(kFormat))
      throw InputError(file_, 1, "is no checkpoint of a search",
                       fmt::format("`{}` in the first line", kVersionLine), "name another file");
    const std::string_view version = rest_.substr(0, rest_.find_first_of(" \n"));
    if (version != kVersionLine)
      throw InputError(file_, 1,
                       fmt::format("is a checkpoint of version `{}`", shown_text(version)),
                       fmt::format("`{}`", kVersionLine), "remove it and start from scratch");
  }

  /// Returns the whole next line, without its checksum.
  std::string_view line() {
    ++number_;
    const size_t end = rest_.find('\n');
    if (end == std::string_view::npos) refuse("the file ends too early", "a line `end`");
    std::string_view line = rest_.substr(0, end);
    const size_t sum_size = line_end(0).size();
    const std::string_view sum = line.substr(line.size() - std::min(line.size(), sum_size));
    line.remove_suffix(sum.size());
    sum_ = line_sum(line, sum_);
    if (sum != line_end(sum_))
      refuse("does not match its checksum", "the line that the search wrote");
    rest_.remove_prefix(end + 1);
    words_ = line;
    return line;
  }

  /// Goes to the next line, which begins with `name`.
  void begin(std::string_view name) {
    line();
    if (word() != name) refuse_content(fmt::format("a line `{}`", name));
  }

  template <class Number>
  Number number() {
    const std::string_view text = word();
    Number value{};
    const auto [stopped_at, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stopped_at != text.data() + text.size())
      refuse_content(std::is_integral_v<Number> ? "a whole number" : "a number");
    return value;
  }

  template <class Number>
  std::vector<Number> numbers_left() {
    std::vector<Number> numbers;
    while (!words_.empty()) numbers.push_back(number<Number>());
    return numbers;
  }

  Eigen::VectorXd vector(Eigen::Index size) {
    Eigen::VectorXd values(size);
    for (double& value : values) value = number<double>();
    return values;
  }

  template <class Enum, size_t count>
  Enum choice(const Words<Enum, count>& words) {
    const std::string_view text = word();
    for (const auto& [word, value] : words)
      if (word == text) return value;
    refuse_content("a known word");
  }

  bool at_end_of_line() const { return words_.empty(); }
  void require_end_of_line() const {
    if (!words_.empty()) refuse_content("fewer words");
  }
  void require(bool good, const std::string& expected) const {
    if (!good) refuse_content(expected);
  }

  void end() {
    begin("end");
    require_end_of_line();
    ++number_;
    if (!rest_.empty()) refuse("the file goes on after its end", "nothing");
  }

  [[noreturn]] void refuse(const std::string& problem, const std::string& expected,
                           const std::string& remedy = kDamageRemedy) const {
    throw InputError(file_, number_, problem, expected, remedy);
  }

 private:
  [[noreturn]] void refuse_content(const std::string& expected) const {
    refuse("does not fit this search", expected);
  }

  std::string_view word() {
    const size_t space = std::min(words_.find(' '), words_.size());
    const std::string_view word = words_.substr(0, space);
    words_.remove_prefix(std::min(space + 1, words_.size()));
    return word;
  }

  std::string file_;
  std::string text_;
  std::string_view rest_;   ///< lines to come
  std::string_view words_;  ///< of the line at hand, still to come
  std::uint64_t sum_ = kEmptyChecksum;
  int number_ = 0;
};

using Lines = std::vector<std::string>;

template <class Value>
std::string option_line(const char* name, const Value& value) {
  return fmt::format("option {} {}", name, value);
}

/// Returns the properties that must be the same for a search to go on; the stopping rules need not.
Lines lines_of(const EvolutionOptions& options) {
  return {"method evolutionary_strategy",
          option_line("population", options.population),
          option_line("kept", options.kept),
          option_line("mutated", options.mutated),
          option_line("mutation_parents", options.mutation_parents),
          option_line("mutation", word_of(options.mutation, kMutationLaws)),
          option_line("mutation_step", options.mutation_step),
          option_line("seed", options.seed)};
}

Lines lines_of(const CmaOptions& options) {
  return {"method cma_es",
          option_line("population", options.population),
          option_line("initial_step", options.initial_step),
          option_line("growth", options.growth),
          option_line("cost_tolerance", options.cost_tolerance),
          option_line("step_tolerance", options.step_tolerance),
          option_line("seed", options.seed)};
}

template <class Options>
Lines header_lines(const std::string& problem, const std::vector<SearchParameter>& parameters,
                   const Options& options) {
  Lines lines = {std::string(kVersionLine), "problem " + problem};
  std::ranges::move(lines_of(options), std::back_inserter(lines));
  for (const SearchParameter& parameter : parameters)
    lines.push_back(fmt::format("parameter {} {} {} {}", parameter.lower, parameter.upper,
                                parameter.log_scale ? "logarithmic" : "linear", parameter.name));
  lines.push_back(fmt::format("program clothfit {}, {}", program_version(), arithmetic_name()));
  lines.push_back("state");
  return lines;
}

/// Reads the header and refuses one of another search.
void require_header(const Lines& expected, LineReader& reader) {
  for (const std::string& line : expected) {
    const std::string found(reader.line());
    if (found == line) continue;
    const bool is_program = line.starts_with("program ");
    reader.refuse(fmt::format("belongs to a search with `{}`", shown_difference(found, line)),
                  fmt::format("this search has `{}`", shown_difference(line, found)),
                  is_program
                      ? "go on with that version on such a processor, or remove it and start "
                        "from scratch"
                      : "give what it was started with, or another file");
  }
}

/// Refuses a count that no search reaches and that sums could carry beyond the type's range.
void require_evaluations(long count, const LineReader& reader) {
  constexpr long kMostEvaluations = 1'000'000'000'000'000;
  reader.require(count >= 0 && count <= kMostEvaluations,
                 fmt::format("0 to {} evaluations", kMostEvaluations));
}

void write_state(const EvolutionState& state, LineWriter& writer) {
  assert(!state.population.empty());
  writer.line("evaluations", state.evaluations);
  writer.line("best_cost", state.best_cost);
  for (const Individual& individual : state.population)
    writer.line("individual", word_of(individual.origin, kOrigins), individual.cost,
                individual.values, individual.parent_ranks);
}

EvolutionState read_state(Eigen::Index parameters, const EvolutionOptions& options,
                          LineReader& reader) {
  EvolutionState state;
  reader.begin("evaluations");
  state.evaluations = reader.number<long>();
  require_evaluations(state.evaluations, reader);
  reader.require_end_of_line();
  reader.begin("best_cost");
  state.best_cost = reader.numbers_left<double>();
  reader.require(!state.best_cost.empty(), "the best cost of each generation");
  for (int rank = 0; rank < options.population; ++rank) {
    reader.begin("individual");
    Individual& individual = state.population.emplace_back();
    individual.origin = reader.choice(kOrigins);
    individual.cost = reader.number<double>();
    individual.values = reader.vector(parameters);
    individual.parent_ranks = reader.numbers_left<int>();
  }
  return state;
}

void write_optimum(const CmaOptimum& optimum, LineWriter& writer) {
  writer.line("optimum", word_of(optimum.end, kEnds), optimum.evaluations, optimum.cost,
              optimum.values);
}

CmaOptimum read_optimum(Eigen::Index parameters, LineReader& reader) {
  reader.begin("optimum");
  CmaOptimum optimum;
  optimum.end = reader.choice(kEnds);
  optimum.evaluations = reader.number<long>();
  require_evaluations(optimum.evaluations, reader);
  optimum.cost = reader.number<double>();
  // A run without a finite cost has no best values.
  if (!reader.at_end_of_line()) optimum.values = reader.vector(parameters);
  reader.require_end_of_line();
  return optimum;
}

void write_state(const CmaState& state, LineWriter& writer) {
  writer.line("evaluations", state.evaluations);
  writer.line("best_cost", state.best_cost);
  writer.line("optima", state.optima.size());
  for (const CmaOptimum& optimum : state.optima) write_optimum(optimum, writer);
  writer.line("population", state.population);
  writer.line("generation", state.generation);
  writer.line("step", state.step);
  writer.line("mean", state.mean);
  writer.line("covariance_path", state.covariance_path);
  writer.line("step_path", state.step_path);
  for (Eigen::Index row = 0; row < state.covariance.rows(); ++row)
    writer.line("covariance", Eigen::VectorXd(state.covariance.row(row)));
  writer.line("recent_best", state.recent_best);
  write_optimum(state.so_far, writer);
}

CmaState read_state(Eigen::Index parameters, const CmaOptions&, LineReader& reader) {
  CmaState state;
  const auto number = [&]<class Number>(std::string_view name, Number& value) {
    reader.begin(name);
    value = reader.number<Number>();
    reader.require_end_of_line();
  };
  const auto vector = [&](std::string_view name) {
    reader.begin(name);
    Eigen::VectorXd values = reader.vector(parameters);
    reader.require_end_of_line();
    return values;
  };
  const auto series = [&](std::string_view name) {
    reader.begin(name);
    return reader.numbers_left<double>();
  };
  number("evaluations", state.evaluations);
  require_evaluations(state.evaluations, reader);
  state.best_cost = series("best_cost");
  size_t optima = 0;
  number("optima", optima);
  for (size_t run = 0; run < optima; ++run)
    state.optima.push_back(read_optimum(parameters, reader));
  number("population", state.population);
  reader.require(state.population >= 4 && state.population <= kLargestCmaPopulation,
                 fmt::format("4 to {} individuals", kLargestCmaPopulation));
  number("generation", state.generation);
  reader.require(state.generation >= 0 && state.generation <= state.generations(),
                 "no more generations than best costs");
  number("step", state.step);
  state.mean = vector("mean");
  state.covariance_path = vector("covariance_path");
  state.step_path = vector("step_path");
  state.covariance.resize(parameters, parameters);
  for (Eigen::Index row = 0; row < parameters; ++row)
    state.covariance.row(row) = vector("covariance").transpose();
  state.recent_best = series("recent_best");
  state.so_far = read_optimum(parameters, reader);
  return state;
}

template <class Options, class State>
void save(const std::filesystem::path& file, const std::string& problem,
          const std::vector<SearchParameter>& parameters, const Options& options,
          const State& state) {
  LineWriter writer;
  for (const std::string& line : header_lines(problem, parameters, options)) writer.line(line);
  write_state(state, writer);
  writer.line("end");
  replace_text(writer.text(), file);
}

template <class Options>
auto load(const std::filesystem::path& file, const std::string& problem,
          const std::vector<SearchParameter>& parameters, const Options& options) {
  LineReader reader(file);
  require_header(header_lines(problem, parameters, options), reader);
  auto state = read_state(static_cast<Eigen::Index>(parameters.size()), options, reader);
  reader.end();
  return state;
}

}  // namespace

void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters,
                     const EvolutionOptions& options, const EvolutionState& state) {
  save(file, problem, parameters, options, state);
}

void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                     const CmaState& state) {
  save(file, problem, parameters, options, state);
}

EvolutionState load_evolution_checkpoint(const std::filesystem::path& file,
                                         const std::string& problem,
                                         const std::vector<SearchParameter>& parameters,
                                         const EvolutionOptions& options) {
  return reading(file, [&] { return load(file, problem, parameters, options); });
}

CmaState load_cma_checkpoint(const std::filesystem::path& file, const std::string& problem,
                             const std::vector<SearchParameter>& parameters,
                             const CmaOptions& options) {
  return reading(file, [&] { return load(file, problem, parameters, options); });
}

}  // namespace clothfit
