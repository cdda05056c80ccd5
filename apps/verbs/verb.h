#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/terminal/command_line.h"
#include "data/recording.h"

namespace clothfit {

enum class ObservationKind;
struct ParameterPrior;

/// Each adds its verb, with its options and its action, to the command line.
void add_calibrate_verb(Verb program);
void add_track_verb(Verb program);
void add_check_verb(Verb program);
void add_fit_verb(Verb program);
void add_diagnose_verb(Verb program);
void add_init_verb(Verb program);
void add_sheet_verb(Verb program);
void add_simulate_verb(Verb program);
void add_recover_verb(Verb program);
void add_demo_verb(Verb program);
void add_detect_verb(Verb program);
void add_drape_verb(Verb program);
void add_experiment_verb(Verb program);
void add_study_verb(Verb program);

/// Returns nothing, or what is wrong with the text of --seed. CLI11 wraps a negative number into a
/// huge one.
std::string check_seed(const std::string& text);

/// Returns what --observations names: tracks3d, tracks2d, or anything else for automatic.
ObservationKind parse_observations(const std::string& text);

/// Binds --out, whose default is `default_name` in the current directory.
void add_out_option(Verb verb, std::filesystem::path& out, const std::string& default_name);

/// Binds --allow-outside.
void add_outside_option(Verb verb, bool& allow_outside);
OutsideFiles outside_files(bool allow_outside);

/// Reads the recording that was typed: its folder, or its recording.yaml. Throws InputError.
Recording typed_recording(const std::filesystem::path& typed, bool allow_outside);

/// Binds --prior; each text is for parse_prior.
void add_prior_option(Verb verb, std::vector<std::string>& priors);

/// Reads PARAMETER=MEAN,SIGMA. Throws InputError.
ParameterPrior parse_prior(const std::string& text);

/// Returns the folder that was asked for, or `default_name` in the current directory.
std::filesystem::path out_folder(const std::filesystem::path& asked,
                                 const std::string& default_name);

/// Returns the path of a result as the user can type it: relative to the current directory where
/// that is shorter.
std::string shown_path(const std::filesystem::path& path);

/// Returns the recording's folder from what was typed: the folder, or its recording.yaml.
std::filesystem::path recording_folder(const std::filesystem::path& typed);

}  // namespace clothfit
