// A T-frame's payload from version 3 of the stream on: one run of the range coder, without any table. First the head,
// which says how the layers are quantised; from presence_version on which vertices are there; then node motion,
// displacement and, where the reference has colours, their change. Counts, attributes and what predicts each layer
// follow from the reference, and what is as in the frame before takes a bit. Colours of many bytes are a run of their
// own behind the first, so that two threads read side by side. (Versions 1 and 2 have a run for each layer, in a
// payload like those of other frames.)
#pragma once

#include <cstddef>
#include <cstdint>

#include "codec/format/frame_payload.h"
#include "codec/reference/film_projection.h"
#include "codec/tracked/node_motion.h"
#include "codec/tracked/vertex_field.h"
#include "entropy/range_coder.h"
#include "htvm/frame.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct TrackedHead {
    CapturedCounts captured;  // informative
    NodeMotionSteps motion;
    FieldSteps displacement;
    FilmProjection projection;     // of the frame; none where the reference has none
    FieldSteps colour;             // none where the reference has no colours
    std::uint32_t colour_run = 0;  // bytes of the colours' own run, the last of the payload; 0: they are in the first
    bool operator==(const TrackedHead&) const = default;
};

// What both sides know before a head is coded.
struct KnownOfHead {
    const TrackedHead* before = nullptr;         // of the frame that this one refers to; null if that is the I-frame
    CapturedCounts of_intra;                     // what the I-frame was captured with
    bool colours = false;                        // whether the reference has them
    const FilmProjection* projection = nullptr;  // of the reference; null: it has none
};

// The steps must be in range, and the colours turned as in the frame before.
void write_tracked_head(RangeEncoder& encoder, const TrackedHead& head, const KnownOfHead& known);
// corrupt_stream if a step is out of range, or a number of the projection not finite.
Result<TrackedHead> read_tracked_head(RangeDecoder& decoder, const KnownOfHead& known);

// Where in the first run its parts end: position() behind each; the colours' if they are in it.
struct TrackedRunEnds {
    std::size_t head = 0, motion = 0, displacement = 0, colour = 0;
    std::size_t presence = 0;  // behind the head; 0 in streams without
};
// The layers' shares of a payload of so many bytes, to the nearest byte. What they leave is the head and the run's end.
LayerBytes layer_shares(const TrackedRunEnds& ends, std::size_t bytes, std::size_t colour_run);

}  // namespace htvm::internal
