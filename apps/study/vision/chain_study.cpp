#include "apps/study/vision/chain_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

#include "apps/study/vision/chain_rows.h"
#include "apps/study/vision/filmed_cloth.h"
#include "apps/study/vision/filmed_recording.h"
#include "apps/study/vision/fitted_pictures.h"
#include "apps/study/vision/parameter_difference.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "data/input_error.h"
#include "data/recording.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// One way from pictures to a fit. It is given a folder of its own.
struct Chain {
  std::string row, set;
  std::function<ChainResult(const fs::path& work, const ProgressCallback& progress)> follow;
};

/// Names the row in what is said of its progress.
ProgressCallback of_row(const std::string& row, const ProgressCallback& progress) {
  return [row, &progress](const Progress& inner) {
    if (interrupted()) return false;
    if (!progress) return true;
    Progress named = inner;
    named.stage = row + ": " + inner.stage;
    return progress(named);
  };
}

ChainResult followed(const Chain& chain, const fs::path& work, const ProgressCallback& progress) {
  ChainResult result;
  const auto begin = std::chrono::steady_clock::now();
  try {
    result = chain.follow(work, of_row(chain.row, progress));
  } catch (const InputError& error) {
    result.reason = error.what();
  } catch (const NoResult& error) {
    result.reason = error.what();
  }
  result.row = chain.row;
  result.set = chain.set;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

/// Lists the ways of one recording's pictures: as they are, and filmed.
std::vector<Chain> tag_chains(const fs::path& folder, const VisionStudyOptions& options) {
  constexpr int kCrf = 23;
  const std::string name = folder.filename().string();
  return {{kChainOfTags, name + ", stills",
           [=](const fs::path& work, const ProgressCallback& progress) {
             return fit_pictures(read_recording(folder), work, progress);
           }},
          {kChainOfTags, name + fmt::format(", H.264 at crf {}", kCrf),
           [=](const fs::path& work, const ProgressCallback& progress) {
             return fit_pictures(filmed_evenly(read_recording(folder), kCrf, work), work, progress);
           }},
          {kChainOfTags, name + ", the same with gaps",
           [=, seed = options.seed](const fs::path& work, const ProgressCallback& progress) {
             return fit_pictures(filmed_with_gaps(read_recording(folder), kCrf, seed, work), work,
                                 progress);
           }}};
}

std::vector<Chain> chains(const VisionStudyOptions& options) {
  std::vector<Chain> all;
  const auto wanted = [&](const char* row, const fs::path& folder) {
    return (options.rows.empty() || std::ranges::find(options.rows, row) != options.rows.end()) &&
           fs::is_directory(folder);
  };
  const fs::path tags = options.data / "recordings" / "tags_onecam";
  if (wanted(kChainOfTags, tags)) all = tag_chains(tags, options);
  const fs::path dots = options.data / "recordings" / "dots_twocam";
  if (wanted(kChainOfDots, dots))
    all.push_back({kChainOfDots, dots.filename().string(),
                   [=](const fs::path& work, const ProgressCallback& progress) {
                     return diagnose_pictures(read_recording(dots), work, progress);
                   }});
  const fs::path cloth = options.data / "vision" / "cloth-phisft-r1";
  if (wanted(kChainOfCloth, cloth))
    all.push_back({kChainOfCloth, cloth.filename().string(),
                   [=](const fs::path& work, const ProgressCallback& progress) {
                     return surface_from_texture(cloth, work, progress);
                   }});
  return all;
}

/// Returns the first result of a row, with which its others are compared.
const ChainResult& first_of(const std::vector<ChainResult>& results, const std::string& row) {
  return *std::ranges::find(results, row, &ChainResult::row);
}

}  // namespace

std::vector<ChainResult> study_chain(const VisionStudyOptions& options, const fs::path& steps,
                                     const ProgressCallback& progress) {
  options.validate();
  std::vector<ChainResult> results;
  for (const Chain& chain : chains(options)) {
    ChainResult result = followed(chain, steps / std::to_string(results.size()), progress);
    results.push_back(std::move(result));
    const ChainResult& reference = first_of(results, chain.row);
    if (&reference != &results.back() && results.back().reason.empty())
      compare_parameters(results.back().numbers, reference.numbers);
  }
  return results;
}

std::vector<VisionTarget> chain_targets(const std::vector<ChainResult>& results) {
  std::vector<VisionTarget> targets;
  for (const ChainResult& result : results) {
    const auto add = [&](const std::string& name, const char* sense, double limit, double value,
                         const std::string& unit, const std::string& note) {
      const bool least = sense == std::string(">=");
      targets.push_back({.name = result.set + ": " + name,
                         .target = fmt::format("{} {:.4g}", sense, limit),
                         .value = value,
                         .unit = unit,
                         .met = least ? value >= limit : value <= limit,
                         .note = result.reason.empty() ? note : result.reason});
    };
    if (result.row == kChainOfTags && &result != &first_of(results, result.row)) {
      const ChainNumber* const most = furthest(result.numbers);
      add("largest difference of a parameter", "<=", 3,
          most != nullptr ? most->over_sigma : ChainNumber().over_sigma, "sigma",
          most != nullptr ? most->name : "nothing to compare");
    } else if (result.row == kChainOfDots) {
      add("adequate", ">=", 1, value_of(result.numbers, "adequate"), "", result.verdict);
    } else if (result.row == kChainOfCloth) {
      add("Chamfer over that of the given tracks", "<=", 1.01,
          value_of(result.numbers, "Chamfer ratio"), "", "");
    }
  }
  return targets;
}

}  // namespace clothfit
