// Ctrl-C and the polite kill, SIGINT and SIGTERM: what is at work ends in good order instead of at once.
#pragma once

namespace htvm::app {

// From here on the first signal is noted; a second one ends the program at once.
void watch_for_interruption();
// The signal's number; 0: none came.
int interruption();

}  // namespace htvm::app
