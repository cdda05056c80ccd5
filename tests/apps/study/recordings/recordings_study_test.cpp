// Checks one table of many recordings. Not checked here: the fits themselves (tests/fit), threads
// and journals in general (tests/fit/jobs/executor_test.cpp, journal_test.cpp).

#include "apps/study/recordings/recordings_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <set>

#include "apps/report/study/recordings_tables.h"
#include "apps/steps/steps.h"
#include "apps/study/recordings/study_row_json.h"
#include "apps/terminal/exit_code.h"
#include "data/input_error.h"
#include "tests/apps/bundled_recordings.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::ThrowsMessage;

class RecordingsStudy : public ::testing::Test {
 protected:
  const test::ScratchFolder scratch_{
      std::string("recordings_study_") +
      ::testing::UnitTest::GetInstance()->current_test_info()->name()};
  const fs::path folder_ = scratch_.path() / "recordings";

  /// Copies the first 24 frames of the 3D tracks of a bundled recording, the last 8 of them held
  /// out.
  void copy(const std::string& bundled, const std::string& to,
            HeldMotion motion = HeldMotion::fixed) const {
    Recording recording = read_recording(kBundled / bundled);
    Tracks3d tracks = read_tracks3d(*recording.tracks3d, recording.markers);
    std::erase_if(tracks, [](const Position3d& row) { return row.frame >= 24; });
    recording.held_out_from_frame = 16;
    recording.tracks2d.clear();
    recording.cameras.clear();
    for (HeldPoint& point : recording.held) point.motion = motion;
    fs::create_directories(folder_ / to);
    recording.tracks3d = folder_ / to / "tracks3d.csv";
    write_tracks3d(tracks, recording.markers, *recording.tracks3d);
    recording.markers_file = folder_ / to / "markers.csv";
    write_markers(recording.markers.markers, recording.markers_file);
    write_recording(recording, folder_ / to);
  }
  /// Adds a recording that names a file which is not there.
  void add_broken(const std::string& to) const {
    fs::create_directories(folder_ / to);
    fs::copy(kBundled / "swing_plain" / "recording.yaml", folder_ / to / "recording.yaml");
  }
  /// Makes fits unrefined but quick: the tests ask how fits are told, not how good they are.
  RecordingsStudyOptions quick() const {
    RecordingsStudyOptions options;
    options.recordings = find_recordings({folder_});
    options.models = {{.name = "base", .effects = {}}};
    options.fit.mesh_columns = options.fit.mesh_rows = 5;
    options.fit.population = 8;
    options.fit.generations = 2;
    options.fit.refine_best = 1;
    options.fit.work = 1e-3;
    options.threads = 1;
    return options;
  }
};

/// Returns all digits of rows but the seconds.
std::string text_of(std::vector<StudyRow> rows) {
  for (StudyRow& row : rows) row.seconds = 0;
  return rows_to_text(rows);
}

TEST_F(RecordingsStudy, FindsRecordingsAtAnyDepthInTheOrderOfTheirPaths) {
  copy("swing_plain", "b/inner");
  fs::create_directories(folder_ / "empty");
  copy("swing_plain", "a");

  EXPECT_THAT(find_recordings({folder_}), ElementsAre(folder_ / "a", folder_ / "b" / "inner"));
  EXPECT_THAT(find_recordings({folder_ / "b"}), ElementsAre(folder_ / "b" / "inner"));
  EXPECT_THAT(find_recordings({folder_ / "a" / ""}), ElementsAre(folder_ / "a"));
  EXPECT_THAT([&] { find_recordings({folder_ / "empty"}); },
              ThrowsMessage<InputError>(HasSubstr("holds no recording")));
}

TEST_F(RecordingsStudy, FollowsLinksToEachRecordingOnce) {
  copy("swing_plain", "a");
  copy("swing_plain", "elsewhere/b");
  fs::create_directories(folder_ / "chosen" / "deeper");
  fs::create_directory_symlink(folder_ / "a", folder_ / "chosen" / "first");
  fs::create_directory_symlink(folder_ / "a", folder_ / "chosen" / "again");
  fs::create_directory_symlink(folder_ / "chosen", folder_ / "chosen" / "deeper" / "round");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "chosen" / "second");
  fs::create_directory_symlink(folder_, folder_ / "a" / "upwards");

  const std::vector<fs::path> found = find_recordings({folder_ / "chosen"});

  EXPECT_THAT(found,
              ElementsAre(folder_ / "chosen" / "again", folder_ / "chosen" / "second" / "b"));
  RecordingsStudyOptions options = quick();
  options.recordings = found;
  EXPECT_FALSE(options.key().empty()) << "it walks through the recordings as well";
}

