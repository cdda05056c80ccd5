#include "apps/report/diagnosis/diagnosis_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Separation separation(std::vector<SeparatingRecording> recordings) {
  return {.from = {.effect = "world_tilt"}, .now = 0.04, .recordings = std::move(recordings)};
}

TEST(SeparationTable, NamesNoRecordingThatTellsNothing) {
  const std::vector<Separation> separations{
      separation({{"shaken", 34.6}, {"turned", 1.2}, {"twice as long", 0.04}})};

  EXPECT_THAT(separation_table(separations).rows,
              ElementsAre(ElementsAre("world_tilt", "0.0", "shaken", "35"),
                          ElementsAre("world_tilt", "0.0", "turned", "1.2")));
}

TEST(SeparationTable, SaysHowLittleTheBestRecordingTells) {
  const std::vector<Separation> separations{separation({{"shaken", 0.3}, {"turned", 0.2}})};

  EXPECT_THAT(separation_table(separations).rows,
              ElementsAre(ElementsAre("world_tilt", "0.0", "shaken", "0.3")));
  EXPECT_THAT(separation_text({.effect = "gravity_tilt"}, separations),
              HasSubstr("at most 0.3 in recordings that were tried"));
}

TEST(SeparationText, NamesTheBestRecordingThatTells) {
  const std::vector<Separation> separations{separation({{"shaken", 34.6}, {"turned", 6}})};

  EXPECT_EQ(separation_text({.effect = "gravity_tilt"}, separations),
            "gravity_tilt cannot be told from world_tilt (0.0 sigma; 35 sigma with: shaken)");
}

TEST(FoundText, NamesAShapeThatWasTakenForKnown) {
  Hypothesis hem{.effect = "nonuniform_mass",
                 .mode = "hem",
                 .amplitudes = {"hem"},
                 .shape = {{"hem_width", 0.012}}};
  EXPECT_EQ(found_text(hem, {}), " (at hem_width 0.0120)");
  hem.fits_shape = true;
  EXPECT_EQ(found_text(hem, {}), "");
}

TEST(AcceptedText, TellsAnEffectInWordsAndItsValuesBelow) {
  FitReport found;
  found.model.cloth = {.width_m = 0.4, .height_m = 0.3, .mass_kg = 0.0144};
  found.model.mesh_columns = found.model.mesh_rows = 9;
  found.result.effects = {
      {"viscous_damping", {{.name = "rate", .unit = "1/s", .value = 1.5, .sigma = 0.02}}},
      {"spring_damping", {{.name = "shear", .unit = "s", .value = 1e-3, .sigma = 1e-4}}}};

  EXPECT_EQ(accepted_text({.effect = "viscous_damping", .amplitudes = {"rate"}}, found),
            "viscous_damping: half of a speed is gone after 0.462 s\n"
            "  rate = 1.500 ± 0.020 1/s");
  EXPECT_EQ(accepted_text({.effect = "spring_damping", .amplitudes = {"shear"}}, found),
            "spring_damping: shear = 0.00100 ± 0.00010 s");
}

TEST(CertaintyText, IsOfAllAmplitudesTogether) {
  FitResult found;
  found.effects = {
      {"wind", {{"q_x", "Pa", 0.3, 0.03}, {"q_y", "Pa", 0.4, 0.04}, {"q_z", "Pa", 9, 1}}}};
  EXPECT_EQ(certainty_text({.effect = "wind", .amplitudes = {"q_x", "q_y"}}, found),
            " ± 10 % (one standard deviation)");
  EXPECT_EQ(certainty_text({.effect = "wind", .amplitudes = {"q_x"}, .fits_shape = true}, found),
            "");
  EXPECT_EQ(certainty_text({.effect = "gust", .amplitudes = {"q_x"}}, found), "");
}

TEST(ShortCandidateTable, ListsFourAmplitudesOfMany) {
  Diagnosis diagnosis;
  diagnosis.scores.push_back(
      {.hypothesis = {.effect = "support_path", .amplitudes = {"a", "b", "c", "d", "e", "f"}},
       .amplitude = Eigen::VectorXd::Ones(6),
       .sigma = Eigen::VectorXd::Ones(6)});
  EXPECT_THAT(short_candidate_table(diagnosis).rows.front()[3], HasSubstr(", and 2 more"));
  EXPECT_EQ(candidate_table(diagnosis).rows.size(), 6u);
}

TEST(RemedyText, IsThatOfTheEffectWhereItHasOne) {
  EXPECT_EQ(
      remedy_text({.effect = "nonuniform_mass", .mode = "hem"}),
      "Remedy: weigh the hem, or declare it: copy nonuniform_mass from `effects` of model.yaml "
      "to `declared` of recording.yaml.");
  EXPECT_EQ(remedy_text({.effect = "wind", .mode = "pressure"}), "");
}

}  // namespace
}  // namespace clothfit
