// How much of a surface a frame codes anew.
#pragma once

#include <span>

#include "htvm/frame.hpp"
#include "htvm/mesh.hpp"

namespace htvm {

// How many triangles of a decoded frame its reference has too; in a TP-frame they are the first ones. sent: inspect()
// of its packet, which counts what a patch brings.
std::size_t kept_triangles(const MeshView& decoded, const FrameInfo& sent);

// The others' share of the decoded surface, by area, 0 to 1: the patch of a TP-frame, all of an I- or EP-frame, nothing
// of a frame that only moves its reference.
double recoded_share(const MeshView& decoded, const FrameInfo& sent);

}  // namespace htvm