TEST_F(RecordingsStudy, RefusesLinksThatLeadNowhere) {
  copy("swing_plain", "a");
  fs::create_symlink("/nonexistent", folder_ / "b");
  EXPECT_THAT([&] { find_recordings({folder_}); },
              ThrowsMessage<InputError>(HasSubstr("b: is a link that leads nowhere")));
  fs::remove(folder_ / "b");
  fs::create_symlink(folder_ / "b", folder_ / "b");
  EXPECT_THAT([&] { find_recordings({folder_}); },
              ThrowsMessage<InputError>(HasSubstr("b: cannot be looked at")));
}

TEST_F(RecordingsStudy, SaysWhichFolderMayNotBeRead) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read all";
  copy("swing_plain", "a");
  fs::create_directories(folder_ / "closed");
  fs::permissions(folder_ / "closed", fs::perms::none);
  EXPECT_THAT([&] { find_recordings({folder_}); },
              ThrowsMessage<InputError>(HasSubstr("closed: the folder cannot be listed")));
  fs::permissions(folder_ / "closed", fs::perms::owner_all);
}

TEST_F(RecordingsStudy, SaysWhatTheSingleFitSays) {
  copy("swing_plain", "plain");
  RecordingsStudyOptions options = quick();
  options.models.push_back({.name = "damped", .effects = {"viscous_damping"}});

  const std::vector<StudyRow> rows = study_recordings(options, nullptr, {});

  ASSERT_EQ(rows.size(), 2u);
  const FitInput input =
      read_fit_input(read_recording(folder_ / "plain"), ObservationKind::automatic);
  for (size_t m = 0; m < rows.size(); ++m) {
    FitOptions single = options.fit;
    single.effects = options.models[m].effects;
    const FitReport report = fit(input, single, {});
    const ObservationErrors& errors = report.result.errors.front();
    const StudyRow& row = rows[m];
    EXPECT_TRUE(row.fitted) << row.reason;
    EXPECT_EQ(row.model, options.models[m].name);
    EXPECT_EQ(row.fitted_rms, errors.fitted.rms_distance);
    EXPECT_EQ(row.held_out_rms, errors.held_out.rms_distance);
    EXPECT_DOUBLE_EQ(row.first_frame_rms, std::sqrt(3) * errors.trivial.first_frame);
    EXPECT_EQ(row.parameters.at("shear"), report.result.parameters[3].value);
    EXPECT_EQ(row.parameters.contains("viscous_damping.rate"), m == 1);
    // The whole recording is its fitted and its held-out part.
    const double squares = errors.fitted.count * std::pow(errors.fitted.rms_distance, 2) +
                           errors.held_out.count * std::pow(errors.held_out.rms_distance, 2);
    EXPECT_NEAR(row.whole_rms, std::sqrt(squares / (errors.fitted.count + errors.held_out.count)),
                1e-12 * row.whole_rms);
  }
}

TEST_F(RecordingsStudy, ABrokenRecordingHasItsReasonAndStopsNoOther) {
  add_broken("broken");
  copy("swing_plain", "plain");

  const std::vector<StudyRow> rows = study_recordings(quick(), nullptr, {});

  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[0].fitted);
  EXPECT_EQ(rows[0].recording, "broken");
  EXPECT_THAT(rows[0].reason, HasSubstr("there is no such file"));
  EXPECT_TRUE(rows[1].fitted) << rows[1].reason;
  EXPECT_EQ(study_summary(rows).rows.front()[2], "1");
  EXPECT_THAT(study_page_html(rows, "command"), HasSubstr("there is no such file"));
}

