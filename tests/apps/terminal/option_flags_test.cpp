// Checks that messages of the library reach the command line in its own words.
#include "apps/terminal/option_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

namespace clothfit {
namespace {

namespace fs = std::filesystem;

const fs::path kSources = CLOTHFIT_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Returns what `pattern` captures in the sources below a folder.
std::set<std::string> captures(const fs::path& folder, const std::string& pattern) {
  const std::regex expression(pattern);
  std::set<std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(kSources / folder)) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end;
         ++match)
      found.insert((*match)[1]);
  }
  return found;
}

TEST(OptionFlags, ReplaceMembersByFlags) {
  EXPECT_EQ(with_flags("FitOptions::drive_knots: is out of range"),
            "--drive-knots: is out of range");
  EXPECT_EQ(with_flags("use FitOptions::cost = shooting, or DiagnoseOptions::beam_width"),
            "use --cost shooting, or --lines");
  EXPECT_EQ(with_flags("FitOptions::priors = mass: twice"), "--prior mass: twice");
  EXPECT_EQ(with_flags("TagSheetOptions::tag_m: 3 m"), "--tag: 3 m");
}

TEST(OptionFlags, LeaveOtherWordsAlone) {
  const std::string text = "cloth.yaml:12: mass = -0.02; a mass is in kilograms, > 0";
  EXPECT_EQ(with_flags(text), text);
  EXPECT_EQ(with_flags(""), "");
}

// A member without a flag would send a user to an option that is not there.
TEST(OptionFlags, ExistForEveryMemberThatTheLibraryNames) {
  const std::set<std::string> flags = captures("apps/verbs", "\"(--[a-z-]+)\"");
  const std::regex member_name("(?:[A-Z][A-Za-z]*Options|JournalStart)::[a-z_]+");
  std::set<std::string> members;
  for (const char* room : {"fit", "vision/look", "vision/print"})
    for (const std::string& text : captures(room, "\"([^\"\n]*)\""))
      for (std::sregex_iterator match(text.begin(), text.end(), member_name), end; match != end;
           ++match)
        members.insert(match->str());
  ASSERT_GE(members.size(), 8u);
  for (const std::string& member : members)
    EXPECT_THAT(flags, ::testing::Contains(with_flags(member)));

  const std::set<std::string> bounded = captures("fit", "require\\([^;]*, \"([a-z_]+)\",\\s");
  ASSERT_GE(bounded.size(), 20u);
  for (const std::string& member : bounded) {
    if (member == "coarse_beyond") continue;  // the verbs set it
    EXPECT_THAT(flags, ::testing::Contains(with_flags("FitOptions::" + member)));
  }
}

// The rooms below are libraries, which know no command line.
TEST(OptionFlags, AreKnownToTheProgramAlone) {
  for (const char* room : {"data", "calib", "vision", "model", "fit"})
    EXPECT_THAT(captures(room, "\"(?:[^\"\n]* )?[(]?(--[a-z-]+)[^\"\n]*\""),
                ::testing::IsSubsetOf({"--undeclared"}))  // a study that a threshold came from
        << room;
}

}  // namespace
}  // namespace clothfit
