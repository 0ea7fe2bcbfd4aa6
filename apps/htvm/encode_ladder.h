// A ladder: one capture in several qualities at once, for players that go from one to the other: as segments that are
// cut at the same frames in all, with a list of their playlists; or as live streams of a hub (stream_name.h), in which
// decoding can start at the same frames, and of which the hub makes segments and the list. The capture is read once;
// what the finest rung's encoder finds of a frame, the others go by (Encoder::share_with()).
#pragma once

#include "encode_plan.h"
#include "htvm/result.hpp"

namespace htvm::app {

// A rung: so many bits a second, or a quality.
struct Rung {
    double bits_per_second = 0;  // 0: by the quality
    double quality = 0;
};

// The rungs that a text names, the coarsest first. bad_input if it is none: "web", "0.3,0.8,2" (Mbit/s), "q35,q50".
Result<std::vector<Rung>> rungs_of(const std::string& text);

// Encodes them; request.output becomes the list of playlists, and each rung's lies beside it, or it is where the ladder
// is published, each rung as a stream of its own. Tells of it as the command does. bad_input if the request asks for
// what a ladder has not.
Result<void> encode_ladder(const EncodeRequest& request);

}  // namespace htvm::app
