#pragma once

#include <span>
#include <string>

#include "fit/diagnosis/diagnose_options.h"
#include "fit/diagnosis/search.h"
#include "fit/interface/fit_input.h"
#include "fit/interface/fit_report.h"

namespace clothfit {

/// Ends a diagnosis that does not work out. diagnose() catches it; it never leaves diagnose().
struct GivenUp {
  FitStop stop = FitStop::diverged;
  std::string message;
};

/// The fitted recordings under one set of options.
struct Analysis {
  Analysis(std::span<const FitInput> inputs, const DiagnoseOptions& asked, FitOptions fit_options)
      : diagnosis(asked),
        options(std::move(fit_options)),
        setup{.inputs = inputs, .options = options} {}
  Analysis(const Analysis&) = delete;
  Analysis& operator=(const Analysis&) = delete;

  const DiagnoseOptions& diagnosis;
  const FitOptions options;  ///< those of the diagnosis, or with constants of the markers
  DiagnosisSetup setup;      ///< on the mesh that is analysed
  FitReport first;           ///< a fit of the first recording alone, on its own mesh
  FittedModel base;          ///< the model as declared
  SearchOptions search;
  SearchResult found;

  bool is_on_own_mesh() const {
    return setup.columns == first.result.mesh_columns && setup.rows == first.result.mesh_rows;
  }
};

/// Returns the sigmas beyond which residuals count less (Huber). They are infinite for squares.
double huber_threshold(const FittedModel& model, Loss loss);

/// Searches for hypotheses from the base model. Where the search moved that model, `base` follows.
/// `clock` is told of the phases, or null.
void search_for_effects(Analysis& analysis, const ProgressCallback& progress, PhaseClock* clock);

}  // namespace clothfit
