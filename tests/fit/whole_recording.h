#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "fit/fit.h"

namespace clothfit {

/// A recording with all of its tracks and cameras.
FitInput whole_recording(const std::filesystem::path& folder);

/// One that comes with the sources.
FitInput bundled_recording(const std::string& name);

/// What was simulated for it.
nlohmann::json bundled_truth(const std::string& name);

/// The folder of further recordings that CLOTHFIT_DATA names; empty where it names none.
std::filesystem::path further_data();

}  // namespace clothfit
