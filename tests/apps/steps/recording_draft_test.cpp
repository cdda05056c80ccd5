// Checks what is concluded from footage: held points, start, times, board; and what is asked for.

#include "apps/steps/recording_draft.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "vision/print/printed_sheet.h"

namespace clothfit {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// Where a cloth of 0.4 x 0.4 m has a place (s, t) at a frame, in pixels.
using Motion = std::function<Eigen::Vector2d(double s, double t, int frame)>;

constexpr double kPixelsPerMetre = 1000;
const Eigen::Vector2d kCorner_px(100, 80);

/// Falls from rest in frame 0 where it is not held; `free` says how far from what holds it.
Motion falling(const std::function<double(double s, double t)>& free) {
  return [free](double s, double t, int frame) {
    const Eigen::Vector2d place_px = kCorner_px + kPixelsPerMetre * Eigen::Vector2d(s, t);
    return Eigen::Vector2d(place_px + Eigen::Vector2d(0, 2.0 * free(s, t) * frame * frame));
  };
}

/// Recordings of drawn motion: 4 x 4 tags on a cloth.
struct Filmed {
  DraftInput input;

  explicit Filmed(const Motion& motion, int frames = 12) {
    const PrintedSheet sheet = make_tag_sheet({.columns = 4, .rows = 4});
    input.sheet.cloth.width_m = sheet.width_m;
    input.sheet.cloth.height_m = sheet.height_m;
    input.sheet.markers = sheet.markers;
    LookResult seen{.count = frames, .width = 640, .height = 480};
    for (int frame = 0; frame < frames; ++frame) {
      SeenPicture picture{.name = "", .frame = frame, .tags = {}, .board = {}};
      for (size_t m = 0; m < sheet.markers.markers.size(); m += 4) {
        SeenTag tag{.family = "tag36h11", .reading = {.frame = frame, .tag = {}, .rejected = {}}};
        tag.reading.tag.id = *sheet.markers.markers[m].tag;
        for (size_t c = 0; c < 4; ++c)
          tag.reading.tag.corner_px[c] =
              motion(sheet.markers.markers[m + c].s_m, sheet.markers.markers[m + c].t_m, frame);
        picture.tags.push_back(tag);
      }
      seen.pictures.push_back(picture);
    }
    input.footage.push_back({"film.mp4", seen});
    input.frame_rate_hz = 60;
  }
  RecordingDraft draft() const { return draft_recording(input, "film", "."); }
};

double from_top_corners(double s, double t) {
  return std::min(std::hypot(s, t), std::hypot(0.4 - s, t));
}

TEST(RecordingDraft, HoldsTheCornersWhoseTagsRest) {
  const RecordingDraft draft = Filmed(falling(from_top_corners)).draft();
  EXPECT_THAT(draft.yaml,
              AllOf(HasSubstr("- {at: [0, 0], motion: fixed}"),
                    HasSubstr("- {at: [0.4, 0], motion: fixed}"),
                    Not(HasSubstr("edge: top, motion")), HasSubstr("released_flat  #")));
  EXPECT_THAT(draft.assumed, Contains(HasSubstr("the top left corner and the top right corner")));
}

TEST(RecordingDraft, HoldsAnEdgeAlongWhichAllTagsRest) {
  const RecordingDraft draft = Filmed(falling([](double, double t) { return t; })).draft();
  EXPECT_THAT(draft.yaml,
              AllOf(HasSubstr("- {edge: top, motion: fixed}"), Not(HasSubstr("at: ["))));
}

TEST(RecordingDraft, TellsAReleaseFromMotionAndFromRest) {
  const Motion steady = [](double s, double t, int frame) {
    return Eigen::Vector2d(kCorner_px + kPixelsPerMetre * Eigen::Vector2d(s, t) +
                           Eigen::Vector2d(0, 30 * t * frame));
  };
  EXPECT_THAT(Filmed(steady).draft().yaml, HasSubstr("start: unknown"));
  const Motion still = [](double s, double t, int) {
    return Eigen::Vector2d(kCorner_px + kPixelsPerMetre * Eigen::Vector2d(s, t));
  };
  const RecordingDraft rests = Filmed(still).draft();
  EXPECT_THAT(rests.yaml, HasSubstr("start: at_rest"));
  EXPECT_THAT(rests.needed, Contains(HasSubstr("which points are held")));
  const Motion bent = [](double s, double t, int frame) {
    return Eigen::Vector2d(falling(from_top_corners)(s, t, frame) +
                           Eigen::Vector2d(0, 60 * std::sin(8 * s)));
  };
  EXPECT_THAT(Filmed(bent).draft().yaml, HasSubstr("start: at_rest"));
}

TEST(RecordingDraft, TakesTimesOfVideosAndAsksForARateOtherwise) {
  Filmed filmed(falling(from_top_corners));
  EXPECT_THAT(filmed.draft().yaml, HasSubstr("time: {frame_rate: 60}\n"));
  filmed.input.frame_rate_hz.reset();
  EXPECT_THROW(filmed.draft(), InputError);
  filmed.input.footage[0].seen.times_s = {0, 0.03};
  EXPECT_THAT(filmed.draft().yaml, HasSubstr("# time: left out"));
}

TEST(RecordingDraft, KeepsWhatTheSheetsRecordingSaysOfTheCloth) {
  Filmed filmed(falling(from_top_corners));
  filmed.input.sheet.cloth.masses = MassDistribution::equal;
  filmed.input.sheet.cloth.mesh_columns = 21;
  filmed.input.sheet.gravity_m_per_s2 = {0, 0, -9.78};
  EXPECT_THAT(filmed.draft().yaml,
              AllOf(HasSubstr("masses: equal"), HasSubstr("mesh: {columns: 21, rows: 17}"),
                    HasSubstr("gravity: [0, 0, -9.78]")));
}

TEST(RecordingDraft, GivesABoardToOneCameraAlone) {
  Filmed filmed(falling(from_top_corners));
  filmed.input.footage.push_back({"side.mp4", filmed.input.footage[0].seen});
  filmed.input.board = "stills";
  filmed.input.board_seen =
      LookResult{.pictures = {{.board = SeenBoard{.columns = 9, .rows = 6, .corner_px = {}}}}};
  EXPECT_THAT(filmed.draft().needed, Contains(HasSubstr("the lens of camera 'side'")));
}

TEST(RecordingDraft, NamesWhatNoPictureTells) {
  Filmed filmed(falling(from_top_corners));
  EXPECT_THAT(filmed.draft().needed, AllOf(Contains(HasSubstr("the mass of the cloth")),
                                           Contains(HasSubstr("the lens of camera 'film'")),
                                           Contains(HasSubstr("fixed reference points"))));
  filmed.input.mass_kg = 0.03;
  SeenTag other = filmed.input.footage[0].seen.pictures[0].tags[0];
  other.reading.tag.id = 77;
  filmed.input.footage[0].seen.pictures[0].tags.push_back(other);
  EXPECT_THAT(filmed.draft().needed,
              AllOf(Not(Contains(HasSubstr("mass"))), Contains(HasSubstr("the tags 77 stand"))));
}

TEST(RecordingDraft, TakesTheBoardThatMostStillsShow) {
  Filmed filmed(falling(from_top_corners));
  filmed.input.board = "stills";
  LookResult stills;
  for (const int columns : {10, 9, 9})
    stills.pictures.push_back({.board = SeenBoard{.columns = columns, .rows = 6}});
  filmed.input.board_seen = stills;
  EXPECT_THAT(filmed.draft().yaml, HasSubstr("columns: 9, rows: 6, square: 0.02}"));
  EXPECT_THAT(filmed.draft().needed, Contains(HasSubstr("the side of the board's fields")));
}

TEST(RecordingDraft, CanBeReadAsARecording) {
  const TemporaryFolder folder;
  Filmed filmed(falling(from_top_corners));
  const std::string name = "clip #2: it's";  // no text of YAML's own
  std::filesystem::create_directory(folder / name);
  filmed.input.footage[0].images = folder / name;
  std::filesystem::create_directory(folder / "film");
  const RecordingDraft draft = draft_recording(filmed.input, "film", folder / "film");
  std::ofstream(folder / "film" / "recording.yaml") << draft.yaml;
  write_markers(filmed.input.sheet.markers.markers, folder / "film" / "markers.csv");
  const Recording recording = read_recording(folder / "film");
  EXPECT_EQ(recording.cameras.at(0).images, folder / name);
  EXPECT_EQ(recording.cloth.masses, MassDistribution::by_area);
  EXPECT_EQ(recording.held.size(), 2U);
  EXPECT_EQ(recording.held_out_from_frame, 8);
}

TEST(RecordingDraft, DescribesAClothOfDots) {
  Filmed filmed(falling(from_top_corners));
  filmed.input.sheet.markers = make_dot_sheet({.columns = 5, .rows = 5}).markers;
  for (SeenPicture& picture : filmed.input.footage[0].seen.pictures) {
    picture.tags.clear();
    for (int m = 0; m < 25; ++m) {
      const Marker& dot = filmed.input.sheet.markers.markers[static_cast<size_t>(m)];
      picture.markers.push_back({m, falling(from_top_corners)(dot.s_m, dot.t_m, picture.frame)});
    }
  }
  const RecordingDraft draft = filmed.draft();
  EXPECT_THAT(draft.yaml, AllOf(HasSubstr("markers: {kind: dots, file: markers.csv}"),
                                HasSubstr("- {at: [0.4, 0], motion: fixed}"),
                                HasSubstr("start: released_flat  #")));
  EXPECT_THAT(draft.assumed, Contains(HasSubstr("25 of the 25 dots")));
}

TEST(RecordingDraft, SaysThatTheFirstPicturesAreMissingAndConcludesNothing) {
  Filmed filmed(falling(from_top_corners));
  std::vector<SeenPicture>& pictures = filmed.input.footage[0].seen.pictures;
  pictures.erase(pictures.begin());  // damaged
  const RecordingDraft draft = filmed.draft();
  EXPECT_THAT(draft.yaml, HasSubstr("start: unknown  # NEEDED"));
  EXPECT_THAT(draft.needed, Contains(HasSubstr("the first three frames were not all seen")));
}

TEST(RecordingDraft, RefusesAFrameRateThatTheVideoContradicts) {
  Filmed filmed(falling(from_top_corners));
  for (int n = 0; n < 12; ++n) filmed.input.footage[0].seen.times_s.push_back(n / 25.0);
  EXPECT_THROW(filmed.draft(), InputError) << "60 is declared";
  filmed.input.frame_rate_hz = 25;
  EXPECT_NO_THROW(filmed.draft());
}

TEST(RecordingDraft, SaysWhatTagsAreSeenWhereNoSheetIsGiven) {
  const Filmed filmed(falling(from_top_corners));
  try {
    refuse_without_sheet(filmed.input.footage[0]);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("shows 16 tags of tag36h11: 0 to 15"),
                                    HasSubstr("clothfit sheet tags --size")));
  }
}

TEST(RecordingDraft, RefusesFootageWithoutTheSheet) {
  Filmed filmed(falling(from_top_corners));
  for (SeenPicture& picture : filmed.input.footage[0].seen.pictures) picture.tags.clear();
  EXPECT_THROW(filmed.draft(), InputError);
}

}  // namespace
}  // namespace clothfit
