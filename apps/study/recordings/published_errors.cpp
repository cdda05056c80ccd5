#include "apps/study/recordings/published_errors.h"

#include "data/csv_table.h"

namespace clothfit {

PublishedErrors read_published_errors(const std::filesystem::path& file) {
  const CsvTable table(file, {{.name = "recording"}, {.name = "weighted_rms_m"}});
  table.require_rows("published errors");
  PublishedErrors errors;
  for (int row = 0; row < table.rows(); ++row) {
    const double error_m = table.number(row, 1);
    if (!(error_m > 0))
      table.refuse(row, "weighted_rms_m = " + std::string(table.text(row, 1)),
                   "metres, more than 0");
    const std::string name = table.name(row, 0);
    if (!errors.emplace(name, error_m).second)
      table.refuse(row, "recording " + name + " stands here again", "one row per recording");
  }
  return errors;
}

}  // namespace clothfit
