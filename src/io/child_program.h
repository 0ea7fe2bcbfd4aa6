// Other programs that this one starts.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace htvm {

// What a program has for one of its streams, where that is no descriptor: this program's own, or /dev/null.
inline constexpr int our_stream = -1, no_stream = -2;

struct ChildStreams {
    int input = our_stream, output = our_stream, errors = our_stream;
    // Ctrl-C in the terminal does not reach it.
    bool apart = false;
};

// Starts a program, found as the shell finds it; Ctrl-C ends it even if this one ignores that.
// 0 if it cannot be started.
pid_t start_program(std::vector<std::string> words, const ChildStreams& streams);

// Waits for its end, and says whether that was without an error.
bool ends_well(pid_t child);

}  // namespace htvm
