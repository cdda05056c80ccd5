// Checks fit.json. The truth of its numbers is the matter of tests/fit/.

#include "data/fit_result.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

FitResult sample_result() {
  FitResult result;
  result.recording = "swing_plain";
  result.version = "0.1.0";
  result.command = "fit . --seed 7";
  result.seed = 18446744073709551615ull;
  result.seconds = 12.3;
  result.mesh_columns = 17;
  result.mesh_rows = 9;
  result.parameter_set = "fabric";
  result.integrator = "euler";
  result.substeps = 8;
  result.time_step_s = 1.0 / 480;
  result.start = "released_flat";
  result.parameters = {
      {"tension_warp", "N/m", 41.2, 0.6, ParameterState::fitted, ""},
      {"areal_density", "kg/m2", 0.2, 0, ParameterState::fixed, "weighed"},
      {"flexion_weft", "N/m", 0.1 + 0.2, 5, ParameterState::undetermined, "hidden by \"noise\""}};
  result.parameters.front().interval_90 = {.lower = 40.1, .upper = 42 + 1.0 / 3};
  result.parameters.front().interval_by_profile = true;
  result.parameters.front().bootstrap_90 = {.lower = 40.3, .upper = 42.4};
  result.parameters.front().mesh_shift = -0.7;
  result.effects = {{"wind", {{"q_x", "Pa", 0.25, 0.01, ParameterState::fitted, ""}}}};
  result.nuisance = {{"tilt_x", "rad", 1e-4, 1e-5, ParameterState::fitted, ""}};
  result.errors = {{"front", "px", {0.3, 0.42, 1000}, {0.5, 0.7, 400}, 0.29, {21, 30, 25}}};
  result.clouds = CloudErrors{.fitted = {1e-5, 35}, .held_out = {1.0 / 3, 15}, .all = {0.1, 50}};
  result.marker_offset_sigma_m = 0.01;
  result.marker_offsets = {{"m7", {1e-3, -2e-3, 1.0 / 3}}, {"m2", {0, 0, 0.1}}};
  result.basins = {
      {.cost = 1.6, .ended = 3, .parameters = {{"tension_warp", 41.1}, {"wind.q_x", 1.0 / 3}}},
      {.cost = 4.5, .ended = 1, .refined = false, .parameters = {{"tension_warp", 90}}}};
  result.observations_used = 1400;
  result.observations_rejected = {{"blurred", 3}, {"too far", 1}};
  return result;
}

void expect_same(const std::optional<Interval>& a, const std::optional<Interval>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (!a) return;
  EXPECT_EQ(a->lower, b->lower);
  EXPECT_EQ(a->upper, b->upper);
}

void expect_same(const CloudErrors::Summary& a, const CloudErrors::Summary& b) {
  EXPECT_EQ(a.chamfer_m2, b.chamfer_m2);
  EXPECT_EQ(a.frames, b.frames);
}

void expect_same(const std::vector<ParameterEstimate>& a, const std::vector<ParameterEstimate>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].unit, b[i].unit);
    EXPECT_EQ(a[i].value, b[i].value);
    EXPECT_EQ(a[i].sigma, b[i].sigma);
    EXPECT_EQ(a[i].state, b[i].state);
    EXPECT_EQ(a[i].reason, b[i].reason);
    expect_same(a[i].interval_90, b[i].interval_90);
    EXPECT_EQ(a[i].interval_by_profile, b[i].interval_by_profile);
    expect_same(a[i].bootstrap_90, b[i].bootstrap_90);
    EXPECT_EQ(a[i].mesh_shift, b[i].mesh_shift);
  }
}

void expect_same(const ErrorSummary& a, const ErrorSummary& b) {
  EXPECT_EQ(a.rms, b.rms);
  EXPECT_EQ(a.rms_distance, b.rms_distance);
  EXPECT_EQ(a.count, b.count);
}

