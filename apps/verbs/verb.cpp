#include "apps/verbs/verb.h"

#include "data/input_error.h"
#include "data/number_text.h"
#include "fit/interface/fit_options.h"

namespace clothfit {

namespace fs = std::filesystem;

void add_out_option(Verb verb, std::filesystem::path& out, const std::string& default_name) {
  verb.add_option("--out", &out, "Folder for the results (default: " + default_name + ")")
      .type_name("DIR")
      .shapes_no_result();
}

void add_outside_option(Verb verb, bool& allow_outside) {
  verb.add_flag("--allow-outside", allow_outside,
                "Let the recording name tables, cameras, held paths and obstacles outside its "
                "folder, which results hold copies of")
      .shapes_no_result();
}

OutsideFiles outside_files(bool allow_outside) {
  return allow_outside ? OutsideFiles::allowed : OutsideFiles::refused;
}

Recording typed_recording(const fs::path& typed, bool allow_outside) {
  return read_recording(recording_folder(typed), outside_files(allow_outside));
}

void add_prior_option(Verb verb, std::vector<std::string>& priors) {
  verb.add_option("--prior", &priors,
                  "What is known of a parameter from elsewhere, its mean and standard deviation in "
                  "its unit: clock_offset.time=0,0.002; may be repeated")
      .type_name("PARAMETER=MEAN,SIGMA");
}

ParameterPrior parse_prior(const std::string& text) {
  const size_t equals = text.find('='), comma = text.find(',');
  if (equals < comma && comma < text.size()) {
    const auto mean = parse_number(text.substr(equals + 1, comma - equals - 1));
    const auto sigma = parse_number(text.substr(comma + 1));
    if (mean && sigma && *sigma > 0)
      return {.name = text.substr(0, equals), .mean = *mean, .sigma = *sigma};
  }
  throw InputError("--prior", "'" + text + "' is not a prior",
                   "PARAMETER=MEAN,SIGMA without spaces, SIGMA more than 0, such as "
                   "clock_offset.time=0,0.002");
}

std::filesystem::path out_folder(const std::filesystem::path& asked,
                                 const std::string& default_name) {
  return asked.empty() ? fs::path(default_name) : asked;
}

std::string shown_path(const std::filesystem::path& path) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  const fs::path relative = whole.lexically_relative(fs::current_path());
  const bool below = !relative.empty() && *relative.begin() != "..";
  return (below ? relative : whole).string();
}

std::filesystem::path recording_folder(const std::filesystem::path& typed) {
  return typed.filename() == "recording.yaml" ? fs::absolute(typed).parent_path() : typed;
}

std::string check_seed(const std::string& text) {
  return text.starts_with('-') ? "'" + text + "' is not a seed: a whole number, 0 or more" : "";
}

ObservationKind parse_observations(const std::string& text) {
  if (text == "tracks3d") return ObservationKind::tracks3d;
  if (text == "tracks2d") return ObservationKind::tracks2d;
  return ObservationKind::automatic;
}

}  // namespace clothfit
