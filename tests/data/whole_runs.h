#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

/// Leaves a test out that takes half a minute or more, unless CLOTHFIT_WHOLE asks for it.
#define CLOTHFIT_ONLY_IN_WHOLE_RUNS()           \
  if (std::getenv("CLOTHFIT_WHOLE") == nullptr) \
  GTEST_SKIP() << "takes half a minute; CLOTHFIT_WHOLE=1 runs it"
