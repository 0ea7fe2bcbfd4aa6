// Which sides of a mesh's triangles lie against each other, and its borders: chains of sides that no other lies
// against.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/lattice.h"

namespace htvm::internal {

inline constexpr std::uint32_t no_side = std::numeric_limits<std::uint32_t>::max();

inline double area_of(std::span<const LatticePoint> positions, const Triangle& t) {
    return length(area_vector(positions, t)) / 2;
}
inline Vector3d normal_of(std::span<const LatticePoint> positions, const Triangle& t) {
    return normalised(area_vector(positions, t));
}

// The sides of a mesh's triangles, each in the direction in which its triangle names its ends, and which lie against
// each other. Where more than two triangles meet in an edge, as where two surfaces touch, those that continue each
// other best belong together: borders then never end there.
class Sides {
public:
    // The triangles have to last as long.
    Sides(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);
    std::uint32_t count() const { return static_cast<std::uint32_t>(twin_.size()); }
    std::uint32_t from(std::uint32_t side) const { return triangles_[side / 3][side % 3]; }
    std::uint32_t to(std::uint32_t side) const { return triangles_[side / 3][(side + 1) % 3]; }
    // The side of the triangle on the other side of the edge; no_side on a border.
    std::uint32_t twin(std::uint32_t side) const { return twin_[side]; }
    // The next side of the same triangle.
    static std::uint32_t next(std::uint32_t side) { return side - side % 3 + (side + 1) % 3; }

private:
    std::span<const Triangle> triangles_;
    std::vector<std::uint32_t> twin_;
};

// The borders of the part of a mesh whose triangles stay: cycles of sides that have this part to their left. They are
// followed by turning around each vertex, so that borders that touch in one are told apart.
template <class Stays>
std::vector<std::vector<std::uint32_t>> border_loops(const Sides& sides, const Stays& stays) {
    const auto on_border = [&](std::uint32_t s) { return sides.twin(s) == no_side || !stays(sides.twin(s) / 3); };
    std::vector<bool> seen(sides.count(), false);
    std::vector<std::vector<std::uint32_t>> out;
    for (std::uint32_t first = 0; first < sides.count(); ++first) {
        if (seen[first] || !stays(first / 3) || !on_border(first)) continue;
        auto& loop = out.emplace_back();
        for (std::uint32_t s = first; !seen[s];) {
            seen[s] = true;
            loop.push_back(s);
            s = Sides::next(s);
            while (!on_border(s)) s = Sides::next(sides.twin(s));
        }
    }
    return out;
}

}  // namespace htvm::internal
