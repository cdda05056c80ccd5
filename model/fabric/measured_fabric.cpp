#include "model/fabric/measured_fabric.h"

#include <fmt/format.h>

#include <cmath>

#include "data/input_error.h"

namespace clothfit {
namespace {

/// Refuses what is not within a factor of 100 of any fabric that is sold.
void check_range(const char* member, double value, double least, double most, const char* unit) {
  if (value >= least && value <= most) return;  // false for a NaN, too
  throw InputError(member, fmt::format("it is {:g} {}", value, unit),
                   fmt::format("a fabric has {:g} to {:g} {}", least, most, unit),
                   "check the unit of the data sheet");
}

/// Returns the share by which a strip with free edges is softer than one whose width is kept.
double softer(double along_n_per_m, double across_n_per_m, double lateral_n_per_m) {
  return lateral_n_per_m * lateral_n_per_m / (along_n_per_m * across_n_per_m);
}

}  // namespace

void MeasuredFabric::validate() const {
  check_range("areal_density_kg_per_m2", areal_density_kg_per_m2, 0.005, 5, "kg/m2");
  check_range("tension_warp_n_per_m", tension_warp_n_per_m, 1, 1e7, "N/m");
  check_range("tension_weft_n_per_m", tension_weft_n_per_m, 1, 1e7, "N/m");
  check_range("shear_n_per_m", shear_n_per_m, 0.1, 1e6, "N/m");
  check_range("bending_warp_n_m", bending_warp_n_m, 1e-8, 1e-2, "N m");
  check_range("bending_weft_n_m", bending_weft_n_m, 1e-8, 1e-2, "N m");
}

double MeasuredFabric::bending_length_warp_m() const {
  return std::cbrt(bending_warp_n_m / (areal_density_kg_per_m2 * kGravity_m_per_s2));
}

double MeasuredFabric::bending_length_weft_m() const {
  return std::cbrt(bending_weft_n_m / (areal_density_kg_per_m2 * kGravity_m_per_s2));
}

FibreConversion fibres_of(const MeasuredFabric& fabric) {
  fabric.validate();
  for (const auto& [member, tension] :
       {std::pair{"tension_warp_n_per_m", fabric.tension_warp_n_per_m},
        {"tension_weft_n_per_m", fabric.tension_weft_n_per_m}})
    if (tension < fabric.shear_n_per_m)
      throw InputError(
          member,
          fmt::format("{:g} N/m is below shear_n_per_m = {:g} N/m", tension, fabric.shear_n_per_m),
          "tension stiffer than shear, as threads make it", "check the units: shear is per radian");
  const double shear = fabric.shear_n_per_m;
  return {.fibres = {.warp_n_per_m = fabric.tension_warp_n_per_m - shear,
                     .weft_n_per_m = fabric.tension_weft_n_per_m - shear,
                     .bias_n_per_m = 2 * shear},
          .free_strip_softer_warp =
              softer(fabric.tension_warp_n_per_m, fabric.tension_weft_n_per_m, shear),
          .free_strip_softer_weft =
              softer(fabric.tension_weft_n_per_m, fabric.tension_warp_n_per_m, shear)};
}

SpringConversion measured_springs(const MeasuredFabric& fabric) {
  const FibreConversion conversion = fibres_of(fabric);
  const double mean = std::sqrt(fabric.bending_warp_n_m * fabric.bending_weft_n_m);
  return {.fabric = {.tension_warp_n_per_m = conversion.fibres.warp_n_per_m,
                     .tension_weft_n_per_m = conversion.fibres.weft_n_per_m,
                     .shear_n_per_m = fabric.shear_n_per_m},
          .bending_n_m = mean,
          .bending_warp_off = mean / fabric.bending_warp_n_m - 1,
          .bending_weft_off = mean / fabric.bending_weft_n_m - 1,
          .fibres = conversion};
}

}  // namespace clothfit
