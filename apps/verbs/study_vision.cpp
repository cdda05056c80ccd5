#include "apps/verbs/study_vision.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/report/study/vision_tables.h"
#include "apps/study/vision/chain_study.h"
#include "apps/study/vision/vision_study.h"
#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/verb.h"
#include "data/text_file.h"
#include "fit/jobs/thread_limit.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVisionFolder = "vision.study";

struct VisionFlags {
  VisionStudyOptions options;
  int threads = 0;
  fs::path out;
};

nlohmann::ordered_json targets_json(const std::vector<VisionTarget>& targets,
                                    const std::string& command) {
  nlohmann::ordered_json json{{"format", "clothfit-targets/1"}, {"command", command}};
  json["targets"] = nlohmann::ordered_json::array();
  for (const VisionTarget& target : targets)
    json["targets"].push_back({{"name", target.name},
                               {"target", target.target},
                               {"value", target.value},
                               {"unit", target.unit},
                               {"met", target.met},
                               {"note", target.note}});
  return json;
}

/// Throws NoResult where every row has a reason, or none is there.
void require_measured(const std::vector<VisionResult>& results,
                      const std::vector<ChainResult>& chains) {
  std::vector<std::string> reasons;
  for (const VisionResult& one : results) reasons.push_back(one.reason);
  for (const ChainResult& one : chains) reasons.push_back(one.reason);
  if (std::ranges::none_of(reasons, &std::string::empty))
    throw NoResult("nothing could be measured: " +
                   (reasons.empty() ? "no set is there" : reasons.front()));
}

int run_vision_study(const VisionFlags& flags, const std::string& command) {
  flags.options.validate();
  ResultFolder out(out_folder(flags.out, kVisionFolder), {flags.options.data});
  require_threads(flags.threads);
  const ThreadLimit limit(flags.threads);
  const fs::path steps = out.path() / "steps";
  std::vector<VisionResult> results;
  std::vector<ChainResult> chains;
  {
    ProgressLine line;
    results = study_vision(flags.options, watch(line));
    chains = study_chain(flags.options, steps, watch(line));
  }
  fs::remove_all(steps);
  std::vector<VisionTarget> targets = vision_targets(results);
  std::ranges::move(chain_targets(chains), std::back_inserter(targets));
  write_csv_table(vision_table(results), out.path() / "vision.csv");
  write_csv_table(chain_table(chains), out.path() / "chain.csv");
  write_json(targets_json(targets, command), out.path() / "targets.json");
  write_text(vision_page_html(results, chains, targets, command), out.path() / "report.html");
  out.publish();
  if (!results.empty()) say("\n{}", text_table(short_vision_table(results)));
  if (!chains.empty()) say("\n{}", text_table(short_chain_table(chains)));
  say("\n{}\n", text_table(vision_target_table(targets)));
  say("Report: {}\n", shown_path(out.final_path() / "report.html"));
  require_measured(results, chains);
  return kExitGood;
}

}  // namespace

void add_vision_study(Verb study) {
  const auto flags = std::make_shared<VisionFlags>();
  Verb verb = study.add_verb(
      "vision", "Spoil pictures in known ways, and judge by the truth what is read of them");
  verb.add_option("data", &flags->options.data,
                  "Folder with recordings/ and vision/ in it; sets that it lacks are left out")
      .required()
      .type_name("FOLDER");
  verb.add_option("--rows", &flags->options.rows, "Row to measure; may be repeated (default: all)")
      .one_at_a_time()
      .type_name("NAME");
  verb.add_option("--stride", &flags->options.stride,
                  "Every so many-th picture of a recording is judged")
      .shows_default();
  verb.add_option("--seed", &flags->options.seed,
                  "Seed of noise, hands, textures and lost pictures")
      .check(check_seed)
      .shows_default();
  verb.add_option("--threads", &flags->threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, flags->out, kVisionFolder);
  verb.footer(
      "Rows chain_tags, chain_dots and chain_cloth go on to a fit, and take some minutes in all.\n"
      "\n"
      "Examples:\n"
      "  clothfit study vision data --rows stills --rows blur6\n"
      "  clothfit study vision data --rows chain_tags");
  verb.runs([flags, verb] { return run_vision_study(*flags, verb.command_text()); });
}

}  // namespace clothfit
