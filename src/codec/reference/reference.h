// What frames refer to: an I-frame as it was decoded, numbered, and what both sides derive from it. Encoder and decoder
// make it alike and never change it afterwards, so that whoever works on a frame can hold on to the one it began with.
#pragma once

#include <cstdint>
#include <optional>

#include "codec/reference/skinning.h"
#include "codec/reference/transforms.h"
#include "codec/stream/sequence.h"
#include "codec/tracked/tracked_frame.h"
#include "core/thread.h"

namespace htvm::internal {

struct Reference {
    std::uint32_t number = 0;  // of the I-frame
    std::int32_t step = 1;     // of its positions, lattice units
    ReferenceMesh skinned;     // the mesh and its pose; what follows from the bones only where that was derived
    bool has_bones = false;    // whether it was
    std::optional<TrackedReference> tracked;  // likewise what follows from the nodes
    const LatticeMesh& mesh() const { return skinned.mesh; }
};

// What a frame refers to decides what is derived: EP- and P-frames bones, T-frames nodes.
struct Derived {
    bool bones = true;
    bool nodes = false;  // nothing where the header has no node spacing
};

// mesh: as decoded. Errors: as of make_tracked_reference().
Result<Reference> make_reference(const SequenceHeader& header, std::uint32_t number, LatticeMesh mesh, CodedPose pose,
                                 std::int32_t step, Derived derived, Threads threads);

// What was not derived at once, for whoever finds out later that it is needed. Nothing where it is there already.
void derive_bones(Reference& reference, const SequenceHeader& header, Threads threads);
// Needs a header with a node spacing.
Result<void> derive_nodes(Reference& reference, const SequenceHeader& header, Threads threads);

}  // namespace htvm::internal
