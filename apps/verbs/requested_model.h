#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/terminal/grid_size.h"
#include "data/model_description.h"
#include "data/progress.h"

namespace clothfit {

/// The request to `clothfit simulate`.
struct ModelRequest {
  std::filesystem::path input;   ///< a recording, a model file or a folder with one; may be empty
  std::filesystem::path fit;     ///< fit.json or its folder; may be empty
  std::filesystem::path model;   ///< model file whose fabric and effects are taken; may be empty
  std::vector<std::string> set;  ///< NAME=NUMBER, NAME of the springs or EFFECT.PARAMETER
  std::optional<GridSize> mesh;
  std::optional<double> duration_s;
  std::optional<double> frame_rate_hz;
  bool allow_outside = false;  ///< as in typed_recording
};

/// Returns NAME and NUMBER of an assignment; nothing where the text is none.
std::optional<std::pair<std::string, double>> parse_assignment(const std::string& text);

/// Returns the name of the model or recording that is asked for. Throws InputError.
std::string requested_name(const ModelRequest& request);

/// Returns the model with every number. It is that of a model file or of a fit (`model.yaml` in its
/// folder), or a recording's cloth, held points, start and frames. The parameters are those of
/// `fit`, `model` and `set`, each taking the place of what was known before. A model's own time
/// step holds for its own springs and mesh only. Steps that a recording lacks are run and kept
/// under `steps`. Throws InputError, also where a parameter is given by nobody.
ModelDescription requested_model(const ModelRequest& request, const std::filesystem::path& steps,
                                 const ProgressCallback& progress);

}  // namespace clothfit
