#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fit/search/cma_es.h"
#include "fit/search/evolutionary_strategy.h"

namespace clothfit {

/// Saves a search between two generations, so that it goes on to the same bits as if it had not
/// stopped. Save from the search's `after_generation`, at each generation or every so many.
///
/// The file holds the properties that must be the same when it is read. These are the program's
/// version and arithmetic (fit/jobs/arithmetic.h), the method, `problem`, the options that
/// determine the generations, and names and ranges of the parameters. `problem` is one line of the
/// caller's that names all that determines the costs. Rules that end the whole search (generations,
/// restarts, evaluations, a cost that is low enough, no gain) may change, so that a search can be
/// prolonged. Populations that CMA-ES made smaller to stay within the evaluations are then not made
/// larger.
///
/// The file is text, one thing a line; every line ends with the checksum of the file up to there.
/// Numbers are written as the shortest decimals that read back as the same bits, infinities
/// included.
///
/// Saving replaces the file in one step and throws InputError when it cannot be written. Loading
/// throws InputError, with the line, for any damage and for any property that differs.
void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters,
                     const EvolutionOptions& options, const EvolutionState& state);
void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                     const CmaState& state);

/// Loads a state for `resume_evolution`.
EvolutionState load_evolution_checkpoint(const std::filesystem::path& file,
                                         const std::string& problem,
                                         const std::vector<SearchParameter>& parameters,
                                         const EvolutionOptions& options);
/// Loads a state for `search_by_cma`.
CmaState load_cma_checkpoint(const std::filesystem::path& file, const std::string& problem,
                             const std::vector<SearchParameter>& parameters,
                             const CmaOptions& options);

}  // namespace clothfit
