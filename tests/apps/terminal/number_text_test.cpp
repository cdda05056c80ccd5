// Checks rounding of numbers for people and for CSV. Its use by tables and pages:
// fit_page_test.cpp.
#include "apps/terminal/number_text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

namespace clothfit {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(NumberText, KeepsSignificantDigits) {
  EXPECT_EQ(significant(41.237, 3), "41.2");
  EXPECT_EQ(significant(0.00012345, 2), "0.00012");
  EXPECT_EQ(significant(1234.5, 2), "1234");
  EXPECT_EQ(significant(-0.5, 2), "-0.50");
  EXPECT_EQ(significant(0, 3), "0");
}

TEST(NumberText, RoundsUpIntoTheNextDecade) {
  EXPECT_EQ(significant(0.9996, 3), "1.00");
  EXPECT_EQ(significant(99.96, 3), "100");
}

TEST(NumberText, UsesAnExponentOutsideThePlainRange) {
  EXPECT_EQ(significant(1.234e-5, 2), "1.2e-05");
  EXPECT_EQ(significant(2.5e7, 2), "2.5e+07");
}

TEST(NumberText, NeverPrintsWhatIsNotANumber) {
  EXPECT_EQ(significant(kNan, 3), "-");
  EXPECT_EQ(significant(kInfinity, 3), "-");
  EXPECT_EQ(value_text(kNan, 1), "-");
  EXPECT_EQ(exact_text(-kInfinity), "");
}

TEST(NumberText, CutsAValueWhereItsSigmaEnds) {
  EXPECT_EQ(value_text(55.12345, 0.61), "55.12");
  EXPECT_EQ(value_text(55.12345, 12), "55");
  EXPECT_EQ(value_text(0.05, 0.4), "0.05");
  EXPECT_EQ(value_text(2.3456e-7, 1.2e-8), "2.35e-07");
}

TEST(NumberText, GivesFourDigitsToAValueWithoutSigma) {
  EXPECT_EQ(value_text(0.203125, 0), "0.2031");
  EXPECT_EQ(value_text(3.0, kNan), "3.000");
}

TEST(NumberText, WritesExactTextThatReadsBackToTheSameBits) {
  for (const double value : {0.1, 1.0 / 3, 6.02214076e23, -4.9e-324})
    EXPECT_EQ(std::strtod(exact_text(value).c_str(), nullptr), value);
}

TEST(ShowsNumber, TellsNumbersFromWords) {
  for (const char* number : {"", "-", "0.12", "-3", "1.2e-05", "12%", "0.41 %"})
    EXPECT_TRUE(shows_number(number)) << number;
  for (const char* word : {"N/m", "12 mm", "fitted", "3.1.2", "5 %%"})
    EXPECT_FALSE(shows_number(word)) << word;
}

}  // namespace
}  // namespace clothfit
