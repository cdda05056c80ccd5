#include "data/input_error.h"

#include <utility>

#include "data/shown_text.h"

namespace clothfit {
namespace {

std::string sentence(const std::string& where, const std::string& problem,
                     const std::string& expected, const std::string& remedy) {
  std::string text = where + ": " + problem;
  if (!expected.empty()) text += "; " + expected;
  if (!remedy.empty()) text += "; " + remedy;
  // A path of the user's may hold what a terminal takes for commands.
  return without_controls(std::move(text));
}

}  // namespace

InputError::InputError(const std::string& where, const std::string& problem,
                       const std::string& expected, const std::string& remedy)
    : std::runtime_error(sentence(where, problem, expected, remedy)),
      where_(where),
      problem_(problem),
      expected_(expected),
      remedy_(remedy) {}

InputError::InputError(const std::string& file, int line, const std::string& problem,
                       const std::string& expected, const std::string& remedy)
    : InputError(file + ":" + std::to_string(line), problem, expected, remedy) {}

}  // namespace clothfit
