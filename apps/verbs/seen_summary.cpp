#include "apps/verbs/seen_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/terminal/number_text.h"
#include "data/finding_json.h"
#include "data/median.h"

namespace clothfit {
namespace {

double median_or_zero(const std::vector<double>& values) {
  return values.empty() ? 0 : median(values);
}

double side_px(const TagDetection& tag) {
  double sum = 0;
  for (size_t c = 0; c < 4; ++c) sum += (tag.corner_px[(c + 1) % 4] - tag.corner_px[c]).norm();
  return sum / 4;
}

/// Gathers one family's tags from picture to picture.
class FamilyCount {
 public:
  explicit FamilyCount(std::string name) { family_.name = std::move(name); }

  void add(const SeenPicture& picture) {
    std::map<int, int> times;
    for (const SeenTag& seen : picture.tags)
      if (seen.family == family_.name) {
        add(seen.reading, picture.frame);
        ++times[seen.reading.tag.id];
      }
    if (times.empty()) return;
    ++family_.pictures;
    shown_.push_back(static_cast<double>(times.size()));
    for (const auto& [id, count] : times) {
      family_.ids.insert(id);
      if (count > 1) ++family_.repeated;
    }
  }

  SeenFamily summary() const {
    SeenFamily family = family_;
    family.each_shows = median_or_zero(shown_);
    family.width_px = median_or_zero(widths_px_);
    family.sigma_px = median_or_zero(sigmas_px_);
    if (!ways_px_.empty()) family.moves_px = median(ways_px_);
    return family;
  }

 private:
  void add(const TagReading& reading, int frame) {
    widths_px_.push_back(side_px(reading.tag));
    for (size_t c = 0; c < 4; ++c) {
      ++family_.corners;
      if (!reading.rejected[c].empty())
        ++family_.doubted;
      else
        sigmas_px_.push_back(reading.tag.sigma_px[c]);
    }
    const auto before = last_.find(reading.tag.id);
    if (before != last_.end() && before->second.frame < frame)
      ways_px_.push_back((reading.centre_px() - before->second.centre_px()).norm() /
                         (frame - before->second.frame));
    last_[reading.tag.id] = reading;
  }

