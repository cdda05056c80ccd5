#include "apps/study/recordings/published_errors.h"

#include "data/csv_reader.h"

namespace clothfit {

PublishedErrors read_published_errors(const std::filesystem::path& file) {
  CsvReader table(file, {{.name = "recording"}, {.name = "weighted_rms_m"}});
  PublishedErrors errors;
  while (table.next()) {
    const double error_m = table.number(1);
    if (!(error_m > 0))
      table.refuse("weighted_rms_m = " + std::string(table.text(1)), "metres, more than 0");
    const std::string name = table.name(0);
    if (!errors.emplace(name, error_m).second)
      table.refuse("recording " + name + " stands here again", "one row per recording");
  }
  table.require_rows("published errors");
  return errors;
}

}  // namespace clothfit
