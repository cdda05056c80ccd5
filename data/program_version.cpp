#include "data/program_version.h"

namespace clothfit {

const char* program_version() {
  return CLOTHFIT_VERSION;
}

}  // namespace clothfit