  SeenFamily family_;
  std::vector<double> shown_, widths_px_, sigmas_px_, ways_px_;
  std::map<int, TagReading> last_;
};

/// Lists ids as "0 to 63, 100".
std::string id_text(const std::set<int>& ids) {
  std::string text;
  for (auto id = ids.begin(); id != ids.end();) {
    const int first = *id;
    int last = first;
    for (++id; id != ids.end() && *id == last + 1; ++id) last = *id;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", first);
    if (last > first) text += fmt::format(" to {}", last);
  }
  return text;
}

/// Gathers dots from picture to picture.
SeenDots summarise_dots(const LookResult& result) {
  SeenDots dots;
  if (result.pattern) {
    dots.columns = result.pattern->columns;
    dots.rows = result.pattern->rows;
  }
  std::vector<double> shown, widths_px, sigmas_px, ways_px;
  std::map<std::pair<int, int>, std::pair<int, Eigen::Vector2d>> last;  // frame and place by name
  for (const SeenPicture& picture : result.pictures) {
    if (picture.dots.empty()) continue;
    ++dots.pictures;
    shown.push_back(static_cast<double>(picture.dots.size()));
    for (const SeenDot& dot : picture.dots) {
      ++dots.count;
      widths_px.push_back(dot.width_px);
      sigmas_px.push_back(dot.sigma_px);
      if (!dot.named()) continue;
      ++dots.named;
      const auto [before, is_new] =
          last.try_emplace({dot.row, dot.column}, picture.frame, dot.pixel_px);
      if (!is_new && before->second.first < picture.frame)
        ways_px.push_back((dot.pixel_px - before->second.second).norm() /
                          (picture.frame - before->second.first));
      before->second = {picture.frame, dot.pixel_px};
    }
  }
  dots.each_shows = median_or_zero(shown);
  dots.width_px = median_or_zero(widths_px);
  dots.sigma_px = median_or_zero(sigmas_px);
  if (!ways_px.empty()) dots.moves_px = median(ways_px);
  return dots;
}

nlohmann::ordered_json way_json(const std::optional<double>& way_px) {
  return way_px ? nlohmann::ordered_json(*way_px) : nlohmann::ordered_json();
}

std::string way_text(const std::optional<double>& way_px) {
  return way_px ? significant(*way_px, 2) : "-";
}

}  // namespace

SeenSummary summarise(const LookResult& result) {
  SeenSummary summary;
  for (const std::string& name : result.families) {
    FamilyCount count(name);
    for (const SeenPicture& picture : result.pictures) count.add(picture);
    if (SeenFamily family = count.summary(); !family.ids.empty())
      summary.families.push_back(std::move(family));
  }
  summary.dots = summarise_dots(result);
  std::map<std::pair<int, int>, int> boards;
  for (const SeenPicture& picture : result.pictures)
    if (picture.board) ++boards[{picture.board->columns, picture.board->rows}];
  for (const auto& [size, pictures] : boards)
    summary.boards.push_back({size.first, size.second, pictures});
  std::ranges::stable_sort(summary.boards, std::greater<>(), &SeenBoards::pictures);
  return summary;
}

std::string footage_text(const LookResult& result) {
  std::string text =
      fmt::format("{} {} of {} x {} px", result.count, result.count == 1 ? "picture" : "pictures",
                  result.width, result.height);
  if (result.times_s.size() > 1) {
    const double seconds = result.times_s.back() - result.times_s.front();
    text += fmt::format(", {} s, {} per second in the mean", significant(seconds, 4),
                        significant(static_cast<double>(result.times_s.size() - 1) / seconds, 5));
  }
  return text;
}

Table summary_table(const SeenSummary& summary) {
  Table table{.header = {"seen", "which", "in pictures", "in each", "wide, px", "sigma, px",
                         "moves, px", "doubted"},
              .rows = {}};
  for (const SeenFamily& family : summary.families)
    table.rows.push_back({family.name, id_text(family.ids), fmt::format("{}", family.pictures),
                          significant(family.each_shows, 3), significant(family.width_px, 3),
                          significant(family.sigma_px, 2),
                          family.repeated > 0 ? "-" : way_text(family.moves_px),
                          fmt::format("{} of {}", family.doubted, family.corners)});
  if (const SeenDots& dots = summary.dots; dots.pictures > 0)
    table.rows.push_back(
        {"dots",
         dots.columns > 0 ? fmt::format("a pattern of {} x {}", dots.columns, dots.rows)
                          : "not named by a pattern",
         fmt::format("{}", dots.pictures), significant(dots.each_shows, 3),
         significant(dots.width_px, 3), significant(dots.sigma_px, 2), way_text(dots.moves_px),
         dots.columns > 0 ? fmt::format("{} of {} unnamed", dots.count - dots.named, dots.count)
                          : ""});
  for (const SeenBoards& board : summary.boards)
    table.rows.push_back({"chessboard",
                          fmt::format("{} x {} inner corners", board.columns, board.rows),
                          fmt::format("{}", board.pictures), "1", "", "", "", ""});
  return table;
}

nlohmann::ordered_json to_json(const LookResult& result, const SeenSummary& summary) {
  nlohmann::ordered_json json;
  json["format"] = "clothfit-detect/1";
  json["pictures"] = result.count;
  json["looked_at"] = result.pictures.size();
  json["image_size"] = {result.width, result.height};
  if (!result.times_s.empty()) json["times_s"] = result.times_s;
  json["tags"] = nlohmann::ordered_json::array();
  for (const SeenFamily& family : summary.families)
    json["tags"].push_back({{"family", family.name},
                            {"ids", family.ids},
                            {"pictures", family.pictures},
                            {"in_each", family.each_shows},
                            {"width_px", family.width_px},
                            {"sigma_px", family.sigma_px},
                            {"moves_px", way_json(family.moves_px)},
                            {"corners", family.corners},
                            {"doubted", family.doubted},
                            {"repeated", family.repeated}});
  json["dots"] = nlohmann::ordered_json::array();
  if (const SeenDots& dots = summary.dots; dots.pictures > 0)
    json["dots"].push_back({{"columns", dots.columns},
                            {"rows", dots.rows},
                            {"pictures", dots.pictures},
                            {"in_each", dots.each_shows},
                            {"width_px", dots.width_px},
                            {"sigma_px", dots.sigma_px},
                            {"moves_px", way_json(dots.moves_px)},
                            {"dots", dots.count},
                            {"named", dots.named}});
  json["boards"] = nlohmann::ordered_json::array();
  for (const SeenBoards& board : summary.boards)
    json["boards"].push_back(
        {{"columns", board.columns}, {"rows", board.rows}, {"pictures", board.pictures}});
  json["footage"] = nlohmann::ordered_json::array();
  for (const Finding& finding : result.footage) json["footage"].push_back(to_json(finding));
  return json;
}

}  // namespace clothfit
