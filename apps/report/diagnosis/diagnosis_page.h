#pragma once

#include <span>
#include <string>

#include "data/recording.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// The diagnosis in one sentence, for the terminal and the head of the page.
std::string diagnosis_sentence(const Diagnosis& diagnosis);

/// The page: what was missing, how we know, errors before and after with maps side by side, what
/// was refused, what would have been seen. `recordings` as the diagnosis has them. `command` as
/// diagnosis.json keeps it.
std::string diagnosis_page_html(const Diagnosis& diagnosis, std::span<const Recording> recordings,
                                const std::string& command);

}  // namespace clothfit
