#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace clothfit {

/// Errors that others have stated for recordings, by the recordings' names. They are root mean
/// squares of the distance, m, with the weights and over the frames of the study's own weighted
/// error.
using PublishedErrors = std::map<std::string, double>;

/// Reads a table with the columns recording, weighted_rms_m (> 0). Throws InputError.
PublishedErrors read_published_errors(const std::filesystem::path& file);

}  // namespace clothfit
