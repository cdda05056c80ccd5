#pragma once

namespace clothfit {

/// Makes Ctrl-C (SIGINT) and SIGTERM set a flag from here on instead of killing the program. The
/// call at work can then end cleanly. A second one, half a second later or more, kills.
void catch_interrupts();

/// Says whether one arrived. Progress callbacks return the opposite.
bool interrupted();

}  // namespace clothfit
