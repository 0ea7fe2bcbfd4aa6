// Other programs that a command starts.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace htvm::app {

struct ChildStreams {
    int input = -1;      // a descriptor for its standard input; -1: ours
    bool output = true;  // whether it may write to our standard output
    bool errors = true;  // and to our standard error
};

// Starts a program, found as the shell finds it; Ctrl-C ends it even if this one ignores that. 0 if it cannot be
// started.
pid_t start_program(std::vector<std::string> words, const ChildStreams& streams);

// Waits for its end, and says whether that was without an error.
bool ends_well(pid_t child);

}  // namespace htvm::app