void expect_same(const FitResult& a, const FitResult& b) {
  EXPECT_EQ(a.recording, b.recording);
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.command, b.command);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.mesh_columns, b.mesh_columns);
  EXPECT_EQ(a.mesh_rows, b.mesh_rows);
  EXPECT_EQ(a.parameter_set, b.parameter_set);
  EXPECT_EQ(a.integrator, b.integrator);
  EXPECT_EQ(a.substeps, b.substeps);
  EXPECT_EQ(a.time_step_s, b.time_step_s);
  EXPECT_EQ(a.start, b.start);
  expect_same(a.parameters, b.parameters);
  ASSERT_EQ(a.effects.size(), b.effects.size());
  for (size_t i = 0; i < a.effects.size(); ++i) {
    EXPECT_EQ(a.effects[i].name, b.effects[i].name);
    expect_same(a.effects[i].parameters, b.effects[i].parameters);
  }
  expect_same(a.nuisance, b.nuisance);
  ASSERT_EQ(a.errors.size(), b.errors.size());
  for (size_t i = 0; i < a.errors.size(); ++i) {
    EXPECT_EQ(a.errors[i].kind, b.errors[i].kind);
    EXPECT_EQ(a.errors[i].unit, b.errors[i].unit);
    expect_same(a.errors[i].fitted, b.errors[i].fitted);
    expect_same(a.errors[i].held_out, b.errors[i].held_out);
    EXPECT_EQ(a.errors[i].noise, b.errors[i].noise);
    EXPECT_EQ(a.errors[i].trivial.first_frame, b.errors[i].trivial.first_frame);
    EXPECT_EQ(a.errors[i].trivial.last_velocity, b.errors[i].trivial.last_velocity);
    EXPECT_EQ(a.errors[i].trivial.rigid, b.errors[i].trivial.rigid);
  }
  ASSERT_EQ(a.clouds.has_value(), b.clouds.has_value());
  if (a.clouds) {
    expect_same(a.clouds->fitted, b.clouds->fitted);
    expect_same(a.clouds->held_out, b.clouds->held_out);
    expect_same(a.clouds->all, b.clouds->all);
  }
  EXPECT_EQ(a.marker_offset_sigma_m, b.marker_offset_sigma_m);
  ASSERT_EQ(a.marker_offsets.size(), b.marker_offsets.size());
  for (const MarkerOffset& offset : a.marker_offsets) {
    const auto same = std::ranges::find(b.marker_offsets, offset.marker, &MarkerOffset::marker);
    ASSERT_NE(same, b.marker_offsets.end());
    EXPECT_EQ(same->offset_m, offset.offset_m);
  }
  ASSERT_EQ(a.basins.size(), b.basins.size());
  for (size_t i = 0; i < a.basins.size(); ++i) {
    EXPECT_EQ(a.basins[i].cost, b.basins[i].cost);
    EXPECT_EQ(a.basins[i].ended, b.basins[i].ended);
    EXPECT_EQ(a.basins[i].refined, b.basins[i].refined);
    ASSERT_EQ(a.basins[i].parameters.size(), b.basins[i].parameters.size());
    for (size_t p = 0; p < a.basins[i].parameters.size(); ++p) {
      EXPECT_EQ(a.basins[i].parameters[p].name, b.basins[i].parameters[p].name);
      EXPECT_EQ(a.basins[i].parameters[p].value, b.basins[i].parameters[p].value);
    }
  }
  EXPECT_EQ(a.observations_used, b.observations_used);
  EXPECT_EQ(a.observations_rejected, b.observations_rejected);
}

TEST(FitJson, ReadsBackToTheLastBit) {
  const TemporaryFolder folder;
  const FitResult one_kind = sample_result();
  FitResult two_kinds = one_kind;
  two_kinds.errors.push_back({"side", "px", {0.4, 0.6, 10}, {}, 0.3, {}});
  FitResult no_kind = one_kind;
  no_kind.errors.clear();
  no_kind.clouds.reset();
  for (const FitResult& result : {one_kind, two_kinds, no_kind}) {
    SCOPED_TRACE(result.errors.size());

    write_fit_result(result, folder / "fit.json");

    expect_same(read_fit_result(folder / "fit.json"), result);
  }
}

