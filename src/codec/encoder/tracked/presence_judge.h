// What of the tracked reference is shown in a frame. Seen is not shown: at the rims of a depth camera's view and in its
// shadows surface comes and goes from frame to frame, which is noise, not motion. So what was seen is averaged along
// the surface and over time; a hole that opens for a moment within what is seen is filled by what is known, and specks
// are left out.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/node_reference.h"
#include "core/geometry.h"
#include "core/lattice.h"
#include "core/length.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// What a frame leaves for the next. Lists are by vertex of the reference; empty: there was none on this reference.
struct PresenceHistory {
    std::vector<float> score;           // how much of it was seen lately, 0 to 1
    std::vector<std::uint16_t> unseen;  // for how many frames it was not
    Presence shown;
};

struct PresenceOptions {
    bool fill = true;              // whether what is known fills holes that open for a moment
    bool leave_out_specks = true;  // whether small parts that hang on nothing are not shown
    LatticeUnits speck{320};       // side of a square: smaller parts are specks
    int hold = 15;                 // frames for which a hole is filled
};

// What is tracked, as it lies in the frame.
struct TrackedPlace {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
    const VerticesAround& around;
    std::span<const std::uint8_t> of_reference;  // what was there of the reference itself: Presence
};

// seen: TrackedTargets::seen. The history's `shown` is what to send.
PresenceHistory judge_presence(std::span<const std::uint8_t> seen, const TrackedPlace& tracked,
                               const PresenceHistory& before, const PresenceOptions& options);

// What is left of it when the surface becomes the reference, with `vertices` vertices. kept: which vertices its first
// ones were before; the others are new.
PresenceHistory on_new_reference(const PresenceHistory& before, std::span<const std::uint32_t> kept,
                                 std::size_t vertices);

}  // namespace htvm::internal
