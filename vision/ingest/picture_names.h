#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "data/finding.h"

namespace clothfit {

/// Says whether `a` comes before `b`, where digits are compared as numbers: img2 before img10.
bool natural_order(const std::string& a, const std::string& b);

/// The pictures of a folder in the order in which they were taken.
struct NumberedPictures {
  std::vector<std::filesystem::path> files;
  /// Frame of each file, rising from 0. A number that is missing among the names is a frame without
  /// a picture.
  std::vector<int> frames;
  /// The numbers that the frames are counted by, in steps of one; empty where they are not.
  std::vector<std::int64_t> numbers;
  Findings findings;  ///< gaps in the numbers, and names that tell no frame
};

/// Sorts pictures and takes their frames from the number that changes from name to name. Numbers
/// that rise in equal steps count as one each, as where every tenth picture was kept. Where several
/// numbers change, or one leaps as times do, the frames are counted. A camera's counter that goes
/// on with 1 after 9999 counts on. Throws InputError for two pictures of one number.
NumberedPictures number_pictures(std::vector<std::filesystem::path> files);

}  // namespace clothfit
