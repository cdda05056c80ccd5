#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace clothfit {

/// The action of a verb; returns an exit code.
using VerbAction = std::function<int()>;

/// Target of an option's text once it is parsed. Lists take several texts; an empty std::optional
/// stays empty where the option is not given.
using OptionTarget = std::variant<int*, unsigned long long*, double*, std::optional<double>*,
                                  std::string*, std::filesystem::path*, std::vector<std::string>*,
                                  std::vector<std::filesystem::path>*>;

/// Returns nothing, or what is wrong with the text of an option.
using TextCheck = std::function<std::string(const std::string& text)>;

struct ParsedCommandLine;

/// An option or flag of a verb. It is a handle: copies mean the same option.
class Option {
 public:
  Option required() const;
  /// Sets the name of its value in help: "DIR".
  Option type_name(const std::string& name) const;
  /// Makes help show the value that the target holds now.
  Option shows_default() const;
  Option check(const TextCheck& check) const;
  Option one_of(const std::vector<std::string>& texts) const;
  /// Takes lengths such as 10mm, 1cm, 0.01m or 0.01, in metres.
  Option is_length() const;
  /// Takes one value each time that it is given.
  Option one_at_a_time() const;
  Option needs(Option other) const;
  Option excludes(Option other) const;
  /// Tells Verb::command_text to leave the option out: results are the same with and without it.
  Option shapes_no_result() const;

 private:
  friend class Verb;
  Option(CLI::Option* option, ParsedCommandLine* parsed) : option_(option), parsed_(parsed) {}
  CLI::Option* option_;
  ParsedCommandLine* parsed_;
};

/// A verb with its options. It is a handle: copies mean the same verb, which lives as long as the
/// CommandLine.
class Verb {
 public:
  Verb add_verb(const std::string& name, const std::string& what);
  /// Requires that one of its verbs is named.
  void requires_verb();
  /// Adds an option: `name` is "--NAME", or a bare word for an argument told by its place.
  Option add_option(const std::string& name, OptionTarget target, const std::string& what);
  Option add_flag(const std::string& name, bool& given, const std::string& what);
  /// Returns an option that was added before.
  Option option(const std::string& name) const;
  /// Sets the end of the help text.
  void footer(const std::string& text);
  /// Sets the action to run where this verb is named.
  void runs(VerbAction action);

  bool is_given(const std::string& name) const;
  /// Returns verb and options as given, for results to keep: "clothfit fit swing_plain --seed 2".
  /// Words that a shell would take apart are quoted.
  std::string command_text() const;
  /// Returns the same for a verb beside this one: with the arguments, and with those of the options
  /// that it has too.
  std::string command_text_as(const std::string& other) const;

 private:
  friend class CommandLine;
  Verb(CLI::App* app, ParsedCommandLine* parsed) : app_(app), parsed_(parsed) {}
  CLI::App* app_;
  ParsedCommandLine* parsed_;
};

/// The command line of the program. Only its source file includes CLI11, because that library is
/// expensive to compile.
class CommandLine {
 public:
  CommandLine(const std::string& what, const std::string& name, const std::string& version);
  ~CommandLine();
  Verb program();

  /// Parses the arguments. Sets the exit code after printing help, the version, or what is wrong
  /// with the arguments; otherwise sets the action of the named verb.
  struct Parsed {
    std::optional<int> exit_code;
    VerbAction action;
  };
  Parsed parse(int argc, char** argv);

 private:
  std::unique_ptr<CLI::App> app_;
  std::unique_ptr<ParsedCommandLine> parsed_;
};

}  // namespace clothfit
