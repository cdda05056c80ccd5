// Checks the parsing of arguments. Not checked here: the program's own verbs (program_test.cpp).

#include "apps/terminal/command_line.h"

#include <gtest/gtest.h>

#include "apps/terminal/exit_code.h"

namespace clothfit {
namespace {

/// Parses "weave ..." by a program with one verb.
struct Weaver {
  CommandLine line{"Weaves.", "weave", "weave 1"};
  Verb verb = line.program().add_verb("cloth", "Weaves a cloth");
  std::string folder;
  std::vector<std::string> colours;
  double width_m = 1;
  int threads = 0;
  bool dry = false;
  std::string command;

  Weaver() {
    verb.add_option("folder", &folder, "Where to").required();
    verb.add_option("--colour", &colours, "Colours").one_of({"red", "blue"});
    verb.add_option("--width", &width_m, "Width").is_length();
    verb.add_option("--threads", &threads, "Threads").shapes_no_result();
    verb.add_flag("--dry", dry, "Weave nothing").excludes(verb.option("--colour"));
    verb.runs([this] {
      command = verb.command_text();
      return 7;
    });
  }

  CommandLine::Parsed parse(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "weave");
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    return line.parse(static_cast<int>(pointers.size()), pointers.data());
  }
};

TEST(CommandLine, RunsTheVerbThatIsNamedWithItsOptions) {
  Weaver weaver;
  const CommandLine::Parsed parsed =
      weaver.parse({"cloth", "here", "--colour", "red", "--width", "40mm", "--colour", "blue"});
  ASSERT_FALSE(parsed.exit_code.has_value());
  EXPECT_EQ(parsed.action(), 7);
  EXPECT_EQ(weaver.folder, "here");
  EXPECT_EQ(weaver.colours, (std::vector<std::string>{"red", "blue"}));
  EXPECT_DOUBLE_EQ(weaver.width_m, 0.04);
  EXPECT_TRUE(weaver.verb.is_given("--width"));
  EXPECT_FALSE(weaver.verb.is_given("--threads"));
}

TEST(CommandLine, WritesACommandForAnotherVerbAsAShellTakesIt) {
  Weaver weaver;
  Verb carpet = weaver.line.program().add_verb("carpet", "Weaves a carpet");
  std::vector<std::string> colours;
  carpet.add_option("--colour", &colours, "Colours");
  std::string text;
  weaver.verb.runs([&] {
    text = weaver.verb.command_text_as("carpet");
    return 0;
  });
  const CommandLine::Parsed parsed =
      weaver.parse({"cloth", "my mother's", "--colour", "red", "--width", "40mm"});
  ASSERT_TRUE(parsed.action);
  parsed.action();
  EXPECT_EQ(text, R"(weave carpet 'my mother'\''s' --colour red)");
}

TEST(CommandLine, KeepsOfACommandWhatShapesItsResult) {
  Weaver weaver;
  const CommandLine::Parsed parsed =
      weaver.parse({"cloth", "--threads", "3", "here", "--colour", "red", "--colour", "blue"});
  ASSERT_TRUE(parsed.action);
  parsed.action();
  EXPECT_EQ(weaver.command, "weave cloth here --colour red --colour blue");
}

TEST(CommandLine, SaysWhatIsWrongAndRunsNothing) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"clot", "here"},
                                                    {"cloth"},
                                                    {"cloth", "here", "--colour", "green"},
                                                    {"cloth", "here", "--dry", "--colour", "red"},
                                                    {"cloth", "here", "--wdth", "1"}}) {
    Weaver weaver;
    testing::internal::CaptureStderr();
    const CommandLine::Parsed parsed = weaver.parse(arguments);
    EXPECT_FALSE(testing::internal::GetCapturedStderr().empty()) << arguments.back();
    EXPECT_EQ(parsed.exit_code, kExitWrongUsage) << arguments.back();
    EXPECT_FALSE(parsed.action) << arguments.back();
  }
}

TEST(CommandLine, EndsWellWhereHelpOrTheVersionIsAskedFor) {
  for (const char* argument : {"--help", "--version"}) {
    Weaver weaver;
    testing::internal::CaptureStdout();
    const CommandLine::Parsed parsed = weaver.parse({argument});
    EXPECT_FALSE(testing::internal::GetCapturedStdout().empty());
    EXPECT_EQ(parsed.exit_code, kExitGood);
    EXPECT_FALSE(parsed.action);
  }
}

}  // namespace
}  // namespace clothfit
