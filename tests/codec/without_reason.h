// What a frame's payload is without why it was sent, which depends on the frames before.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/format/frame_payload.h"

namespace htvm::test {

using namespace internal;

inline std::vector<std::uint8_t> without_reason(const std::vector<std::uint8_t>& payload) {
    auto out = copy_of(*read_frame_payload(payload));
    out.layers[static_cast<std::size_t>(Layer::reason)].clear();
    out.present[static_cast<std::size_t>(Layer::reason)] = false;
    return write_frame_payload(out);
}

}  // namespace htvm::test
