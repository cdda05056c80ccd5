// Checks the reader of fabrics' data sheets: their units, and what is refused.

#include "data/fabric_sheet.h"

#include <gtest/gtest.h>

#include "tests/data/expect_refused.h"

namespace clothfit {
namespace {

const std::string kBegin = "format: clothfit-fabric/1\nname: twill\n";

TEST(FabricSheet, SaysTheSameInTheUnitsOfEveryLaboratory) {
  const TemporaryFolder folder;
  const FabricSheet si = read_fabric_sheet(folder.write(
      "si.yaml", kBegin + "units: si\nareal_density: 0.15\nthickness: 0.0004\n"
                          "tension: {warp: 9806.65, weft: 4903.325}\nshear: 56.188\n"
                          "bending: {warp: 9.80665e-6, weft: 4.903325e-6}\n"
                          "hysteresis: {bending: {warp: 4.903325e-4, weft: 2.4516625e-4}, "
                          "shear: 0.980665}\n"));
  const FabricSheet kes = read_fabric_sheet(folder.write(
      "kes.yaml", kBegin + "units: kes_f\nareal_density: 15\nthickness: 0.4\n"
                           "extension: {warp: 5, weft: 10}\nshear: 1\n"
                           "bending: {warp: 0.1, weft: 0.05}\n"
                           "hysteresis: {bending: {warp: 0.1, weft: 0.05}, shear: 2}\n"));
  const FabricSheet fast = read_fabric_sheet(folder.write(
      "fast.yaml", kBegin + "units: fast\nareal_density: 150\nthickness: 0.4\n"
                            "extension: {warp: 1.00034, weft: 2.00068}\nshear: 56.188\n"
                            "bending: {warp: 9.80665, weft: 4.903325}\n"));
  const FabricSheet clo = read_fabric_sheet(
      folder.write("clo.yaml", kBegin + "units: clo\nareal_density: 150\nthickness: 0.4\n"
                                        "tension: {warp: 9806650, weft: 4903325}\nshear: 56188\n"
                                        "bending: {warp: 9806.65, weft: 4903.325}\n"));

  for (const FabricSheet* sheet : {&kes, &fast, &clo}) {
    const auto expect_same = [&](const SheetNumber& number, const SheetNumber& other) {
      EXPECT_NEAR(number.value / other.value, 1, 1e-4) << to_string(sheet->units);
    };
    expect_same(sheet->areal_density_kg_per_m2, si.areal_density_kg_per_m2);
    expect_same(sheet->thickness_m.value(), si.thickness_m.value());
    expect_same(sheet->tension_n_per_m.warp, si.tension_n_per_m.warp);
    expect_same(sheet->tension_n_per_m.weft, si.tension_n_per_m.weft);
    expect_same(sheet->shear_n_per_m, si.shear_n_per_m);
    expect_same(sheet->bending_n_m.warp, si.bending_n_m.warp);
    expect_same(sheet->bending_n_m.weft, si.bending_n_m.weft);
  }
  // 2HB and 2HG are the whole width of the loop.
  EXPECT_NEAR(kes.bending_hysteresis_n.value().warp.value, 4.903325e-4, 1e-9);
  EXPECT_NEAR(kes.shear_hysteresis_n_per_m.value().value, 0.980665, 1e-6);
  EXPECT_FALSE(fast.bending_hysteresis_n.has_value());
}

TEST(FabricSheet, ReadsStandardDeviationsAndTheMeasuredDrape) {
  const TemporaryFolder folder;
  const FabricSheet sheet = read_fabric_sheet(folder.write(
      "f.yaml", kBegin + "units: kes_f\nareal_density: {value: 15, sigma: 0.3}\n"
                         "extension: {warp: {value: 5, sigma: 0.5}, weft: 10}\nshear: 1\n"
                         "bending: {warp: 0.1, weft: 0.05}\ndrape_coefficient: 0.47\n"));

  EXPECT_NEAR(sheet.areal_density_kg_per_m2.sigma.value(), 0.003, 1e-12);
  EXPECT_NEAR(sheet.tension_n_per_m.warp.sigma.value() / sheet.tension_n_per_m.warp.value, 0.1,
              1e-12);
  EXPECT_FALSE(sheet.tension_n_per_m.weft.sigma.has_value());
  EXPECT_EQ(sheet.drape_coefficient.value().value, 0.47);
}

TEST(FabricSheet, RefusesNumbersOfNoFabricInTheUnitsOfItsFile) {
  const TemporaryFolder folder;
  const std::string rest =
      "tension: {warp: 500, weft: 400}\nshear: 40\n"
      "bending: {warp: 1e-6, weft: 1e-6}\n";
  const auto refused = [&](const std::string& text, const std::string& message) {
    const auto file = folder.write("f.yaml", text);
    expect_refused(folder, "f.yaml:" + message, [&] { read_fabric_sheet(file); });
  };
  refused(kBegin + "units: si\nareal_density: 150\n" + rest, "4: areal_density = 150");
  refused(kBegin + "units: gsm\nareal_density: 0.15\n" + rest, "3: units = gsm");
  refused(kBegin + "units: si\nareal_density: .nan\n" + rest, "4: areal_density");
  refused(kBegin + "units: kes_f\nareal_density: 15\n" + rest, "5: tension is given");
  refused(kBegin + "units: si\nareal_density: 0.15\nextension: {warp: 5, weft: 5}\n" + rest,
          "5: extension is given");
  refused(kBegin +
              "units: si\nareal_density: 0.15\ntension: {warp: 500, weft: 400}\n"
              "shear: 450\nbending: {warp: 1e-6, weft: 1e-6}\n",
          "6: shear is 450 N/m per radian and tension 400 N/m");
  refused(kBegin + "units: si\nareal_density: {value: 0.15, sigma: 0.2}\n" + rest,
          "4: areal_density.sigma = 0.2");
  refused(kBegin +
              "units: si\nareal_density: 0.15\ntension: {warp: 500}\nshear: 40\n"
              "bending: {warp: 1e-6, weft: 1e-6}\n",
          "5: `weft` is missing in tension");
  refused(kBegin +
              "units: clo\nareal_density: 150\ntension: {warp: 5e5, weft: 4e5}\nshear: 4e4\n"
              "bending: {warp: 1000, weft: 1000}\nhysteresis: {shear: 1}\n",
          "8: hysteresis is given");
  refused(kBegin + "units: si\nareal_density: 0.15\ncolour: blue\n" + rest, "5: ");
}

}  // namespace
}  // namespace clothfit
