// Recordings that contradict themselves, each made from one that does not. Exit codes are checked
// in tests/apps/program_test.cpp.

#include "fit/preflight/preflight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "data/input_error.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

const SyntheticCloth kSoundCloth{.markers = 9, .frames = 40, .held_out_from = 30};

FitInput sound() {
  static const FitInput input = synthetic_input(kSoundCloth);
  return input;
}

FitInput in_pictures(FitInput input) {
  input.tracks3d.clear();
  return input;
}

Findings check(const FitInput& input) {
  return check_recording(input, ObservationKind::automatic);
}

/// The findings that are no passes, in one text.
std::string text_of(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings)
    if (finding.state != FindingState::passed)
      text += to_string(finding.state) + " " + finding.check + ": " + sentence(finding) + "\n";
  return text;
}

bool refuses(const FitInput& input, const std::string& what, const std::string& words) {
  for (const Finding& finding : check(input))
    if (finding.state == FindingState::refused && finding.check == what &&
        sentence(finding).find(words) != std::string::npos)
      return true;
  ADD_FAILURE() << "expected a refusal of " << what << " with \"" << words << "\", found\n"
                << text_of(check(input));
  return false;
}

bool warns(const FitInput& input, const std::string& what, const std::string& words) {
  const Findings findings = check(input);
  EXPECT_TRUE(with_state(findings, FindingState::refused).empty()) << text_of(findings);
  for (const Finding& finding : findings)
    if (finding.state == FindingState::warning && finding.check == what &&
        sentence(finding).find(words) != std::string::npos)
      return true;
  ADD_FAILURE() << "expected a warning of " << what << " with \"" << words << "\", found\n"
                << text_of(findings);
  return false;
}

TEST(Preflight, FindsNothingInSoundRecordings) {
  EXPECT_EQ(text_of(check(sound())), "");
  EXPECT_EQ(text_of(check(in_pictures(sound()))), "");
  for (const unsigned seed : {2u, 3u, 4u}) {
    SyntheticCloth cloth = kSoundCloth;
    cloth.seed = seed;
    cloth.drag_rate_per_s = seed;
    EXPECT_EQ(text_of(check(synthetic_input(cloth))), "") << "seed " << seed;
  }
}

TEST(Preflight, SaysWhatItMeasured) {
  std::set<std::string> passed;
  for (const Finding& finding : check(sound())) passed.insert(finding.check);

  EXPECT_THAT(passed, testing::IsSupersetOf({"mass", "units", "first sheet", "time", "gravity",
                                             "held points", "markers"}));
}

TEST(Preflight, NamesTheUnitOfTracks) {
  for (const auto& [factor, name] : {std::pair{1000.0, "millimetres"},
                                     {100.0, "centimetres"},
                                     {39.37, "inches"},
                                     {3.281, "feet"}}) {
    FitInput input = sound();
    for (Position3d& row : input.tracks3d) {
      row.position_m *= factor;
      row.sigma_m *= factor;
    }
    EXPECT_TRUE(refuses(input, "units", name));
  }
}

TEST(Preflight, NamesGramsAndMillimetresOfTheCloth) {
  FitInput grams = sound();
  *grams.recording.cloth.mass_kg *= 1000;
  EXPECT_TRUE(refuses(grams, "mass", "grams"));

  FitInput millimetres = sound();
  millimetres.recording.cloth.width_m *= 1000;
  millimetres.recording.cloth.height_m *= 1000;
  EXPECT_TRUE(refuses(millimetres, "mass", "millimetres"));
}

TEST(Preflight, RefusesUnitsOfGravityAndTime) {
  FitInput gravity = sound();
  gravity.recording.gravity_m_per_s2 = {0, 0, -981};
  EXPECT_TRUE(refuses(gravity, "gravity", "981"));

  FitInput times = sound();
  times.recording.frame_rate_hz.reset();
  times.recording.times_file = "times.csv";
  for (int f = 0; f < kSoundCloth.frames; ++f) times.recording.times_s.push_back(16.7 * f);
  EXPECT_TRUE(refuses(times, "time", "milliseconds"));
}

TEST(Preflight, NamesGravityThatIsTurnedRound) {
  FitInput input = sound();
  input.recording.gravity_m_per_s2 *= -1;
  EXPECT_TRUE(refuses(input, "gravity", "[0, 0, -9.81]"));
  EXPECT_TRUE(refuses(in_pictures(input), "gravity", "[0, 0, -9.81]"));
}

