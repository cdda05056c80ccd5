// What a study keeps in its journal, and what it reads beside the recordings, each told by its
// name. The journal's checksums are left out: they would end nearly all here.

#include <exception>
#include <functional>
#include <map>
#include <new>
#include <string>

#include "apps/study/foreign/foreign_row.h"
#include "apps/study/louchet1995/payload.h"
#include "apps/study/recordings/marker_weights.h"
#include "apps/study/recordings/published_errors.h"
#include "apps/study/trials/undeclared_json.h"
#include "tests/fuzz/scratch_folder.h"

namespace clothfit {
namespace {

/// Expects a payload that was read and written to be the same once read and written again.
void expect_same_again(const std::string& payload,
                       const std::function<std::string(const std::string&)>& written_again) {
  std::string once;
  try {
    once = written_again(payload);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    return;  // the run says which record is damaged
  }
  if (written_again(once) != once) __builtin_trap();
}

const std::map<std::string, std::function<std::string(const std::string&)>> kPayloads = {
    {"undeclared", [](const auto& text) { return payload_of(undeclared_trial_of(text)); }},
    {"diagnosis", [](const auto& text) { return payload_of(foreign_diagnosis_of(text)); }},
    {"setting", [](const auto& text) { return to_payload(setting_search_of(text)); }},
    {"landscape", [](const auto& text) { return to_payload(landscape_of(text)); }},
    {"recovery", [](const auto& text) { return to_payload(recovery_of(text, 2)); }},
    {"race", [](const auto& text) { return to_payload(race_of(text)); }},
};

}  // namespace
}  // namespace clothfit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto files = files_of(text_of(data, size), "undeclared");
  for (const auto& [name, text] : files) {
    if (const auto payload = kPayloads.find(name); payload != kPayloads.end())
      expect_same_again(text, payload->second);
    if (name == "truth.json") read_or_refuse([&] { parse_foreign_truth(text, name); });
    if (name != "weights.csv" && name != "published.csv") continue;
    const auto file = write_scratch("table.csv", text);
    read_or_refuse([&] {
      if (name == "weights.csv") read_marker_weights(file);
      if (name == "published.csv") read_published_errors(file);
    });
  }
  return 0;
}
