// Texts of options, and numbers as all readers take them.

#include "apps/terminal/grid_size.h"
#include "data/number_text.h"
#include "data/recording.h"
#include "fit/interface/fit_options.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const std::string text(text_of(data, size));
  parse_grid_size(text);
  const auto mesh = parse_mesh(text);
  if (mesh.has_value() != check_mesh(text).empty()) __builtin_trap();
  if (mesh && !is_possible_mesh(mesh->columns, mesh->rows)) __builtin_trap();
  if (const auto number = parse_number(text))
    if (parse_number(number_text(*number)) != number) __builtin_trap();
  parse_whole_number(text);
  leading_cost_named(text);
  return 0;
}
