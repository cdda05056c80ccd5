#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/terminal/csv_table.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/json_file.h"
#include "apps/terminal/number_text.h"
#include "apps/terminal/option_flags.h"
#include "apps/terminal/progress_line.h"
#include "apps/terminal/result_folder.h"
#include "apps/terminal/say.h"
#include "apps/terminal/text_table.h"
#include "apps/verbs/seen_summary.h"
#include "apps/verbs/verb.h"
#include "data/finding_json.h"
#include "fit/jobs/thread_limit.h"
#include "vision/encode/encode_picture.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

struct DetectVerbOptions {
  fs::path images;
  LookOptions look;
  int threads = 0;
  fs::path out;
};

std::string pixel_text(double value) {
  return fmt::format("{:.3f}", value);
}

/// Returns a row for each corner of each thing that is seen.
Table detections(const LookResult& result) {
  Table table{
      .header = {"picture", "frame", "kind", "family", "id", "corner", "u", "v", "sigma", "status"},
      .rows = {}};
  for (const SeenPicture& picture : result.pictures) {
    const std::string frame = fmt::format("{}", picture.frame);
    for (const SeenTag& seen : picture.tags) {
      const TagReading& reading = seen.reading;
      for (size_t c = 0; c < 4; ++c) {
        const std::string& reason = reading.rejected[c];
        table.rows.push_back({picture.name, frame, "tag", seen.family,
                              fmt::format("{}", reading.tag.id), fmt::format("{}", c),
                              pixel_text(reading.tag.corner_px[c].x()),
                              pixel_text(reading.tag.corner_px[c].y()),
                              reading.tag.refined ? pixel_text(reading.tag.sigma_px[c]) : "",
                              reason.empty() ? "ok" : "rejected:" + reason});
      }
    }
    const std::string pattern =
        result.pattern ? fmt::format("{}x{}", result.pattern->columns, result.pattern->rows) : "";
    for (const SeenDot& dot : picture.dots)
      table.rows.push_back({picture.name, frame, "dot", pattern,
                            dot.named() ? dot_name(dot.row, dot.column) : "", "",
                            pixel_text(dot.pixel_px.x()), pixel_text(dot.pixel_px.y()),
                            pixel_text(dot.sigma_px), "ok"});
    if (!picture.board) continue;
    const std::string size = fmt::format("{}x{}", picture.board->columns, picture.board->rows);
    for (size_t c = 0; c < picture.board->corner_px.size(); ++c)
      table.rows.push_back({picture.name, frame, "board", size, "", fmt::format("{}", c),
                            pixel_text(picture.board->corner_px[c].x()),
                            pixel_text(picture.board->corner_px[c].y()), "", "ok"});
  }
  return table;
}

void write_results(const LookResult& result, const SeenSummary& summary, const fs::path& folder) {
  write_csv_table(detections(result), folder / "detections.csv");
  write_json(to_json(result, summary), folder / "detect.json");
  for (const Overlay& overlay : result.overlays)
    write_png(overlay.picture, folder / fmt::format("overlay_{:06}.png", overlay.frame));
}

int run_detect(const DetectVerbOptions& options) {
  options.look.validate();
  require_threads(options.threads);
  const ThreadLimit limit(options.threads);
  const fs::path images = fs::absolute(options.images).lexically_normal();
  const fs::path named = images.has_filename() ? images : images.parent_path();
  ResultFolder out(out_folder(options.out, named.filename().string() + ".detections"), {images});
  LookResult result;
  {
    ProgressLine line;
    result = look(options.images, options.look, watch(line));
  }
  if (result.cancelled) throw Cancelled();
  const SeenSummary summary = summarise(result);
  for (const Finding& warning : with_state(result.footage, FindingState::warning))
    spdlog::warn("{}", sentence(warning));
  if (summary.families.empty() && summary.boards.empty() && summary.dots.pictures == 0)
    throw NoResult(fmt::format("no tag, no dots and no chessboard appear in {}: {}{}",
                               options.images.string(), footage_text(result),
                               result.turned.empty() ? "" : "; " + result.turned));
  write_results(result, summary, out.path());
  out.publish();

  say("\n{}\n\n{}", footage_text(result), text_table(summary_table(summary)));
  for (const Finding& note : with_state(result.footage, FindingState::passed))
    say("\n{}\n", note.found);
  say("\nDetections: {}\n", shown_path(out.final_path() / "detections.csv"));
  return kExitGood;
}

}  // namespace

void add_detect_verb(Verb program) {
  const auto options = std::make_shared<DetectVerbOptions>();
  Verb verb =
      program.add_verb("detect", "List the tags, dots and boards that pictures or a video show");
  verb.add_option("pictures", &options->images, "Folder of pictures, or a video")
      .required()
      .type_name("PICTURES");
  verb.add_option("--family", &options->look.families,
                  "Families of tags to look for; those that appear, unless told")
      .type_name("FAMILY");
  verb.add_option("--every", &options->look.every, "Look at every N-th picture").shows_default();
  verb.add_option("--threads", &options->threads, "Threads; 0 for as many as the machine has")
      .shows_default()
      .shapes_no_result();
  add_out_option(verb, options->out, "PICTURES.detections");
  verb.footer("Example:\n  clothfit detect data/recordings/tags_onecam/frames/front");
  verb.runs([options] { return run_detect(*options); });
}

}  // namespace clothfit
