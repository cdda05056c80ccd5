#pragma once

#include <filesystem>
#include <string>

#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// Writes diagnosis.json (docs/formats.md, format clothfit-diagnosis/1). `command` is as in
/// fit.json.
void write_diagnosis(const Diagnosis& diagnosis, const std::string& command,
                     const std::filesystem::path& file);

}  // namespace clothfit
