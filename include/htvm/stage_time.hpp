// How long the stages of a frame take.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

namespace htvm {

struct StageTime {
    const char* stage;
    double milliseconds;
};

}  // namespace htvm
