#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fit/search/cma_es.h"
#include "fit/search/evolutionary_strategy.h"

namespace clothfit {

/// A search on disk, between two generations: it goes on from there to the same bits as if it had
/// not stopped. Save from the search's `after_generation`, at each generation or every so many.
///
/// The file holds what must be the same when it is read: the method, `problem` (one line, the
/// caller's, that names all that determines the costs), the options that determine the generations,
/// and names and ranges of the parameters. Rules that end the whole search (generations, restarts,
/// evaluations, a cost that is low enough, no gain) may change, so that a search can be prolonged;
/// populations that CMA-ES made smaller to stay within the evaluations are then not made larger.
///
/// Text, one thing a line; every line ends with the checksum of the file up to there. Numbers are
/// written as the shortest decimals that read back as the same bits, infinities included.
///
/// Saving replaces the file in one step and throws InputError when it cannot be written. Loading
/// throws InputError, with the line, for any damage and for anything that is not the same.
void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters,
                     const EvolutionOptions& options, const EvolutionState& state);
void save_checkpoint(const std::filesystem::path& file, const std::string& problem,
                     const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                     const CmaState& state);

/// For `resume_evolution`.
EvolutionState load_evolution_checkpoint(const std::filesystem::path& file,
                                         const std::string& problem,
                                         const std::vector<SearchParameter>& parameters,
                                         const EvolutionOptions& options);
/// For `search_by_cma`.
CmaState load_cma_checkpoint(const std::filesystem::path& file, const std::string& problem,
                             const std::vector<SearchParameter>& parameters,
                             const CmaOptions& options);

}  // namespace clothfit