TEST_F(RecordingsStudy, TheSameBytesOnOneThreadAndOnThree) {
  copy("swing_plain", "a");
  copy("swing_breeze", "b");
  RecordingsStudyOptions options = quick();
  const std::string one = text_of(study_recordings(options, nullptr, {}));

  options.threads = 3;

  EXPECT_EQ(text_of(study_recordings(options, nullptr, {})), one);
}

TEST_F(RecordingsStudy, GoesOnWhereItWasCancelled) {
  copy("swing_plain", "a");
  copy("swing_breeze", "b");
  RecordingsStudyOptions options = quick();
  const std::string whole = text_of(study_recordings(options, nullptr, {}));
  const fs::path file = scratch_.path() / "journal";
  {
    Journal journal(file, options.key(), JournalStart::fresh);
    const auto one_fit = [](const Progress& progress) { return progress.done < 1; };
    EXPECT_THROW(study_recordings(options, &journal, one_fit), Cancelled);
  }

  Journal journal(file, options.key(), JournalStart::resume);
  EXPECT_EQ(journal.finished().size(), 1u);  // one of the two fits
  const std::vector<StudyRow> resumed = study_recordings(options, &journal, {});

  EXPECT_EQ(text_of(resumed), whole);
  // Nothing remains to be done: even the seconds are those of the journal.
  EXPECT_EQ(rows_to_text(study_recordings(options, &journal, {})), rows_to_text(resumed));
}

TEST_F(RecordingsStudy, HasAKeyThatNamesWhatItsRowsDependOn) {
  add_broken("broken");
  const RecordingsStudyOptions options = quick();
  std::set<std::string> keys{options.key()};
  const auto add_key_of = [&](auto change) {
    RecordingsStudyOptions other = options;
    change(other);
    keys.insert(other.key());
  };

  add_key_of([](RecordingsStudyOptions& other) { other.fit.seed = 2; });
  add_key_of([](RecordingsStudyOptions& other) { other.fit.search = SearchMethod::cma; });
  add_key_of([](RecordingsStudyOptions& other) { other.fit.search_share = 1; });
  add_key_of([](RecordingsStudyOptions& other) { other.fit.marker_offset_sigma_m = 0.01; });
  add_key_of([](RecordingsStudyOptions& other) { other.models[0].marker_offsets = true; });
  add_key_of([](RecordingsStudyOptions& other) { other.published["broken"] = 0.01; });
  std::ofstream(folder_ / "broken" / "recording.yaml", std::ios::app) << "# changed\n";
  add_key_of([](RecordingsStudyOptions&) {});

  EXPECT_EQ(keys.size(), 8u);
  EXPECT_EQ(options.key(), RecordingsStudyOptions(options).key());
}

TEST_F(RecordingsStudy, WeightsOfOneForEveryMarkerLeaveTheErrorOfTheWholeRecording) {
  copy("swing_plain", "plain");
  RecordingsStudyOptions options = quick();
  options.weights.emplace();
  for (const Marker& marker : read_recording(folder_ / "plain").markers.markers)
    (*options.weights)[marker.name] = 1;

  const StudyRow row = study_recordings(options, nullptr, {}).front();

  // No marker drives the cloth here, and hardly one is missed in any frame. Means over markers of
  // means over frames are therefore the mean over all to a few thousandths.
  ASSERT_TRUE(row.fitted) << row.reason;
  EXPECT_NEAR(row.weighted_rms, row.whole_rms, 5e-3 * row.whole_rms);
  EXPECT_NEAR(row.weighted_rigid_rms, row.whole_rigid_rms, 5e-3 * row.whole_rigid_rms);
}

TEST_F(RecordingsStudy, AMarkerThatDrivesTheClothIsOffByWhatSmoothingItsTrackTookAway) {
  copy("swing_plain", "plain", HeldMotion::tracked);
  RecordingsStudyOptions options = quick();
  const Recording recording = read_recording(folder_ / "plain");
  const Eigen::Vector2d at_m = recording.held.front().at_m;
  options.weights.emplace();
  for (const Marker& marker : recording.markers.markers)
    if (std::hypot(marker.s_m - at_m.x(), marker.t_m - at_m.y()) < 1e-6)
      (*options.weights)[marker.name] = 1;
  ASSERT_EQ(options.weights->size(), 1u);

  const StudyRow row = study_recordings(options, nullptr, {}).front();

  // The corner stands still, so its residual is its noise, 0.5 mm in each coordinate.
  ASSERT_TRUE(row.fitted) << row.reason;
  EXPECT_NEAR(row.weighted_rms, std::sqrt(3) * 5e-4, 3e-4);
}

