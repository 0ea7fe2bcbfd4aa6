#include "codec/encoder/tracked/mesh_borders.h"

#include <algorithm>
#include <cstddef>

namespace htvm::internal {

Sides::Sides(std::span<const LatticePoint> positions, std::span<const Triangle> triangles)
    : triangles_(triangles), twin_(3 * triangles.size(), no_side) {
    // The sides that leave each vertex, ascending, in compressed rows, with where they lead.
    struct Leaving {
        std::uint32_t side = 0, to = 0;
    };
    std::vector<std::uint32_t> first(positions.size() + 1, 0);
    std::vector<Leaving> leaving(twin_.size());
    for (const auto& t : triangles)
        for (const auto v : t) ++first[v + std::size_t{1}];
    for (std::size_t v = 0; v < positions.size(); ++v) first[v + 1] += first[v];
    std::vector<std::uint32_t> next_free(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0, s = 0; t < triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i, ++s) leaving[next_free[triangles[t][i]]++] = {s, triangles[t][(i + 1) % 3]};
    const auto row = [&](std::uint32_t v) {
        return std::span(leaving).subspan(first[v], first[v + std::size_t{1}] - first[v]);
    };
    const auto find = [&](std::uint32_t a, std::uint32_t b, std::vector<std::uint32_t>& found) {
        found.clear();
        for (const auto& side : row(a))
            if (side.to == b) found.push_back(side.side);
    };
    // The side from a to b, if there is one alone.
    const auto only = [&](std::uint32_t a, std::uint32_t b) {
        std::uint32_t found = no_side, count = 0;
        for (const auto& side : row(a))
            if (side.to == b) found = side.side, ++count;
        return count == 1 ? found : no_side;
    };
    const auto agreement = [&](std::uint32_t a, std::uint32_t b) {
        return dot(normal_of(positions, triangles[a / 3]), normal_of(positions, triangles[b / 3]));
    };
    std::vector<std::uint32_t> along, against;
    for (std::uint32_t s = 0; s < twin_.size(); ++s) {
        if (from(s) == to(s)) twin_[s] = s;  // of a triangle that names a vertex twice: never a border
        if (twin_[s] != no_side) continue;
        const auto other = only(to(s), from(s));
        if (other != no_side && only(from(s), to(s)) == s) {
            twin_[s] = other, twin_[other] = s;
            continue;
        }
        find(from(s), to(s), along);
        find(to(s), from(s), against);
        for (std::size_t pairs = std::min(along.size(), against.size()); pairs > 0; --pairs) {
            double best = -2;
            std::size_t a = 0, b = 0;
            for (std::size_t i = 0; i < along.size(); ++i)
                for (std::size_t j = 0; j < against.size(); ++j)
                    if (const double agrees = agreement(along[i], against[j]); agrees > best)
                        best = agrees, a = i, b = j;
            twin_[along[a]] = against[b], twin_[against[b]] = along[a];
            along.erase(along.begin() + static_cast<std::ptrdiff_t>(a));
            against.erase(against.begin() + static_cast<std::ptrdiff_t>(b));
        }
    }
}

}  // namespace htvm::internal