TEST(FitJson, KeepsVerdictWarningsAndWhatContradicts) {
  const TemporaryFolder folder;
  FitResult written = sample_result();
  written.verdict = FitVerdict::model_lacks;
  written.verdict_reason = "it is off";
  written.next_command = "clothfit diagnose x";
  written.converged = false;
  written.contradicting = {{"m1", "tracks3d", 20, 71, 0.14}};
  written.warnings = {{"time", FindingState::warning, "found", "x.yaml:3", "expected", "remedy"}};
  written.errors.front().discretisation = 0.25;
  written.errors.front().discretisation_found = 0.125;
  written.errors.front().outliers = 3;
  written.contradicts_pose = true;
  written.errors.front().fitted_without = ErrorSummary{.rms = 0.2, .rms_distance = 0.3, .count = 9};
  written.parameters.front().state = ParameterState::misfit;
  written.parameters.back().state = ParameterState::ratio;

  write_fit_result(written, folder / "fit.json");
  const FitResult read = read_fit_result(folder / "fit.json");

  EXPECT_EQ(read.verdict, FitVerdict::model_lacks);
  EXPECT_FALSE(read.usable());
  EXPECT_EQ(read.verdict_reason, "it is off");
  EXPECT_EQ(read.next_command, "clothfit diagnose x");
  EXPECT_FALSE(read.converged);
  ASSERT_EQ(read.contradicting.size(), 1u);
  EXPECT_EQ(read.contradicting.front().last_frame, 71);
  ASSERT_EQ(read.warnings.size(), 1u);
  EXPECT_EQ(sentence(read.warnings.front()), "x.yaml:3: found; expected; remedy");
  EXPECT_EQ(read.errors.front().discretisation, 0.25);
  EXPECT_EQ(read.errors.front().discretisation_found, 0.125);
  EXPECT_EQ(read.errors.front().outliers, 3);
  EXPECT_TRUE(read.contradicts_pose);
  EXPECT_EQ(read.errors.front().fitted_without->count, 9);
  EXPECT_EQ(read.parameters.front().state, ParameterState::misfit);
  EXPECT_EQ(read.parameters.back().state, ParameterState::ratio);
}

TEST(FitResult, ScalesRatiosToTheMassOfACloth) {
  FitResult result;
  result.parameters = {
      {"areal_density", "kg/m2", 0.1, 0, ParameterState::undetermined, "not weighed"},
      {"shear", "N/m per kg/m2", 90, 2, ParameterState::ratio, "", Interval{86, 94}},
      {"damping_warp", "s", 0.002, 1e-4, ParameterState::fitted, ""}};
  result.effects = {
      {"wind", {{"q_x", "Pa per kg/m2", 1.2, 0.1, ParameterState::ratio, ""}}},
      {"support_slip", {{"mobility", "m/(N s) times kg/m2", 3, 0.2, ParameterState::ratio, ""}}}};

  const FitResult assumed = at_density(result, std::nullopt), weighed = at_density(result, 0.2);

  EXPECT_DOUBLE_EQ(assumed.parameters[1].value, 9);
  EXPECT_DOUBLE_EQ(weighed.parameters[1].value, 18);
  EXPECT_DOUBLE_EQ(weighed.parameters[1].interval_90->upper, 18.8);
  EXPECT_EQ(weighed.parameters[1].unit, "N/m");
  EXPECT_DOUBLE_EQ(weighed.effects[0].parameters[0].value, 0.24);
  EXPECT_DOUBLE_EQ(weighed.parameters[2].value, 0.002);
  EXPECT_DOUBLE_EQ(weighed.effects[1].parameters[0].value, 15);
  EXPECT_EQ(weighed.effects[1].parameters[0].unit, "m/(N s)");
}

TEST(FitResult, KnowsWhichUnitsGoWithTheMass) {
  EXPECT_EQ(mass_exponent("N/m"), 1);
  EXPECT_EQ(mass_exponent("Pa s/m"), 1);
  EXPECT_EQ(mass_exponent("m/(N s)"), -1);
  EXPECT_EQ(mass_exponent("m/s2"), 0);
  EXPECT_EQ(mass_exponent("1/s"), 0);
}

TEST(FitJson, KeepsAGuessThatCannotBeMade) {
  const TemporaryFolder folder;
  FitResult written = sample_result();
  written.errors.front().trivial.last_velocity = NAN;
  write_fit_result(written, folder / "fit.json");

  const TrivialErrors read = read_fit_result(folder / "fit.json").errors.front().trivial;
  EXPECT_TRUE(std::isnan(read.last_velocity));
  EXPECT_EQ(read.rigid, written.errors.front().trivial.rigid);
}

