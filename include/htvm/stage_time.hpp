// How long the stages of a frame take.
#pragma once

namespace htvm {

struct StageTime {
    const char* stage;
    double milliseconds;
};

}  // namespace htvm
