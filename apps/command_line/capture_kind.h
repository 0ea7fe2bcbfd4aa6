// What the frames of one capture have in common, decided once from a few of them: files do not say which range their
// colours are in, whether frames ought to have colours, or that the second half of a folder is another capture.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

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

// How large a mesh is, by what spikes, strays and specks far away do not change, in the positions' unit.
struct MeshSize {
    std::array<float, 3> middle{};  // of the vertices
    double reach = 0;               // half of the vertices are nearer to the middle than this; 0 without vertices
    double edge = 0;                // the middle one of the triangles' edges; 0 without triangles
};
MeshSize size_of(const Mesh& mesh);

// How far the farthest vertex of a triangle is from there: what spikes and strays do change.
double farthest_from(const std::array<float, 3>& middle, const Mesh& mesh);

// The usual size among several: the middle one of each measure, of those that have it.
MeshSize usual_size(const std::vector<MeshSize>& sizes);

// How many times larger than usual a mesh is in its reach and its edges alike, as in another unit. 1 where the two
// disagree: people who crouch, come and go change their reach, and a denser mesh its edges alone.
double scale_beside(const MeshSize& size, const MeshSize& usual);

// "2.5 times larger than the other frames, ...": a clause behind the name of a frame whose scale_beside() is so, empty
// where that is usual.
std::string odd_scale(const MeshSize& size, const MeshSize& usual);

// Adds up what single meshes have.
class CaptureKind {
public:
    // A mesh of the capture, positions in mm. has_texture: it has an image, so that it needs no colours.
    void add(const Mesh& mesh, const MeshFindings& findings, bool has_texture);
    // Nothing where types say it.
    std::optional<ColourRange> colour_range() const;
    // Why a mesh, positions in mm, is none of these: a clause behind its name. Empty: it is like the others.
    std::string unlike(const Mesh& mesh, const ColourLevels& levels, bool has_texture) const;
    // What of such a mesh's size is odd, though it may be one of these: as odd_scale() has it.
    std::string odd_size(const Mesh& mesh) const;

private:
    std::size_t meshes_ = 0, coloured_ = 0;
    std::vector<MeshSize> sizes_;  // of those with vertices
    ColourLevels levels_;
    std::array<std::size_t, 3> of_range_{};  // meshes that leave no doubt about their colours' range, by range
};

}  // namespace htvm::app
