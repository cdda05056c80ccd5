#pragma once

namespace clothfit {

/// From here on Ctrl-C (SIGINT) and SIGTERM set a flag instead of killing the program, so that the
/// call at work can end cleanly; a second one, half a second later or more, kills.
void catch_interrupts();

/// Whether one arrived. Progress callbacks return the opposite.
bool interrupted();

}  // namespace clothfit
