#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <vector>

#include "data/recording.h"

namespace clothfit {

/// The words that recording.yaml has for each choice. Inside data/ only.
template <class Choice>
using Words = std::vector<std::pair<std::string, Choice>>;

template <class Choice>
std::string word_of(const Words<Choice>& words, Choice choice) {
  for (const auto& [word, known] : words)
    if (known == choice) return word;
  assert(false && "every choice has a word");
  return {};
}

inline Words<MarkerKind> marker_kind_words() {
  return {{"apriltag", MarkerKind::apriltag},
          {"dots", MarkerKind::dots},
          {"texture", MarkerKind::texture},
          {"none", MarkerKind::none}};
}

inline Words<MassDistribution> mass_distribution_words() {
  return {{"by_area", MassDistribution::by_area}, {"equal", MassDistribution::equal}};
}

inline Words<HeldMotion> held_motion_words() {
  return {
      {"fixed", HeldMotion::fixed}, {"path", HeldMotion::path}, {"tracked", HeldMotion::tracked}};
}

inline Words<ClothEdge> cloth_edge_words() {
  return {{"top", ClothEdge::top},
          {"bottom", ClothEdge::bottom},
          {"left", ClothEdge::left},
          {"right", ClothEdge::right}};
}

inline Words<StartKind> start_words() {
  return {{"at_rest", StartKind::at_rest},
          {"released_flat", StartKind::released_flat},
          {"unknown", StartKind::unknown}};
}

}  // namespace clothfit
