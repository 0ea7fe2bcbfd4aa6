// Options of the topology profile that code an EP-frame whenever there is a reference, even if an I-frame would take
// fewer bits: for tests about EP-frames.
#pragma once

#include "htvm/encoder_options.hpp"

namespace htvm::test {

inline EncoderOptions enhanced_options() {
    auto out = default_options(Profile::topology);
    out.topology.frame_choice = FrameChoice::fixed;
    return out;
}

}  // namespace htvm::test
