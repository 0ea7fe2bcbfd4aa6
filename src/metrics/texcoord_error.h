// How far texture coordinates are off: at points of the original's surface, against those at the closest points of the
// decoded one. Vertices of the two need not correspond.
//
// The samples are the centroids of the original's triangles, weighted by their area, since seams of the atlas run along
// edges and never through triangles. Where a decoded mesh keeps the layout of the atlas, they differ by what its
// surface slipped; where it does not, they lie anywhere. A root mean square of both together would say nothing, so
// samples that are off by more than `elsewhere_beyond` are counted by themselves.
#pragma once

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// In texture coordinates: a sixteenth of an atlas of 0..1.
inline constexpr double elsewhere_beyond = 1.0 / 16;

// Sums over samples; they add up over frames.
struct TexcoordError {
    double area = 0;      // mm^2, of all samples; 0: nothing was measured
    double in_place = 0;  // mm^2, of those that are not elsewhere
    double squared = 0;   // squared error of these, times mm^2
};
TexcoordError& operator+=(TexcoordError& sums, const TexcoordError& frame);

// Nothing is measured unless both meshes have triangles and texture coordinates.
Result<TexcoordError> texcoord_error(const Mesh& original, const Mesh& decoded, internal::Threads threads = {});

// Root mean square of the samples in place, in texture coordinates.
double rms_texcoord(const TexcoordError& error);
// The share of the surface whose texture coordinates are elsewhere, 0..1.
double share_elsewhere(const TexcoordError& error);

}  // namespace htvm
