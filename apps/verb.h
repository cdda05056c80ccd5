#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>

namespace clothfit {

enum class ObservationKind;
struct ParameterPrior;

/// What the chosen verb does; returns an exit code.
using VerbAction = std::function<int()>;

/// Each adds its verb to the command line. Parsing sets `action` to the one that was chosen, bound
/// to its options.
void add_calibrate_verb(CLI::App& program, VerbAction& action);
void add_track_verb(CLI::App& program, VerbAction& action);
void add_fit_verb(CLI::App& program, VerbAction& action);
void add_diagnose_verb(CLI::App& program, VerbAction& action);
void add_simulate_verb(CLI::App& program, VerbAction& action);
void add_recover_verb(CLI::App& program, VerbAction& action);
void add_demo_verb(CLI::App& program, VerbAction& action);
void add_experiment_verb(CLI::App& program, VerbAction& action);
void add_study_verb(CLI::App& program, VerbAction& action);

/// For CLI11: empty, or what is wrong with the text of --seed. (It wraps a negative number into a
/// huge one.)
std::string check_seed(const std::string& text);

/// What --observations names: tracks3d, tracks2d, or anything else for automatic.
ObservationKind parse_observations(const std::string& text);

/// Binds --out, whose default is `default_name` in the current directory.
void add_out_option(CLI::App& verb, std::filesystem::path& out, const std::string& default_name);

/// Binds --prior; each text is for parse_prior.
void add_prior_option(CLI::App& verb, std::vector<std::string>& priors);

/// PARAMETER=MEAN,SIGMA. Throws InputError.
ParameterPrior parse_prior(const std::string& text);

/// Turns a length such as 10mm, 1cm, 0.01m or 0.01 into metres.
CLI::AsNumberWithUnit length_in_metres();

/// The folder that was asked for, or `default_name` in the current directory.
std::filesystem::path out_folder(const std::filesystem::path& asked,
                                 const std::string& default_name);

/// Path of a result as the user can type it: relative to the current directory where that is
/// shorter.
std::string shown_path(const std::filesystem::path& path);

/// The recording's folder from what was typed: the folder, or its recording.yaml.
std::filesystem::path recording_folder(const std::filesystem::path& typed);

}  // namespace clothfit
