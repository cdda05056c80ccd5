#include "apps/terminal/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "apps/terminal/exit_code.h"
#include "data/nearest_name.h"

namespace clothfit {

/// Receives what options and verbs report while arguments are parsed.
struct ParsedCommandLine {
  VerbAction action;
  std::set<const CLI::Option*> shape_no_result;
};

namespace {

/// Returns a word as a shell takes it whole.
std::string in_shell(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./=,:+-@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char letter : word)
    if (letter == '\'')
      quoted += "'\\''";
    else
      quoted += letter;
  return quoted + "'";
}

}  // namespace

Option Option::required() const {
  option_->required();
  return *this;
}

Option Option::type_name(const std::string& name) const {
  option_->type_name(name);
  return *this;
}

Option Option::shows_default() const {
  option_->capture_default_str();
  return *this;
}

Option Option::check(const TextCheck& check) const {
  option_->check(check);
  return *this;
}

Option Option::one_of(const std::vector<std::string>& texts) const {
  option_->transform(CLI::IsMember(texts, CLI::ignore_case));
  return *this;
}

Option Option::is_length() const {
  option_->transform(
      CLI::AsNumberWithUnit(std::map<std::string, double>{{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}}));
  return *this;
}

Option Option::one_at_a_time() const {
  option_->allow_extra_args(false);
  return *this;
}

Option Option::needs(Option other) const {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::shapes_no_result() const {
  parsed_->shape_no_result.insert(option_);
  return *this;
}

Verb Verb::add_verb(const std::string& name, const std::string& what) {
  return {app_->add_subcommand(name, what), parsed_};
}

void Verb::requires_verb() {
  app_->require_subcommand(1);
}

Option Verb::add_option(const std::string& name, OptionTarget target, const std::string& what) {
  CLI::Option* option =
      std::visit([&](auto* value) { return app_->add_option(name, *value, what); }, target);
  return {option, parsed_};
}

Option Verb::add_flag(const std::string& name, bool& given, const std::string& what) {
  return {app_->add_flag(name, given, what), parsed_};
}

Option Verb::option(const std::string& name) const {
  return {app_->get_option(name), parsed_};
}

void Verb::footer(const std::string& text) {
  app_->footer(text);
}

void Verb::runs(VerbAction action) {
  app_->callback([parsed = parsed_, action = std::move(action)] { parsed->action = action; });
}

bool Verb::is_given(const std::string& name) const {
  return app_->count(name) > 0;
}

std::string Verb::command_text() const {
  return command_text_as(app_->get_name());
}

std::string Verb::command_text_as(const std::string& other) const {
  std::string text = other;
  for (const CLI::App* parent = app_->get_parent(); parent != nullptr;
       parent = parent->get_parent())
    text = parent->get_name() + " " + text;
  const CLI::App* verb = app_->get_parent()->get_subcommand(other);
  for (const CLI::Option* option : app_->get_options()) {
    if (option->count() == 0 || parsed_->shape_no_result.contains(option)) continue;
    const bool is_argument = option->get_positional();
    if (!is_argument && verb->get_option_no_throw(option->get_name()) == nullptr) continue;
    if (option->get_items_expected_max() == 0) {
      text += " " + option->get_name();
      continue;
    }
    for (const std::string& value : option->results())
      text += (is_argument ? " " : " " + option->get_name() + " ") + in_shell(value);
  }
  return text;
}

CommandLine::CommandLine(const std::string& what, const std::string& name,
                         const std::string& version)
    : app_(std::make_unique<CLI::App>(what, name)), parsed_(std::make_unique<ParsedCommandLine>()) {
  app_->set_version_flag("--version", version);
}

CommandLine::~CommandLine() = default;

Verb CommandLine::program() {
  return {app_.get(), parsed_.get()};
}

CommandLine::Parsed CommandLine::parse(int argc, char** argv) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app_->get_subcommands({})) verbs.push_back(verb->get_name());
  const std::string first = argc > 1 ? argv[1] : "-";
  if (!first.starts_with('-') && std::ranges::find(verbs, first) == verbs.end()) {
    fmt::print(stderr, "There is no verb `{}`; {}\n", first, known_names(first, verbs));
    return {.exit_code = kExitWrongUsage, .action = {}};
  }
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return {.exit_code = app_->exit(error) == 0 ? kExitGood : kExitWrongUsage, .action = {}};
  }
  return {.exit_code = std::nullopt, .action = parsed_->action};
}

}  // namespace clothfit
