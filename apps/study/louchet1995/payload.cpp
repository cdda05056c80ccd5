#include "apps/study/louchet1995/payload.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace clothfit {
namespace {

using nlohmann::json;

json number(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

void require(bool good, const char* what) {
  if (!good) throw std::range_error(what);
}

/// Returns the enumerator of a number from 0 to that of `last`.
template <class Enum>
Enum enumerator_of(const json& value, Enum last) {
  const int number = value.get<int>();
  require(number >= 0 && number <= static_cast<int>(last), "no such choice");
  return static_cast<Enum>(number);
}

double number_of(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

template <class Numbers>
json numbers(const Numbers& values) {
  json list = json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

std::vector<double> numbers_of(const json& list) {
  std::vector<double> values;
  for (const json& value : list) values.push_back(number_of(value));
  return values;
}

Eigen::VectorXd vector_of(const json& list) {
  const std::vector<double> values = numbers_of(list);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
}

json json_of(const ScannedSetting& setting) {
  const PaperExperiment& experiment = setting.experiment;
  return {{"limit", static_cast<int>(experiment.limit)},
          {"release", static_cast<int>(experiment.release)},
          {"numbers", numbers(std::array{experiment.vertex_mass_kg, experiment.time_step_s,
                                         experiment.duration_s, experiment.damping_per_s})},
          {"cost", static_cast<int>(setting.cost)},
          {"searched", setting.searched},
          {"usable", setting.match.usable},
          {"match", numbers(std::array{setting.match.factor, setting.match.spread,
                                       setting.match.overshoot})}};
}

ScannedSetting setting_of(const json& text) {
  ScannedSetting setting;
  setting.experiment.limit = enumerator_of(text.at("limit"), StrainLimitMode::consistent);
  setting.experiment.release = enumerator_of(text.at("release"), PaperRelease::upright);
  const std::vector<double> of_motion = numbers_of(text.at("numbers"));
  setting.experiment.vertex_mass_kg = of_motion.at(0);
  setting.experiment.time_step_s = of_motion.at(1);
  setting.experiment.duration_s = of_motion.at(2);
  setting.experiment.damping_per_s = of_motion.at(3);
  setting.cost = enumerator_of(text.at("cost"), PaperCost::small);
  setting.searched = text.at("searched").get<bool>();
  setting.match.usable = text.at("usable").get<bool>();
  const std::vector<double> of_match = numbers_of(text.at("match"));
  setting.match.factor = of_match.at(0);
  setting.match.spread = of_match.at(1);
  setting.match.overshoot = of_match.at(2);
  return setting;
}

json json_of(const Individual& individual) {
  return {{"values", numbers(individual.values)}, {"cost", number(individual.cost)}};
}

Individual individual_of(const json& text, Eigen::Index parameters) {
  Individual individual;
  individual.values = vector_of(text.at("values"));
  require(individual.values.size() == parameters, "values of another number of parameters");
  individual.cost = number_of(text.at("cost"));
  return individual;
}

}  // namespace

std::string to_payload(const SettingSearch& search) {
  json grid = json::array(), nearest = json::array();
  for (const ScannedSetting& setting : search.grid) grid.push_back(json_of(setting));
  for (const NearSetting& near : search.nearest)
    nearest.push_back({{"setting", json_of(near.setting)},
                       {"off", numbers(std::array{near.good_off_m, near.bad_off_m})}});
  return json{{"grid", grid}, {"nearest", nearest}}.dump();
}

SettingSearch setting_search_of(const std::string& payload) {
  const json text = json::parse(payload);
  SettingSearch search;
  for (const json& setting : text.at("grid")) search.grid.push_back(setting_of(setting));
  for (const json& near : text.at("nearest")) {
    const std::vector<double> off = numbers_of(near.at("off"));
    search.nearest.push_back({setting_of(near.at("setting")), off.at(0), off.at(1)});
  }
  require(!search.grid.empty(), "no setting");
  return search;
}

std::string to_payload(const CostLandscape& landscape) {
  return json{{"reference_elongation", landscape.reference_elongation},
              {"cost", static_cast<int>(landscape.cost)},
              {"stiffness", numbers(landscape.stiffness_n_per_m)},
              {"elongation", numbers(landscape.elongation)},
              {"value", numbers(landscape.value_m2.reshaped())},
              {"transitions", landscape.transitions}}
      .dump();
}

CostLandscape landscape_of(const std::string& payload) {
  const json text = json::parse(payload);
  CostLandscape landscape;
  landscape.reference_elongation = text.at("reference_elongation").get<double>();
  landscape.cost = enumerator_of(text.at("cost"), PaperCost::small);
  landscape.stiffness_n_per_m = numbers_of(text.at("stiffness"));
  landscape.elongation = numbers_of(text.at("elongation"));
  const Eigen::VectorXd values = vector_of(text.at("value"));
  const auto rows = std::ssize(landscape.stiffness_n_per_m),
             columns = std::ssize(landscape.elongation);
  require(values.size() > 0 && values.size() == rows * columns, "a grid with other places");
  landscape.value_m2 = values.reshaped(rows, columns);
  landscape.transitions = text.at("transitions").get<int>();
  return landscape;
}

std::string to_payload(const Recovery& recovery) {
  json listed = json::array();
  for (const Individual& individual : recovery.listed) listed.push_back(json_of(individual));
  return json{{"listed", listed},
              {"strategy", json_of(recovery.strategy)},
              {"refined", json_of(recovery.refined)},
              {"exact", recovery.exact},
              {"searches", recovery.searches},
              {"refinements", recovery.refinements},
              {"iterations", recovery.iterations}}
      .dump();
}

Recovery recovery_of(const std::string& payload, Eigen::Index parameters) {
  const json text = json::parse(payload);
  Recovery recovery;
  for (const json& individual : text.at("listed"))
    recovery.listed.push_back(individual_of(individual, parameters));
  require(!recovery.listed.empty(), "no individual listed");
  recovery.strategy = individual_of(text.at("strategy"), parameters);
  recovery.refined = individual_of(text.at("refined"), parameters);
  recovery.exact = text.at("exact").get<bool>();
  recovery.searches = text.at("searches").get<int>();
  recovery.refinements = text.at("refinements").get<int>();
  recovery.iterations = text.at("iterations").get<int>();
  return recovery;
}

std::string to_payload(const Race& race) {
  return json{{"evaluations", race.evaluations},
              {"relative_cost", numbers(race.relative_cost)},
              {"generations", race.generations},
              {"costs_asked", race.costs_asked}}
      .dump();
}

Race race_of(const std::string& payload) {
  const json text = json::parse(payload);
  Race race;
  race.evaluations = text.at("evaluations").get<std::vector<long>>();
  race.relative_cost = numbers_of(text.at("relative_cost"));
  require(!race.evaluations.empty() && race.evaluations.size() == race.relative_cost.size(),
          "not one cost for each number of evaluations");
  text.at("generations").get_to(race.generations);
  text.at("costs_asked").get_to(race.costs_asked);
  return race;
}

}  // namespace clothfit
