// Checks the search's loop, on costs alone. Its steps are checked in shortlist_test.cpp,
// trial_test.cpp and prune_test.cpp, whole searches in search_test.cpp.
#include "fit/diagnosis/beam.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace clothfit {
namespace {

constexpr double kBase = 100;  ///< cost of the entry that has found nothing

BeamEntry entry_of(double cost, const std::vector<std::string>& effects,
                   double must_still_beat = BeamEntry::kNothing) {
  BeamEntry entry{.model = {},
                  .accepted = {},
                  .cost = cost,
                  .must_still_beat = must_still_beat,
                  .last = {},
                  .refused = {}};
  for (const std::string& effect : effects) entry.model.hypotheses.push_back({.effect = effect});
  return entry;
}

std::string effects_of(const BeamEntry& entry) {
  std::string names;
  for (const Hypothesis& hypothesis : entry.model.hypotheses) names += hypothesis.effect;
  return names;
}

/// Finishes the next entry, adds children, and returns its effects.
std::string extend(Beam& beam, std::vector<BeamEntry> children) {
  BeamEntry* next = beam.next();
  if (next == nullptr) return "none";
  next->finished = true;
  const std::string effects = effects_of(*next);
  beam.add(std::move(children), kBase);
  return effects;
}

TEST(Beam, PutsTheSimplestOfThoseAlikeFirst) {
  const auto with_numbers = [](double cost, const std::string& effect, int numbers) {
    BeamEntry entry = entry_of(cost, {effect});
    entry.model.hypotheses.front().amplitudes.resize(static_cast<size_t>(numbers), "a");
    return entry;
  };
  constexpr double kTold = 25;  // chi-square between entries that are told apart
  Beam alike(entry_of(kBase, {}), 3, 4);
  EXPECT_EQ(extend(alike, {with_numbers(40, "gust", 5), with_numbers(39 + kTold, "wind", 3)}), "");
  EXPECT_EQ(effects_of(alike.best()), "wind");
  Beam told_apart(entry_of(kBase, {}), 3, 4);
  EXPECT_EQ(extend(told_apart, {with_numbers(40, "gust", 5), with_numbers(41 + kTold, "wind", 3)}),
            "");
  EXPECT_EQ(effects_of(told_apart.best()), "gust");
}

TEST(Beam, ExtendsTheCheapestEntryFirst) {
  Beam beam(entry_of(kBase, {}), 3, 4);
  EXPECT_EQ(extend(beam, {entry_of(50, {"b"}), entry_of(40, {"a"})}), "");
  EXPECT_EQ(extend(beam, {entry_of(45, {"a", "c"})}), "a");
  EXPECT_EQ(extend(beam, {}), "ac");
  EXPECT_EQ(extend(beam, {}), "b");
  EXPECT_EQ(extend(beam, {}), "none");
  EXPECT_EQ(effects_of(beam.best()), "a");
}

TEST(Beam, GivesNoEntryMoreEffectsThanAskedFor) {
  Beam beam(entry_of(kBase, {}), 3, 1);
  EXPECT_EQ(extend(beam, {entry_of(40, {"a"})}), "");
  EXPECT_EQ(beam.next(), nullptr);
}

TEST(Beam, KeepsTheCheaperOfTwoOrdersAndWhatEitherHasBeaten) {
  Beam beam(entry_of(kBase, {}), 5, 4);
  extend(beam, {entry_of(40, {"a"}), entry_of(41, {"b"})});
  // The cheaper order must still beat something, which the other has beaten.
  EXPECT_EQ(extend(beam, {entry_of(30, {"a", "b"}, 3)}), "a");
  EXPECT_EQ(extend(beam, {}), "ab");
  EXPECT_EQ(extend(beam, {entry_of(31, {"b", "a"})}), "b");
  EXPECT_EQ(beam.next(), nullptr);
  EXPECT_EQ(effects_of(beam.best()), "ab");
  EXPECT_TRUE(beam.best().is_sound());
}

TEST(Beam, DoesNotFollowWhatGainedLessThanHalf) {
  Beam beam(entry_of(kBase, {}), 5, 4);
  extend(beam, {entry_of(20, {"a"}), entry_of(61, {"b"}), entry_of(59, {"c"})});
  EXPECT_EQ(extend(beam, {}), "a");
  EXPECT_EQ(extend(beam, {}), "c");  // 41 of 80
  EXPECT_EQ(extend(beam, {}), "none");
}

TEST(Beam, FollowsNoMoreEntriesThanItIsWide) {
  Beam beam(entry_of(kBase, {}), 2, 4);
  extend(beam, {entry_of(20, {"a"}), entry_of(21, {"b"}), entry_of(22, {"c"})});
  EXPECT_EQ(extend(beam, {}), "a");
  EXPECT_EQ(extend(beam, {}), "b");
  EXPECT_EQ(extend(beam, {}), "none");
}

TEST(Beam, FallsBackOnTheCheapestSoundEntryWhereTheBestIsNone) {
  Beam beam(entry_of(kBase, {}), 1, 4);
  // The first entry is on credit; what is dropped beside it is sound.
  extend(beam, {entry_of(20, {"a"}, 2), entry_of(60, {"b"}), entry_of(70, {"c"})});
  EXPECT_EQ(extend(beam, {}), "a");
  EXPECT_EQ(extend(beam, {}), "b");
  EXPECT_EQ(beam.next(), nullptr);
  EXPECT_EQ(effects_of(beam.best()), "b");
}

TEST(Beam, GivesAwayTheCheapestSoundEntryWhereItEndsEarly) {
  Beam beam(entry_of(kBase, {}), 3, 4);
  EXPECT_EQ(extend(beam, {entry_of(40, {"a"}, 2.0), entry_of(45, {"b"})}), "");
  EXPECT_EQ(effects_of(beam.release_best_sound()), "b");

  Beam none_sound(entry_of(kBase, {}), 1, 4);
  EXPECT_EQ(extend(none_sound, {entry_of(40, {"a"}, 2.0)}), "");
  EXPECT_EQ(effects_of(none_sound.release_best_sound()), "");
}

TEST(Beam, FallsBackOnWhatItBeganWith) {
  Beam beam(entry_of(kBase, {}), 3, 1);
  extend(beam, {entry_of(20, {"a"}, 2)});
  EXPECT_EQ(beam.next(), nullptr);
  EXPECT_EQ(effects_of(beam.best()), "");
}

}  // namespace
}  // namespace clothfit
