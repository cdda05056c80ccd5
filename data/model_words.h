#pragma once

#include "data/model_description.h"
#include "data/recording_words.h"

namespace clothfit {

/// The words that a model file has for each choice. Inside data/ only.
inline constexpr const char* kModelFormat = "clothfit-model/1";

inline Words<HeldMotion> model_motion_words() {
  return {{"fixed", HeldMotion::fixed}, {"path", HeldMotion::path}};
}

inline Words<StartKind> model_start_words() {
  return {{"at_rest", StartKind::at_rest},
          {"released_flat", StartKind::released_flat},
          {"in_motion", StartKind::unknown}};
}

inline Words<StrainLimitKind> strain_limit_words() {
  return {{"off", StrainLimitKind::off},
          {"positions", StrainLimitKind::positions},
          {"rates_first", StrainLimitKind::rates_first},
          {"consistent", StrainLimitKind::consistent}};
}

}  // namespace clothfit