TEST(FitJson, HasTheKeysOfTheFormat) {
  const TemporaryFolder folder;
  write_fit_result(sample_result(), folder / "fit.json");

  const auto json = nlohmann::ordered_json::parse(std::ifstream(folder / "fit.json"));

  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_THAT(
      keys, testing::ElementsAre("format", "verdict", "verdict_reason", "next_command", "usable",
                                 "converged", "contradicts_pose", "warnings",
                                 "contradicting_markers", "recording", "version", "command", "seed",
                                 "seconds", "model", "parameters", "effects", "nuisance", "basins",
                                 "errors", "observations", "marker_offsets", "clouds"));
  EXPECT_EQ(json["format"], "clothfit-fit/1");
  EXPECT_EQ(json["model"]["mesh"]["rows"], 9);
  EXPECT_EQ(json["model"]["time_step_s"], 1.0 / 480);
  EXPECT_EQ(json["parameters"][2]["state"], "undetermined");
  EXPECT_EQ(json["parameters"][0]["interval_90"][0], 40.1);
  EXPECT_FALSE(json["parameters"][1].contains("interval_90"));
  EXPECT_EQ(json["effects"][0]["parameters"][0]["name"], "q_x");
  EXPECT_EQ(json["basins"][0]["parameters"]["wind.q_x"], 1.0 / 3);
  EXPECT_EQ(json["basins"][1]["refined"], false);
  ASSERT_TRUE(json["errors"].is_object());  // one kind; several make a list
  EXPECT_EQ(json["errors"]["kind"], "front");
  EXPECT_EQ(json["errors"]["held_out"]["rms_distance"], 0.7);
  EXPECT_EQ(json["errors"]["trivial"]["last_velocity"], 30);
  EXPECT_EQ(json["observations"]["rejected"]["too far"], 1);
  EXPECT_EQ(json["marker_offsets"]["offset_m"]["m7"][1], -2e-3);
}

TEST(FitJson, MayHoldMoreThanThisVersionKnows) {
  const TemporaryFolder folder;
  write_fit_result(sample_result(), folder / "fit.json");
  auto json = nlohmann::json::parse(std::ifstream(folder / "fit.json"));
  json["new"] = {1, 2};
  json["model"]["new"] = nullptr;
  json["parameters"][0].erase("reason");
  json.erase("nuisance");
  json.erase("basins");
  json["errors"].erase("kind");

  const FitResult result = read_fit_result(folder.write("fit.json", json.dump()));

  EXPECT_EQ(result.parameters.size(), 3u);
  EXPECT_EQ(result.errors[0].unit, "px");
}

TEST(FitJson, IsRefusedWhereAValueIsMissingOrOfAnotherKind) {
  const TemporaryFolder folder;
  write_fit_result(sample_result(), folder / "fit.json");
  const auto json = nlohmann::json::parse(std::ifstream(folder / "fit.json"));
  const auto expect = [&](const std::string& message, const auto& change) {
    nlohmann::json changed = json;
    change(changed);
    const auto file = folder.write("fit.json", changed.dump());
    expect_refused(folder, message, [&] { read_fit_result(file); });
  };

  expect("fit.json: `/format` is `clothfit-fit/2`",
         [](auto& j) { j["format"] = "clothfit-fit/2"; });
  expect("fit.json: `/marker_offsets/offset_m/m2` is no vector", [](auto& j) {
    j["marker_offsets"]["offset_m"]["m2"] = {1, 2};
  });
  expect("fit.json: `/model/mesh` is missing", [](auto& j) { j["model"].erase("mesh"); });
  expect("fit.json: `/parameters/1/value` is missing",
         [](auto& j) { j["parameters"][1].erase("value"); });
  expect("fit.json: `/parameters/0/interval_90` is no interval",
         [](auto& j) { j["parameters"][0]["interval_90"] = {1.0}; });
  expect("fit.json: `/parameters/1/value` is not a number",
         [](auto& j) { j["parameters"][1]["value"] = nullptr; });
  expect("fit.json: `/parameters/0/state` is `free`",
         [](auto& j) { j["parameters"][0]["state"] = "free"; });
  expect("fit.json: `/parameters` is not a list", [](auto& j) { j["parameters"] = 1; });
  expect("fit.json: `/basins/1/refined` is not a truth",
         [](auto& j) { j["basins"][1]["refined"] = 0; });
  expect("fit.json: `/model` is not an object", [](auto& j) { j["model"] = 1; });
  expect("fit.json: `/seed` is not a seed", [](auto& j) { j["seed"] = -1; });
  expect("fit.json: `/observations/used` is not a count",
         [](auto& j) { j["observations"]["used"] = 3e10; });
  expect("fit.json: `/` is not an object", [](auto& j) { j = 1; });
  expect_refused(folder, "cut.json:3: not JSON", [&] {
    read_fit_result(folder.write("cut.json", "{\n \"format\": \"clothfit-fit/1\",\n \"a\": }\n"));
  });
  expect_refused(folder, "large.json: holds a number too large",
                 [&] { read_fit_result(folder.write("large.json", "{\"a\": 1e999}")); });
  expect_refused(folder, "none.json: there is no such file",
                 [&] { read_fit_result(folder / "none.json"); });
}

}  // namespace
}  // namespace clothfit
