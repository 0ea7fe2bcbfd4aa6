// The decoder of each kind of frame, one file a kind or two.
#pragma once

#include "codec/decoder/decoder_state.h"
#include "codec/format/frame_payload.h"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// Decodes and shows the frame. Called once the payload's header is known to be within all limits; if the frame refers
// to the reference alone, that is known to exist. After an error the state is unchanged, except for what helps to
// conceal the frame.
using FrameDecoder = Result<void>(DecoderState& state, const Packet& packet, const FramePayloadView& payload);

FrameDecoder decode_intra, decode_enhanced, decode_predicted, decode_tracked, decode_patched;

}  // namespace htvm::internal
