#pragma once

namespace clothfit {

/// Returns "0.1.0", as the build has it.
const char* program_version();

}  // namespace clothfit
