#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "fit/fit.h"

namespace clothfit {

/// Reads a recording with all of its tracks and cameras.
FitInput whole_recording(const std::filesystem::path& folder);

/// Reads one that comes with the sources.
FitInput bundled_recording(const std::string& name);

/// Reads the numbers with which it was simulated.
nlohmann::json bundled_truth(const std::string& name);

/// Returns the folder of further recordings that CLOTHFIT_DATA names; empty where it names none.
std::filesystem::path further_data();

}  // namespace clothfit
