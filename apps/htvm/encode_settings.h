// What a capture adds to the plan of an encoding: the encoder's options to the end.
#pragma once

#include "command_line/capture.h"
#include "encode_plan.h"
#include "htvm/encoder_options.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

// plan: with the use of textures that the capture has decided. Says on the terminal what follows for pictures.
Result<EncoderOptions> settings_for(const EncodePlan& plan, const Capture& capture);

}  // namespace htvm::app
