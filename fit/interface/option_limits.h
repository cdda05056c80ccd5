#pragma once

namespace clothfit {

// Ends of ranges that options of several verbs share. Each is far beyond what helps: what lies
// further is a slip of the keyboard.

inline constexpr int kMostThreads = 1024;
inline constexpr int kMostPopulation = 100'000;
inline constexpr int kMostGenerations = 1'000'000;
inline constexpr int kMostRefined = 1000;          ///< individuals of a search
inline constexpr double kMostWork = 1000;          ///< times the limits of work
inline constexpr double kMostSubstepScale = 1000;  ///< times as fine as stability asks for
inline constexpr int kMostReplicates = 100'000;    ///< of a bootstrap
inline constexpr int kMostTrials = 1'000'000;      ///< of a study

}  // namespace clothfit
