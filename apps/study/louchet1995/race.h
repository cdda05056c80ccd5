#pragma once

#include <array>
#include <vector>

#include "apps/study/louchet1995/paper_problem.h"

namespace clothfit {

/// Searches side by side on the small cost.
enum class Racer { strategy_5, strategy_18, strategy_18_large, cma_5, cma_18 };
inline constexpr std::array kRacers{Racer::strategy_5, Racer::strategy_18, Racer::strategy_18_large,
                                    Racer::cma_5, Racer::cma_18};
std::string to_string(Racer racer);
SpringSet parameters_of(Racer racer);

/// Relative costs whose first passing is noted.
inline constexpr std::array kRaceMarks{1e-1, 1e-2, 1e-3, 1e-4, 1e-5};

/// The decrease of a search's best cost. Costs are relative to the median cost of 100 random
/// individuals of the same problem.
struct Race {
  std::vector<long> evaluations;      ///< at the end of a generation, thinned out
  std::vector<double> relative_cost;  ///< the best until then
  /// Generation that reached each of kRaceMarks; -1: not within the race.
  std::array<int, kRaceMarks.size()> generations{};
  std::array<long, kRaceMarks.size()> costs_asked{};
};

/// Returns how many evaluations a racer has. The large strategy has as much more as its population
/// is larger.
long race_length(Racer racer, bool quick);

Race race(const PaperExperiment& experiment, const RecordedStates& states, Racer racer,
          unsigned long long seed, bool quick);

}  // namespace clothfit
