#pragma once

#include <string>

#include "apps/study/trials/undeclared_trial.h"

namespace clothfit {

/// Write a trial as its journal keeps it, and read it back to the last bit.
std::string payload_of(const UndeclaredTrial& trial);
UndeclaredTrial undeclared_trial_of(const std::string& payload);

}  // namespace clothfit
