// Options for tests: at fixed steps, whatever the default quality, and such as code EP-frames.
#pragma once

#include "htvm/encoder_options.hpp"

namespace htvm::test {

// The defaults of a profile at steps of 2 mm and 6 levels: for stored streams and tables, and for bounds of errors.
inline EncoderOptions options_at_2_mm(Profile profile) {
    auto out = default_options(profile);
    out.geometry_step = 2;
    out.colour_step = 6;
    return out;
}

// Options of the topology profile that code an EP-frame whenever there is a reference, even if an I-frame would take
// fewer bits: for tests about EP-frames.
inline EncoderOptions enhanced_options() {
    auto out = options_at_2_mm(Profile::topology);
    out.topology.frame_choice = FrameChoice::fixed;
    return out;
}

}  // namespace htvm::test
