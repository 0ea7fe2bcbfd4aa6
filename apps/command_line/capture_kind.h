// What the frames of one capture have in common, decided once from a few of them: files do not say which range their
// colours are in, whether frames ought to have colours, or that the second half of a folder is another capture.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "io/colour_range.h"
#include "io/mesh_reading.h"

namespace htvm::app {

// What is taken off positions far from their origin, in whole metres, so that floats keep the shape: the middle of the
// mesh, where it is farther away than 64 times its size. Zeros where it is not. The positions are in the file's unit,
// of which one has so many millimetres.
GlobalShift shift_of(const Mesh& mesh, double millimetres_per_unit);

// Half the vertices are nearer than this to the middle one, in the positions' unit: a size that spikes, strays and
// specks far away do not change. 0 without vertices.
double size_of(const Mesh& mesh);

// Adds up what single meshes have.
class CaptureKind {
public:
    // A mesh of the capture, positions in mm. has_texture: it has an image, so that it needs no colours.
    void add(const Mesh& mesh, const MeshFindings& findings, bool has_texture);
    // Nothing where types say it.
    std::optional<ColourRange> colour_range() const;
    // Why a mesh, positions in mm, is none of these: a clause behind its name. Empty: it is like the others.
    std::string unlike(const Mesh& mesh, const ColourLevels& levels, bool has_texture) const;

private:
    std::size_t meshes_ = 0, coloured_ = 0;
    double size_ = 0;  // of the first with vertices
    ColourLevels levels_;
    std::array<std::size_t, 3> of_range_{};  // meshes that leave no doubt about their colours' range, by range
};

}  // namespace htvm::app
