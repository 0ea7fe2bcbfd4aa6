// What a capture adds to the plan of an encoding: the encoder's options to the end.
#pragma once

#include "command_line/capture.h"
#include "encode_plan.h"
#include "htvm/encoder_options.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

// The part of a camera's film that is sent at first, if the capture's texture goes into the stream as one's film;
// nothing if it does not, or is none. Before the capture's first frame is taken.
std::optional<FilmWindow> film_of(const Capture& capture);

// plan: with the use of textures, and the film, that the capture has decided. Says on the terminal what follows for
// pictures.
Result<EncoderOptions> settings_for(const EncodePlan& plan, const Capture& capture);

}  // namespace htvm::app
