#include "apps/version.h"

namespace clothfit {

const char* program_version() {
  return CLOTHFIT_VERSION;
}

}  // namespace clothfit
