#include "fit/diagnosis/beam.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "fit/diagnosis/criteria.h"

namespace clothfit {
namespace {

/// Returns the cheapest sound entry of two lists, one of which has such.
BeamEntry best_sound(std::vector<BeamEntry> entries, std::vector<BeamEntry> more) {
  std::ranges::move(more, std::back_inserter(entries));
  std::erase_if(entries, [](const BeamEntry& entry) { return !entry.is_sound(); });
  return std::move(*std::ranges::min_element(entries, {}, &BeamEntry::cost));
}

/// Tells whether two entries have the same hypotheses, in any order.
bool same_hypotheses(const BeamEntry& one, const BeamEntry& other) {
  const std::vector<Hypothesis>& others = other.model.hypotheses;
  return one.model.hypotheses.size() == others.size() &&
         std::ranges::all_of(one.model.hypotheses, [&](const Hypothesis& hypothesis) {
           return std::ranges::any_of(
               others, [&](const Hypothesis& own) { return own.same_mode(hypothesis); });
         });
}

size_t numbers_of(const BeamEntry& entry) {
  size_t count = 0;
  for (const Hypothesis& hypothesis : entry.model.hypotheses) count += hypothesis.number_count();
  return count;
}

}  // namespace

Beam::Beam(BeamEntry first, size_t width, size_t most_effects)
    : width_(width), most_effects_(most_effects) {
  entries_.push_back(std::move(first));
}

BeamEntry* Beam::next() {
  for (;;) {
    const auto next = std::ranges::find_if(entries_, [&](const BeamEntry& entry) {
      return !entry.finished && entry.model.hypotheses.size() < most_effects_;
    });
    if (next != entries_.end()) return &*next;
    if (best().is_sound()) return nullptr;
    BeamEntry sound = best_sound(std::exchange(entries_, {}), std::exchange(dropped_, {}));
    entries_.push_back(std::move(sound));
  }
}

BeamEntry Beam::release_best_sound() {
  return best_sound(std::exchange(entries_, {}), std::exchange(dropped_, {}));
}

void Beam::add(std::vector<BeamEntry> children, double base_cost) {
  std::ranges::move(children, std::back_inserter(entries_));
  std::ranges::stable_sort(entries_, {}, &BeamEntry::cost);
  drop_repeated();
  put_simplest_first();
  drop_far_behind(base_cost);
  if (std::ranges::none_of(dropped_, &BeamEntry::is_sound)) return;
  BeamEntry sound = best_sound(std::exchange(dropped_, {}), {});
  dropped_.push_back(std::move(sound));
}

void Beam::drop_repeated() {
  for (size_t n = 1; n < entries_.size();) {
    const auto own = entries_.begin() + static_cast<std::ptrdiff_t>(n);
    const auto same = std::find_if(entries_.begin(), own, [&](const BeamEntry& cheaper) {
      return same_hypotheses(cheaper, *own);
    });
    if (same == own) {
      ++n;
      continue;
    }
    // Hypotheses that have beaten a correction in one order have beaten it in the other.
    same->must_still_beat = std::max(same->must_still_beat, own->must_still_beat);
    entries_.erase(own);
  }
}

void Beam::put_simplest_first() {
  const double alike = entries_.front().cost + kCriteria.told_apart;
  const size_t effects = entries_.front().model.hypotheses.size();
  auto simplest = entries_.begin();
  for (auto entry = entries_.begin(); entry != entries_.end() && entry->cost < alike; ++entry)
    if (entry->is_sound() == simplest->is_sound() && entry->model.hypotheses.size() == effects &&
        numbers_of(*entry) < numbers_of(*simplest))
      simplest = entry;
  std::rotate(entries_.begin(), simplest, simplest + 1);
}

void Beam::drop_far_behind(double base_cost) {
  const double enough = kCriteria.beam_far_behind * (base_cost - entries_.front().cost);
  size_t kept = 1;
  while (kept < std::min(width_, entries_.size()) && base_cost - entries_[kept].cost >= enough)
    ++kept;
  const auto first =
      entries_.begin() + static_cast<std::ptrdiff_t>(std::min(kept, entries_.size()));
  std::move(first, entries_.end(), std::back_inserter(dropped_));
  entries_.erase(first, entries_.end());
}

}  // namespace clothfit
