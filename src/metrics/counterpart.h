// What one surface has at the places of another, where surfaces come and go: captures from depth cameras are open,
// ragged sheets whose borders move, and what is shown of them may be more than a frame captured (what other frames saw)
// or less.
//
// A place is covered if the other surface lies within a distance of it (5 mm). Else the two differ, and there are two
// reasons, which no distance tells apart:
//
//   absent      The other surface has nothing there: it ends before, or has no such part. A rim that another frame saw,
//               the back of a person seen from the front, a hole behind an arm, a speck. Nobody knows what would be
//               there, so it is no error: it is told as coverage.
//   displaced   The other surface goes on, but elsewhere: a dent, a spike, a limb that was lost. A real error.
//
// Which one it is:
//   1. A place whose nearest place on the other surface lies on its border is beyond where that surface ends: absent.
//   2. Else the patch that it belongs to decides: triangles with their middles uncovered that hang together by edges.
//      It is judged where it leaves what is covered, at those of its triangles that have a covered neighbour: if at
//      half of these sides or more the other surface ends (as in 1), the patch is absent, else it is displaced. So the
//      back of a torso is absent although the front is the nearest, 20 cm through the body; a spike is displaced.
//   3. A patch with no covered neighbour (a speck, a limb captured as a piece of its own, a whole surface that is off)
//      is displaced where the two surfaces are each other's counterpart: the place that is nearest has nothing of its
//      own surface within the distance either. Else the other surface has its own match, and lacks this piece: absent.
//
// Errors "over what is covered" are distances of the places that are covered, the nearest place not on the border, and
// of those that are displaced, with their whole distance. Places in the 5 mm beyond a border are covered, but say
// nothing of an error: how far the nearest border is tells of the fringe alone, and a ragged sheet has metres of it.
// Two closed surfaces near each other have all places covered, and the errors are those of all places.
//
// Weaknesses. An error along an open sheet, or across a narrow one (an arm as a ribbon that is shown beside where it
// was captured), is not told from a border that moved: both are absent, and only the coverage in both directions says
// so; never read one number without the other. A speck, a second arm beside the first, anything that hangs together
// with nothing that is covered, counts as absent too where its surroundings are right. A hole with steep walls counts
// as displaced from its walls and floor, not from what should be across. A patch is one thing or the other as a whole,
// so that an error that hangs together with an absent part is hidden by it, up to what coverage tells. Where sheets
// overlap, a place may be nearest to the border of one and within the other: it is covered, without an error.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"
#include "metrics/surface_border.h"
#include "metrics/surface_samples.h"
#include "metrics/triangle_index.h"

namespace htvm {

inline constexpr double covered_within_mm = 5;  // the default of every option of this meaning

struct NearestPlace {
    Point3 place{};
    std::uint32_t triangle = 0;
    double distance = 0;  // mm
    bool on_border = false;
};

// A surface to look for places on: its triangles, which are indexed, and where they end.
class SearchedSurface {
public:
    // The mesh is lent. It may be without triangles, and must have passed check_measurable. Errors: limit, if memory
    // runs out.
    static Result<SearchedSurface> build(const Mesh& mesh, internal::Threads threads = {});

    const Mesh& mesh() const { return *mesh_; }
    bool is_empty() const { return mesh_->triangles.empty(); }
    // It must not be empty. hint: as TriangleIndex has it; becomes the triangle found. Thread-safe.
    NearestPlace nearest(const Point3& p, std::uint32_t& hint) const;

private:
    SearchedSurface(const Mesh& mesh) : mesh_(&mesh), border_(mesh) {}
    const Mesh* mesh_;
    SurfaceBorder border_;
    std::vector<TriangleIndex> index_;  // one, or none for an empty surface
};

enum class Presence : std::uint8_t { covered, displaced, absent };

struct Counterpart {
    Presence presence = Presence::absent;
    bool counts = false;  // among the errors over what is covered
    double distance = 0;  // mm; infinite if the other surface is empty
    Point3 nearest{};     // on the other surface; the place itself if that is empty
};

// What `other` has at each sample of `own`. within: mm. The number of threads does not change the result.
std::vector<Counterpart> counterparts(std::span<const SurfaceSample> samples, const SearchedSurface& own,
                                      const SearchedSurface& other, double within, internal::Threads threads = {});

}  // namespace htvm
