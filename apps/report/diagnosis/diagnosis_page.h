#pragma once

#include <span>
#include <string>

#include "data/recording.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// Returns the diagnosis in one sentence, for the terminal and the head of the page.
std::string diagnosis_sentence(const Diagnosis& diagnosis);

/// Says that a diagnosis ended before it had tried all, and what it had not.
std::string incomplete_text(const Diagnosis& diagnosis);

/// Writes the page. It says what was missing and how we know, shows errors before and after with
/// maps side by side, and says what was refused and what would have been seen. `recordings` are as
/// the diagnosis has them, `command` as in diagnosis.json.
std::string diagnosis_page_html(const Diagnosis& diagnosis, std::span<const Recording> recordings,
                                const std::string& command);

}  // namespace clothfit
