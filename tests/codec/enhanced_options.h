// Options of the topology profile that code an EP-frame wherever there is a reference, also where an I-frame would take
// fewer bits: for tests that are about EP-frames.
#pragma once

#include "htvm/encoder_options.hpp"

namespace htvm::test {

inline EncoderOptions enhanced_options() {
    auto out = default_options(Profile::topology);
    out.topology.frame_choice = FrameChoice::fixed;
    return out;
}

}  // namespace htvm::test
