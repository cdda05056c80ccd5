#pragma once

#include <stdexcept>
#include <string>

namespace clothfit {

/// A mistake of the user's, told so that the user can correct it:
///
///   cloth.yaml:12: mass = -0.02; a mass is in kilograms, > 0; weigh the dry cloth
///
/// The program ends with exit code 3 on it. Our own mistakes are assertions, and numbers that do
/// not work out are reason codes; neither is an InputError.
class InputError : public std::runtime_error {
 public:
  /// `where` is FILE, FILE:LINE, or an option: a member of its struct, in the program its flag;
  /// `remedy` may be empty.
  InputError(const std::string& where, const std::string& problem, const std::string& expected,
             const std::string& remedy = "");
  /// Refuses line `line` (counted from 1) of `file`.
  InputError(const std::string& file, int line, const std::string& problem,
             const std::string& expected, const std::string& remedy = "");

  const std::string& where() const { return where_; }
  const std::string& problem() const { return problem_; }
  const std::string& expected() const { return expected_; }
  const std::string& remedy() const { return remedy_; }

 private:
  std::string where_, problem_, expected_, remedy_;
};

}  // namespace clothfit