TEST(Preflight, NamesTheAxisOfGravity) {
  FitInput input = sound();
  input.recording.gravity_m_per_s2 = {0, -9.81, 0};
  EXPECT_TRUE(refuses(input, "gravity", "along -z"));
}

TEST(Preflight, NamesTheFrameRate) {
  for (const auto& [declared, words] : {std::pair{30.0, "60 Hz in place of 30"},
                                        {120.0, "60 Hz in place of 120"},
                                        {200.0, "60 Hz in place of 200"}}) {
    FitInput input = sound();
    input.recording.frame_rate_hz = declared;
    EXPECT_TRUE(refuses(input, "gravity", words));
  }
}

TEST(Preflight, WarnsOfAWrongFrameRateOfOneCamera) {
  for (const double declared : {30.0, 120.0}) {
    FitInput input = in_pictures(sound());
    input.recording.frame_rate_hz = declared;
    EXPECT_TRUE(warns(input, "gravity", "frame rate"));
  }
}

TEST(Preflight, LeavesAWindToTheDiagnosis) {
  // Drag that takes a good part of the first fall is an effect, and no wrong gravity.
  SyntheticCloth cloth = kSoundCloth;
  cloth.drag_rate_per_s = 8;
  EXPECT_EQ(text_of(check(synthetic_input(cloth))), "");
}

TEST(Preflight, LetsAClothBeCarried) {
  FitInput input = sound();
  input.recording.held.clear();
  input.recording.declared = {{.name = "contact_plane", .parameters = {{"stiffness", {1000}}}}};
  EXPECT_EQ(text_of(check(input)), "");
}

TEST(Preflight, LetsCrumpledClothBeSmall) {
  FitInput input = sound();
  input.recording.start = StartKind::unknown;
  for (Position3d& row : input.tracks3d) row.position_m *= 0.5;
  EXPECT_EQ(text_of(check(input)), "");
  for (Position3d& row : input.tracks3d) row.position_m *= 0.2;
  EXPECT_TRUE(refuses(input, "units", "decimetres"));
}

/// Puts `still` frames in front that show the first one, each with noise of its own.
FitInput held_for(int still) {
  FitInput input = sound();
  for (Position3d& row : input.tracks3d) row.frame += still;
  for (int f = 0; f < still; ++f) {
    SyntheticCloth cloth = kSoundCloth;
    cloth.seed = 100 + static_cast<unsigned>(f);
    cloth.frames = 2;
    for (Position3d row : synthetic_input(cloth).tracks3d) {
      if (row.frame > 0) break;
      row.frame = f;
      input.tracks3d.push_back(row);
    }
  }
  std::ranges::stable_sort(input.tracks3d, {}, &Position3d::frame);
  return input;
}

TEST(Preflight, NamesTheFrameOfALateRelease) {
  for (const int still : {4, 9}) {
    const FitInput input = held_for(still);
    EXPECT_TRUE(refuses(input, "release", "begins with frame " + std::to_string(still)));
  }
}

TEST(Preflight, RefusesAStartThatMovesAlready) {
  FitInput input = sound();
  std::erase_if(input.tracks3d, [](const Position3d& row) { return row.frame < 8; });
  for (Position3d& row : input.tracks3d) row.frame -= 8;
  const Findings findings = check(input);

  EXPECT_FALSE(with_state(findings, FindingState::refused).empty());
  EXPECT_THAT(text_of(findings), HasSubstr("start: unknown"));
}

TEST(Preflight, WarnsOfRestThatNothingDisturbs) {
  FitInput input = sound();
  input.recording.start = StartKind::at_rest;
  EXPECT_TRUE(warns(input, "release", "released_flat"));
}

TEST(Preflight, RefusesClothThatDoesNotMove) {
  FitInput input = sound();
  std::erase_if(input.tracks3d, [](const Position3d& row) { return row.frame > 0; });
  const Tracks3d first = input.tracks3d;
  for (int f = 1; f < 20; ++f)
    for (Position3d row : first) {
      row.frame = f;
      row.position_m.x() += 1e-5 * f;
      input.tracks3d.push_back(row);
    }
  EXPECT_TRUE(refuses(input, "release", "does not move"));
}