TEST_F(RecordingsStudy, WeightsForAnotherSetOfMarkersAreAReasonInTheTable) {
  copy("swing_plain", "plain");
  RecordingsStudyOptions options = quick();
  options.weights = MarkerWeights{{"nobody", 1.0}};

  const StudyRow row = study_recordings(options, nullptr, {}).front();

  EXPECT_FALSE(row.fitted);
  EXPECT_THAT(row.reason, HasSubstr("nobody"));
}

TEST_F(RecordingsStudy, CountsWhatIsBelowTheRigidGuessAndThePublishedError) {
  copy("swing_plain", "plain");
  RecordingsStudyOptions options = quick();
  options.fit.marker_offset_sigma_m = 0.01;
  options.models.push_back({.name = "offset", .effects = {}, .marker_offsets = true});
  options.weights.emplace();
  for (const Marker& marker : read_recording(folder_ / "plain").markers.markers)
    (*options.weights)[marker.name] = 1;
  options.published["swing_plain"] = 1e-9;  // nothing is as good

  const std::vector<StudyRow> rows = study_recordings(options, nullptr, {});

  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].published_rms, 1e-9);
  // The offsets remove constant errors from the held-out frames as well.
  EXPECT_NE(rows[1].weighted_rms, rows[0].weighted_rms);
  const std::string rigid = rows[0].weighted_rms < rows[0].weighted_rigid_rms ? "1 of 1" : "0 of 1";
  EXPECT_THAT(study_contest(rows).rows.front(),
              ElementsAre("base", rigid, "0 of 1", "0 of 1", "1 of 1"));
  EXPECT_THAT(study_page_html(rows, "command"), HasSubstr("below the lower of both"));
}

TEST_F(RecordingsStudy, RefusesOffsetsWithoutADeviationAndPublishedErrorsWithoutWeights) {
  RecordingsStudyOptions options;
  options.models = {{.name = "offset", .effects = {}, .marker_offsets = true}};
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<InputError>(HasSubstr("--marker-offsets: is 0")));
  options.threads = -1;
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<InputError>(HasSubstr("--threads: is out of range")));
  options.threads = 0;
  options.fit.marker_offset_sigma_m = 0.01;
  options.published["any"] = 0.01;
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<InputError>(HasSubstr("without --weights")));
}

TEST(PublishedErrorsFile, IsRefusedWhereItMakesNoSense) {
  const test::ScratchFolder scratch("published_errors");
  const fs::path file = scratch.path() / "published.csv";
  const auto read = [&](const std::string& rows) {
    std::ofstream(file) << "recording,weighted_rms_m\n" << rows;
    return read_published_errors(file);
  };

  EXPECT_THAT(read("a,0.012\nb,0.03\n"), ElementsAre(Pair("a", 0.012), Pair("b", 0.03)));
  EXPECT_THROW(read("a,0\n"), InputError);
  EXPECT_THROW(read("a,0.01\na,0.02\n"), InputError);
  EXPECT_THROW(read(""), InputError);
}

TEST(MarkerWeightsFile, IsRefusedWhereItMakesNoSense) {
  const test::ScratchFolder scratch("marker_weights");
  const fs::path file = scratch.path() / "weights.csv";
  const auto read = [&](const std::string& rows) {
    std::ofstream(file) << "marker,weight\n" << rows;
    return read_marker_weights(file);
  };

  EXPECT_EQ(read("a,1\nb,0.25\n"), (MarkerWeights{{"a", 1}, {"b", 0.25}}));
  EXPECT_THROW(read("a,-1\n"), InputError);
  EXPECT_THROW(read("a,1\na,1\n"), InputError);
  EXPECT_THROW(read("a,0\n"), InputError);
  EXPECT_THROW(read(""), InputError);
}

}  // namespace
}  // namespace clothfit
