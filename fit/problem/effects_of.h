#pragma once

#include <string>
#include <vector>

#include "data/recording.h"
#include "fit/interface/hypothesis.h"
#include "model/cloth/effect.h"

namespace clothfit {

/// Returns the description of an effect of motion or of the measurement. Throws InputError for an
/// unknown name.
EffectDescription describe_effect(const std::string& name);

/// Returns the effects of a recording with hypotheses beside them. Two modes of one effect are that
/// effect with the parameters of both. A shape that they share is the last one's, and is fitted if
/// either fits it.
std::vector<DeclaredEffect> effects_of(const Recording& recording,
                                       const std::vector<Hypothesis>& hypotheses);

}  // namespace clothfit