/// Leaves out some frames and numbers the others on.
FitInput without_frames(int first, int count) {
  FitInput input = sound();
  std::erase_if(input.tracks3d, [&](const Position3d& row) {
    return row.frame >= first && row.frame < first + count;
  });
  for (Position3d& row : input.tracks3d)
    if (row.frame > first) row.frame -= count;
  return input;
}

TEST(Preflight, CountsFramesThatAreMissing) {
  EXPECT_TRUE(refuses(without_frames(20, 1), "time", "between frames 19 and 20"));
  EXPECT_TRUE(refuses(without_frames(14, 3), "time", "3 seem to be missing"));
}

TEST(Preflight, WarnsOfAFrameWrittenTwice) {
  FitInput input = sound();
  for (Position3d& row : input.tracks3d)
    if (row.frame > 24) ++row.frame;
  const Tracks3d rows = input.tracks3d;
  for (Position3d row : rows)
    if (row.frame == 24) {
      row.frame = 25;
      input.tracks3d.push_back(row);
    }
  std::ranges::stable_sort(input.tracks3d, {}, &Position3d::frame);
  EXPECT_TRUE(warns(input, "time", "frame 25"));
}

TEST(Preflight, NamesWhatHoldsTheClothInstead) {
  FitInput input = sound();
  input.recording.held = {{.at_m = {0, 0.4}}, {.at_m = {0.4, 0.4}}};
  EXPECT_TRUE(refuses(input, "held points", "with t mirrored they would be the held points"));
}

TEST(Preflight, NamesExchangedAxesByWhatRests) {
  FitInput input = sound();
  for (Marker& marker : input.recording.markers.markers) std::swap(marker.s_m, marker.t_m);
  EXPECT_TRUE(refuses(input, "held points", "with s and t exchanged"));
}

TEST(Preflight, AsksForWhatHoldsTheCloth) {
  FitInput input = sound();
  input.recording.held.clear();
  EXPECT_TRUE(refuses(input, "held points", "m0 at (0, 0), m8 at (0.4, 0)"));
}

TEST(Preflight, WarnsOfAClipThatSlips) {
  FitInput input = sound();
  for (Position3d& row : input.tracks3d)
    if (row.marker == 0) row.position_m.z() -= 0.008 * std::min(1.0, row.frame / 20.0);
  EXPECT_TRUE(warns(input, "held points", "(0, 0) is fixed"));
}

TEST(Preflight, WarnsOfWhatIsHeldBesides) {
  FitInput input = sound();
  input.recording.held.pop_back();
  EXPECT_TRUE(warns(input, "held points", "m8 at (0.4, 0)"));
}

TEST(Preflight, NamesMarkersWithEachOthersTracks) {
  FitInput input = sound();
  for (Position3d& row : input.tracks3d) {
    if (row.frame < 15) continue;
    if (row.marker == 30)
      row.marker = 52;
    else if (row.marker == 52)
      row.marker = 30;
  }
  EXPECT_TRUE(warns(input, "markers", "m30 and m52 (frames 15 to 39)"));
}

TEST(Preflight, NamesNeighboursWithEachOthersTracksInPictures) {
  FitInput input = in_pictures(sound());
  for (Position2d& row : input.tracks2d.at("front")) {
    if (row.marker == 40)
      row.marker = 41;
    else if (row.marker == 41)
      row.marker = 40;
  }
  EXPECT_TRUE(warns(input, "markers", "m40 and m41 (frames 0 to 39)"));
}

TEST(Preflight, NamesATrackThatStandsStill) {
  FitInput input = sound();
  Eigen::Vector3d stays = Eigen::Vector3d::Zero();
  for (Position3d& row : input.tracks3d) {
    if (row.marker != 70 || row.frame < 12) continue;
    if (row.frame == 12) stays = row.position_m;
    row.position_m = stays;
  }
  EXPECT_TRUE(warns(input, "markers", "m70 (28 frames)"));
}

TEST(Preflight, NamesAMarkerThatIsFollowedTwice) {
  FitInput input = sound();
  for (const Position3d& row : sound().tracks3d)
    for (Position3d& other : input.tracks3d)
      if (row.marker == 33 && other.marker == 60 && row.frame == other.frame)
        other.position_m = row.position_m;
  EXPECT_TRUE(warns(input, "markers", "m33 and m60"));
}

