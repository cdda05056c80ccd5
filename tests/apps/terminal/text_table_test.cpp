// Checks the layout of tables on the terminal. Their content: fit_page_test.cpp.
#include "apps/terminal/text_table.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

TEST(TextTable, AlignsNumbersRightAndWordsLeft) {
  const std::string text =
      text_table({{"name", "value"}, {{"shear", "11.0"}, {"k", "-"}, {"long name", "5"}}});

  EXPECT_EQ(text,
            "name       value\n"
            "---------  -----\n"
            "shear       11.0\n"
            "k              -\n"
            "long name      5\n");
}

TEST(TextTable, CountsCharactersNotBytes) {
  const std::string text = text_table({{"a", "b"}, {{"é", "x"}, {"ee", "y"}}});

  EXPECT_EQ(text,
            "a   b\n"
            "--  -\n"
            "é   x\n"
            "ee  y\n");
}

TEST(TextTable, ShowsItsHeaderWhenThereAreNoRows) {
  EXPECT_EQ(text_table({{"reason", "count"}, {}}), "reason  count\n------  -----\n");
}

}  // namespace
}  // namespace clothfit
