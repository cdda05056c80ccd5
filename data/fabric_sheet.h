#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace clothfit {

/// A measured number and its standard deviation; none where the sheet gives none.
struct SheetNumber {
  double value = 0;
  std::optional<double> sigma;
};

/// Warp and weft.
struct SheetPair {
  SheetNumber warp, weft;
};

/// The units in which a data sheet of a fabric is written.
enum class FabricUnits {
  si,     ///< kg/m2, m, N/m, N m
  kes_f,  ///< Kawabata's: mg/cm2, mm, % at 500 gf/cm, gf/(cm degree), gf cm2/cm
  fast,   ///< CSIRO's: g/m2, mm, % at 98.1 N/m, N/m, uN m
  clo     ///< of a commercial program: g/m2, mm, g/s2, g mm2/s2
};
std::string to_string(FabricUnits units);

/// The data sheet of a fabric, in SI units whatever those of its file (format clothfit-fabric/1,
/// docs/formats.md).
struct FabricSheet {
  std::string file;  ///< as the user gave it, for messages
  std::string name;
  FabricUnits units = FabricUnits::si;  ///< of the file
  SheetNumber areal_density_kg_per_m2;
  std::optional<SheetNumber> thickness_m;
  SheetPair tension_n_per_m;  ///< force per width and strain
  SheetNumber shear_n_per_m;  ///< force per width and radian
  SheetPair bending_n_m;      ///< moment per width and curvature
  /// Half the width of the loop between loading and unloading. Bending: moment per width (N);
  /// shear: force per width (N/m).
  std::optional<SheetPair> bending_hysteresis_n;
  std::optional<SheetNumber> shear_hysteresis_n_per_m;
  std::optional<SheetNumber> drape_coefficient;  ///< as measured, 0 to 1; for comparison
};

/// Reads a fabric's data sheet. Throws InputError with file and line, also for numbers that no
/// fabric has, in the units of the file.
FabricSheet read_fabric_sheet(const std::filesystem::path& file);

}  // namespace clothfit