TEST(Preflight, NamesRowsAndColumnsThatAreExchanged) {
  // A grid of 9 x 6 markers whose tracks run column by column.
  FitInput input = sound();
  const auto is_kept = [](int marker) { return marker % 9 < 6; };
  std::erase_if(input.tracks3d, [&](const Position3d& row) { return !is_kept(row.marker); });
  MarkerSet& markers = input.recording.markers;
  const std::vector<Marker> all = markers.markers;
  markers.markers.clear();
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 6; ++j) markers.markers.push_back(all[static_cast<size_t>(9 * i + j)]);
  for (Position3d& row : input.tracks3d) {
    const int i = row.marker / 9, j = row.marker % 9;
    row.marker = j * 9 + i;
  }
  std::ranges::sort(input.tracks3d, {},
                    [](const Position3d& row) { return std::pair(row.frame, row.marker); });
  EXPECT_TRUE(refuses(input, "first sheet", "rows and columns are exchanged"));
}

TEST(Preflight, AsksWhetherWidthAndHeightAreExchanged) {
  // A cloth of 0.4 by 0.3 m whose size is written the other way, its markers with it.
  FitInput input = sound();
  input.recording.cloth.width_m = 0.3;
  for (Position3d& row : input.tracks3d) row.position_m.x() *= 0.75;
  for (Marker& marker : input.recording.markers.markers) marker.s_m *= 0.75;
  input.recording.held = {{.at_m = {0, 0}}, {.at_m = {0.3, 0}}};
  EXPECT_THAT(text_of(check(input)), testing::Not(HasSubstr("exchanged")));

  std::swap(input.recording.cloth.width_m, input.recording.cloth.height_m);
  for (Marker& marker : input.recording.markers.markers) {
    marker.s_m *= 4.0 / 3;
    marker.t_m *= 0.75;
  }
  EXPECT_TRUE(refuses(input, "units", "are they exchanged?"));
}

TEST(Preflight, WarnsOfAPrintOfAnotherScale) {
  FitInput input = sound();
  for (Marker& marker : input.recording.markers.markers) {
    marker.s_m *= 0.92;
    marker.t_m *= 0.92;
  }
  input.recording.held = {{.at_m = {0, 0}}, {.at_m = {0.368, 0}}};
  EXPECT_TRUE(warns(input, "units", "print's scale"));
}

TEST(Preflight, NamesTheOrderOfCorners) {
  // Groups of four markers are tags, whose corners are numbered from the bottom left.
  SyntheticCloth cloth = kSoundCloth;
  cloth.markers = 10;
  FitInput input = synthetic_input(cloth);
  std::vector<Marker>& markers = input.recording.markers.markers;
  input.recording.markers.kind = MarkerKind::apriltag;
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 10; ++j) {
      Marker& marker = markers[static_cast<size_t>(10 * i + j)];
      marker.tag = 5 * (i / 2) + j / 2;
      marker.corner = i % 2 == 1 ? j % 2 : 3 - j % 2;
    }
  EXPECT_EQ(text_of(check(input)), "");
  EXPECT_EQ(text_of(check(in_pictures(input))), "");
  // The file says so of corners that run the other way round.
  const std::vector<Marker> right = markers;
  for (Marker& marker : markers)
    for (const Marker& other : right)
      if (other.tag == marker.tag && other.corner == 3 - *marker.corner) {
        marker.s_m = other.s_m;
        marker.t_m = other.t_m;
      }
  EXPECT_TRUE(refuses(input, "first sheet", "the other way round"));
  EXPECT_TRUE(refuses(in_pictures(input), "first sheet", "the other way round"));
}

TEST(Preflight, WarnsOfANumberBeyondWhatAnEffectHas) {
  FitInput input = sound();
  input.recording.declared = {{.name = "wind", .parameters = {{"q_x", {250}}}, .line = 12}};
  EXPECT_TRUE(warns(input, "effects", ":12: wind.q_x = 250 Pa"));
}

TEST(Preflight, RefusesWithWhatElseIsWrong) {
  FitInput input = sound();
  *input.recording.cloth.mass_kg *= 1000;
  for (Position3d& row : input.tracks3d) row.position_m *= 1000;
  try {
    refuse_wrong(check(input));
    FAIL() << "nothing was refused";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("recording.yaml: "));
    EXPECT_THAT(error.what(), HasSubstr("1 more of this recording is refused too"));
  }
  EXPECT_NO_THROW(refuse_wrong(check(sound())));
}

}  // namespace
}  // namespace clothfit
