#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "apps/study/vision/vision_study.h"

namespace clothfit {
namespace {

enum class Sense { at_least, at_most };

/// A limit for one number of a row.
struct Limit {
  const char* row;
  const char* name;
  double (*value)(const TagScore& score);
  Sense sense;
  double limit;
  const char* unit;
};

double share(const TagScore& score) {
  return 100 * score.found_share();
}
double middle(const TagScore& score) {
  return score.error_quantile_px(0.5);
}
double tail(const TagScore& score) {
  return score.error_quantile_px(0.95);
}
double over_sigma(const TagScore& score) {
  return score.error_over_sigma_rms();
}
double hidden(const TagScore& score) {
  return score.hidden_reported;
}
double false_ones(const TagScore& score) {
  return score.false_tags;
}
double count(const TagScore& score) {
  return score.found;
}

constexpr Sense kLeast = Sense::at_least, kMost = Sense::at_most;

// What is aimed at; errors are distances.
constexpr Limit kLimits[] = {
    {"stills", "found", share, kLeast, 99.9, "%"},
    {"stills", "median error", middle, kMost, 0.055, "px"},
    {"stills", "95 % error", tail, kMost, 0.125, "px"},
    {"stills", "error over sigma", over_sigma, kLeast, 0.85, ""},
    {"stills", "error over sigma", over_sigma, kMost, 1.15, ""},
    {"blur3", "median error", middle, kMost, 0.075, "px"},
    {"blur3", "95 % error", tail, kMost, 0.17, "px"},
    {"blur6", "median error", middle, kMost, 0.09, "px"},
    {"blur6", "95 % error", tail, kMost, 0.20, "px"},
    {"hand", "found of the visible", share, kLeast, 95, "%"},
    {"hand", "hidden reported", hidden, kMost, 0, ""},
    {"dark", "found", share, kLeast, 99, "%"},
    {"small", "found", share, kLeast, 97, "%"},
    {"crf18", "error over sigma", over_sigma, kLeast, 0.75, ""},
    {"crf18", "error over sigma", over_sigma, kMost, 1.25, ""},
    {"crf23", "error over sigma", over_sigma, kLeast, 0.75, ""},
    {"crf23", "error over sigma", over_sigma, kMost, 1.25, ""},
    {"crf30", "error over sigma", over_sigma, kLeast, 0.75, ""},
    {"crf30", "error over sigma", over_sigma, kMost, 1.25, ""},
    {"room", "tags found", count, kLeast, 70, ""},
    {"room", "false tags", false_ones, kMost, 0, ""},
    {"sheet", "found", share, kLeast, 100, "%"},
    {"sheet", "error over sigma", over_sigma, kLeast, 1 / 1.5, ""},
    {"sheet", "error over sigma", over_sigma, kMost, 1.5, ""},
    {"false", "false tags", false_ones, kMost, 0, ""},
    {"dots", "found", share, kLeast, 99.5, "%"},
    {"dots", "median error", middle, kMost, 0.035, "px"},
    {"dots", "95 % error", tail, kMost, 0.10, "px"},
    {"dots", "false identities", false_ones, kMost, 0, ""},
    {"dots_noise8", "found", share, kLeast, 99, "%"},
    {"dots_noise8", "median error", middle, kMost, 0.05, "px"},
    {"dots_noise8", "95 % error", tail, kMost, 0.13, "px"},
    {"dots_noise8", "false identities", false_ones, kMost, 0, ""},
    {"dots_blur3", "found", share, kLeast, 99, "%"},
    {"dots_blur3", "median error", middle, kMost, 0.05, "px"},
    {"dots_blur3", "95 % error", tail, kMost, 0.13, "px"},
    {"dots_blur3", "false identities", false_ones, kMost, 0, ""},
    {"texture", "found", share, kLeast, 99, "%"},
    {"texture", "median error", middle, kMost, 0.15, "px"},
    {"texture", "95 % error", tail, kMost, 0.4, "px"},
    {"texture", "error over sigma", over_sigma, kLeast, 0.75, ""},
    {"texture", "error over sigma", over_sigma, kMost, 1.25, ""},
    {"weave", "error over sigma", over_sigma, kLeast, 0.75, ""},
    {"weave", "error over sigma", over_sigma, kMost, 1.25, ""},
};

/// Adds up the sets of a row; nothing where none was measured.
std::optional<TagScore> together(const std::vector<VisionResult>& results, const std::string& row) {
  std::optional<TagScore> all;
  for (const VisionResult& result : results) {
    if (result.row != row || !result.reason.empty()) continue;
    if (!all) all.emplace();
    all->add(result.score);
  }
  return all;
}

}  // namespace

std::vector<VisionTarget> vision_targets(const std::vector<VisionResult>& results) {
  std::vector<VisionTarget> targets;
  for (const Limit& limit : kLimits) {
    const std::optional<TagScore> score = together(results, limit.row);
    if (!score) continue;
    const bool least = limit.sense == Sense::at_least;
    const double value = limit.value(*score);
    targets.push_back({.name = fmt::format("{}: {}", limit.row, limit.name),
                       .target = fmt::format("{} {:.4g}", least ? ">=" : "<=", limit.limit),
                       .value = value,
                       .unit = limit.unit,
                       .met = least ? value >= limit.limit : value <= limit.limit,
                       .note = ""});
  }
  return targets;
}

}  // namespace clothfit
