// Checks the words only. Their users, with file and line, are in recording_test.cpp.

#include "data/nearest_name.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

TEST(KnownNames, NameTheNearestOneFirst) {
  EXPECT_EQ(known_names("row", {"columns", "rows"}),
            "did you mean `rows`? known are `columns`, `rows`");
  EXPECT_EQ(known_names("sigam", {"sigma", "status"}),
            "did you mean `sigma`? known are `sigma`, `status`");
  EXPECT_EQ(known_names("colmuns", {"columns", "rows"}),
            "did you mean `columns`? known are `columns`, `rows`");
}

TEST(KnownNames, GuessNothingWhereNothingIsNear) {
  EXPECT_EQ(known_names("wind", {"columns", "rows"}), "known are `columns`, `rows`");
  EXPECT_EQ(known_names("", {"columns"}), "known are `columns`");
  EXPECT_EQ(known_names(std::string(100000, 'x'), {"columns"}), "known are `columns`");
}

}  // namespace
}  // namespace clothfit
