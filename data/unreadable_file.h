#pragma once

#include "data/input_error.h"

namespace clothfit {

/// Says that the system failed to read a file: it says nothing of what the file holds, so nobody
/// may go on as if it held something wrong.
class UnreadableFile : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace clothfit
