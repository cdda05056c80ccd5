#include "data/fabric_sheet.h"

#include <fmt/format.h>

#include <map>

#include "data/reading.h"
#include "data/yaml_value.h"

namespace clothfit {
namespace {

/// Bounds of what is sold as fabric, from gauze to tarpaulin, with a factor of ten to spare.
struct Range {
  double least, most;
};
constexpr Range kDensity{0.005, 5}, kThickness{1e-5, 0.05}, kTension{1, 1e7}, kShear{0.1, 1e6},
    kBending{1e-8, 1e-2}, kBendingHysteresis{0, 1}, kShearHysteresis{0, 1e3}, kShare{0, 1};

constexpr double kGramForce_n = 9.80665e-3, kDegree_rad = 3.14159265358979323846 / 180;

/// One number of a file: SI = factor * number.
struct Unit {
  double si = 1;
  const char* name = "";
};

/// The units of a kind of data sheet.
struct UnitSystem {
  Unit density, thickness, tension, shear, bending, bending_hysteresis, shear_hysteresis;
  /// Force per width (N/m) at which `extension` is given in percent, in place of `tension`; 0: it
  /// is not.
  double extension_at_n_per_m = 0;
};

const UnitSystem& system_of(FabricUnits units) {
  // Sources: KES-F [kawabata1980], which gives a loop's whole width; FAST [csiro1994]. FAST and the
  // commercial program know no hysteresis.
  static const std::map<FabricUnits, UnitSystem> systems{
      {FabricUnits::si,
       {.density = {1, "kg/m2"},
        .thickness = {1, "m"},
        .tension = {1, "N/m"},
        .shear = {1, "N/m per radian"},
        .bending = {1, "N m"},
        .bending_hysteresis = {1, "N"},
        .shear_hysteresis = {1, "N/m"}}},
      {FabricUnits::kes_f,
       {.density = {0.01, "mg/cm2"},
        .thickness = {1e-3, "mm"},
        .tension = {},
        .shear = {kGramForce_n / 0.01 / kDegree_rad, "gf/(cm degree)"},
        .bending = {kGramForce_n * 1e-4 / 0.01, "gf cm2/cm"},
        .bending_hysteresis = {0.5 * kGramForce_n, "gf cm/cm (2HB)"},
        .shear_hysteresis = {0.5 * kGramForce_n / 0.01, "gf/cm (2HG)"},
        .extension_at_n_per_m = 500 * kGramForce_n / 0.01}},
      {FabricUnits::fast,
       {.density = {1e-3, "g/m2"},
        .thickness = {1e-3, "mm"},
        .tension = {},
        .shear = {1, "N/m"},
        .bending = {1e-6, "uN m"},
        .extension_at_n_per_m = 98.1}},
      {FabricUnits::clo,
       {.density = {1e-3, "g/m2"},
        .thickness = {1e-3, "mm"},
        .tension = {1e-3, "g/s2"},
        .shear = {1e-3, "g/s2"},
        .bending = {1e-9, "g mm2/s2"}}}};
  return systems.at(units);
}

/// Reads `value` or `{value: ..., sigma: ...}`.
SheetNumber read_number(const YamlValue& value, const Unit& unit, const Range& si) {
  const auto number = [&](const YamlValue& of) {
    return unit.si * of.number_between(si.least / unit.si, si.most / unit.si, unit.name);
  };
  if (value.is_number()) return {number(value), {}};
  const YamlMap map = value.map({"value", "sigma"});
  SheetNumber measured{number(map.at("value")), {}};
  if (const YamlValue* sigma = map.find("sigma"))
    measured.sigma =
        unit.si *
        sigma->number_between(0, measured.value / unit.si,
                              fmt::format("{}, a standard deviation up to the value", unit.name));
  return measured;
}

SheetPair read_pair(const YamlValue& value, const Unit& unit, const Range& si) {
  const YamlMap map = value.map({"warp", "weft"});
  return {read_number(map.at("warp"), unit, si), read_number(map.at("weft"), unit, si)};
}

/// Returns the stiffness that stretches by so many percent at a force per width. It is a secant of
/// the tension curve.
SheetNumber secant(const SheetNumber& extension_percent, double at_n_per_m) {
  SheetNumber stiffness{100 * at_n_per_m / extension_percent.value, {}};
  if (extension_percent.sigma)
    stiffness.sigma = stiffness.value * *extension_percent.sigma / extension_percent.value;
  return stiffness;
}

SheetPair read_tension(const YamlMap& map, const UnitSystem& system) {
  if (system.extension_at_n_per_m == 0) {
    if (const YamlValue* extension = map.find("extension"))
      extension->refuse("extension is given", "tension, for sheets in these units");
    return read_pair(map.at("tension"), system.tension, kTension);
  }
  if (const YamlValue* tension = map.find("tension"))
    tension->refuse("tension is given",
                    fmt::format("extension, in percent at {:.4g} N/m, for sheets in these units",
                                system.extension_at_n_per_m));
  const Range percent{100 * system.extension_at_n_per_m / kTension.most, 200};
  const SheetPair extension = read_pair(map.at("extension"), {1, "%"}, percent);
  return {secant(extension.warp, system.extension_at_n_per_m),
          secant(extension.weft, system.extension_at_n_per_m)};
}

FabricSheet parsed_fabric(const std::filesystem::path& file) {
  const YamlMap map = read_yaml(file).map({"format", "name", "source", "units", "areal_density",
                                           "thickness", "tension", "extension", "shear", "bending",
                                           "hysteresis", "drape_coefficient"});
  map.at("format").one_of<int>({{"clothfit-fabric/1", 0}});
  FabricSheet sheet;
  sheet.file = file.string();
  sheet.name = map.at("name").text();
  sheet.units = map.at("units").one_of<FabricUnits>({{"si", FabricUnits::si},
                                                     {"kes_f", FabricUnits::kes_f},
                                                     {"fast", FabricUnits::fast},
                                                     {"clo", FabricUnits::clo}});
  const UnitSystem& system = system_of(sheet.units);
  sheet.areal_density_kg_per_m2 = read_number(map.at("areal_density"), system.density, kDensity);
  if (const YamlValue* thickness = map.find("thickness"))
    sheet.thickness_m = read_number(*thickness, system.thickness, kThickness);
  sheet.tension_n_per_m = read_tension(map, system);
  const YamlValue& shear = map.at("shear");
  sheet.shear_n_per_m = read_number(shear, system.shear, kShear);
  for (const SheetNumber* tension : {&sheet.tension_n_per_m.warp, &sheet.tension_n_per_m.weft})
    if (tension->value <= sheet.shear_n_per_m.value)
      shear.refuse(fmt::format("shear is {:.4g} N/m per radian and tension {:.4g} N/m",
                               sheet.shear_n_per_m.value, tension->value),
                   "a fabric that is softer in shear than along its threads", "check the units");
  sheet.bending_n_m = read_pair(map.at("bending"), system.bending, kBending);
  if (const YamlValue* hysteresis = map.find("hysteresis")) {
    if (system.bending_hysteresis.name[0] == '\0')
      hysteresis->refuse("hysteresis is given", "none, for sheets in these units",
                         "give the sheet in si or kes_f");
    const YamlMap of = hysteresis->map({"bending", "shear"});
    if (const YamlValue* bending = of.find("bending"))
      sheet.bending_hysteresis_n =
          read_pair(*bending, system.bending_hysteresis, kBendingHysteresis);
    if (const YamlValue* by_shear = of.find("shear"))
      sheet.shear_hysteresis_n_per_m =
          read_number(*by_shear, system.shear_hysteresis, kShearHysteresis);
  }
  if (const YamlValue* drape = map.find("drape_coefficient"))
    sheet.drape_coefficient = read_number(*drape, {1, "a share"}, kShare);
  return sheet;
}

}  // namespace

std::string to_string(FabricUnits units) {
  switch (units) {
    case FabricUnits::si:
      return "si";
    case FabricUnits::kes_f:
      return "kes_f";
    case FabricUnits::fast:
      return "fast";
    case FabricUnits::clo:
      return "clo";
  }
  return {};
}

FabricSheet read_fabric_sheet(const std::filesystem::path& file) {
  return reading(file, [&] { return parsed_fabric(file); });
}

}  // namespace clothfit
