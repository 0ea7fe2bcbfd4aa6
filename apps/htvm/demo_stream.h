// The short stream that is inside the program, for `htvm demo`: a synthetic person who walks, waves, turns and jumps.
// apps/htvm/demo/make.sh makes it, cmake/tools.cmake puts it in.
#pragma once

#include <cstdint>
#include <span>

namespace htvm::app {

std::span<const std::uint8_t> demo_stream();

}  // namespace htvm::app
