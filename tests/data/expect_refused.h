#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"

namespace clothfit {

/// Expects `call` to throw an InputError whose text is or starts with `beginning`: file, line and
/// what is wrong. The path of the temporary folder is left out.
template <class Call>
void expect_refused(const TemporaryFolder& folder, const std::string& beginning, const Call& call) {
  SCOPED_TRACE(beginning);
  try {
    call();
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    std::string text = error.what();
    const std::string prefix = folder.path().string() + "/";
    if (text.starts_with(prefix)) text.erase(0, prefix.size());
    EXPECT_THAT(text, testing::StartsWith(beginning));
    EXPECT_THAT(text, testing::HasSubstr("; ")) << "says what was expected";
  }
}

}  // namespace clothfit
