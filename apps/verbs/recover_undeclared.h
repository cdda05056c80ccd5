#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/study/trials/undeclared.h"
#include "apps/terminal/command_line.h"

namespace clothfit {

/// Flags of `clothfit recover --undeclared` beyond those of `clothfit recover`.
struct UndeclaredFlags {
  bool undeclared = false;
  std::vector<std::string> hidden;  ///< effects, or modes as "EFFECT:LAW"; empty: the library
  bool clean = false, pairs = false, withhold = false, same_model = false;
  std::string integrator = "runge-kutta";
  int fitted = 0;  ///< frames; 0: three quarters
  double least_sigmas = DrawOptions{}.least, most_sigmas = DrawOptions{}.most;
  double most_mimicked = UndeclaredOptions{}.most_mimicked;
  int lines = DiagnoseOptions{}.beam_width, refits = DiagnoseOptions{}.refits;
};

void add_undeclared_options(Verb verb, UndeclaredFlags& flags);

/// The options from recover's own flags, and the place of the results.
struct UndeclaredRun {
  SyntheticScene scene;
  FitOptions fit;
  int trials = 20;
  unsigned long long seed = 1;
  int threads = 0;
  std::string command;
  std::filesystem::path out, journal;
  bool resume = false;
};

/// Runs the study, prints its tables and leaves its files. Throws InputError.
int run_undeclared(const UndeclaredFlags& flags, const UndeclaredRun& run);

}  // namespace clothfit
