// What the readers of all mesh formats are given besides the bytes, and what they tell besides the mesh.
//
// The rule: what the widely used readers of a format accept is read; what changes what a person sees is never silent;
// what has to be guessed from the data is guessed once for a capture, by the caller, from what the readers tell.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"
#include "io/colour_range.h"
#include "io/mesh_check.h"
#include "io/texture_reference.h"

namespace htvm {

struct MeshReadOptions {
    MeshLimits limits;  // the largest mesh to accept
    // The range of colours whose type does not say it (floats, more than 8 bits); nothing: by this mesh alone.
    std::optional<ColourRange> colour_range = {};
    std::array<double, 3> origin{};  // taken off the positions, as doubles, before they become floats; the file's unit
};

// Something that a reader mended, left out or had to guess.
struct MeshRemark {
    std::string about;     // a constant name such as "face-colours": of many frames each is told once
    std::string text;      // a clause behind the file's name: "its faces have colours, which vertices take on average"
    bool is_loss = false;  // what other programs show is not shown: a warning, not a note
};

struct MeshFindings {
    TextureReference texture;
    ColourLevels colour_levels;  // of colours whose type does not say their range
    std::vector<MeshRemark> remarks;
};

// Adds a remark, unless one about the same is there.
void remark(MeshFindings* findings, const char* about, std::string text, bool is_loss = false);

}  // namespace htvm
