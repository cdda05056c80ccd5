// Checks that all criteria are told. Whether they are right is no matter of numbers:
// docs/results.md.
#include "fit/diagnosis/criteria.h"

#include <gtest/gtest.h>

#include <set>

namespace clothfit {
namespace {

TEST(DiagnosisCriteria, AreAllDescribed) {
  const std::vector<CriterionDescription> all = describe(kCriteria);
  EXPECT_EQ(all.size(), sizeof(DiagnosisCriteria) / sizeof(double));
  std::set<std::string> names;
  for (const CriterionDescription& one : all) {
    SCOPED_TRACE(one.name);
    EXPECT_TRUE(names.insert(one.name).second);
    EXPECT_FALSE(one.decides.empty() || one.raising.empty() || one.chosen.empty());
  }
}

TEST(DiagnosisCriteria, AreDescribedInTheirOrderWithTheirValues) {
  // Each member has another value.
  DiagnosisCriteria numbered;
  auto* members = reinterpret_cast<double*>(&numbered);
  const size_t count = sizeof(DiagnosisCriteria) / sizeof(double);
  for (size_t k = 0; k < count; ++k) members[k] = static_cast<double>(k);

  const std::vector<CriterionDescription> all = describe(numbered);
  ASSERT_EQ(all.size(), count);
  for (size_t k = 0; k < count; ++k) EXPECT_EQ(all[k].value, static_cast<double>(k)) << all[k].name;
}

}  // namespace
}  // namespace clothfit
