#include "codec/encoder/tracked/texcoord_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

// The captured vertices by cubes of space, each as wide as the reach.
class Cubes {
public:
    Cubes(const LatticeMesh& mesh, double side) : side_(side) {
        entries_.reserve(mesh.positions.size());
        for (std::uint32_t v = 0; v < mesh.positions.size(); ++v)
            entries_.emplace_back(key(cube_of(mesh.positions[v])), v);
        std::sort(entries_.begin(), entries_.end());
    }

    // Calls test(vertex) for those in the cubes around the point until one passes.
    template <class Test>
    bool any_near(const LatticePoint& point, const Test& test) const {
        const auto [x, y, z] = cube_of(point);
        for (std::int64_t dx = -1; dx <= 1; ++dx)
            for (std::int64_t dy = -1; dy <= 1; ++dy)
                for (std::int64_t dz = -1; dz <= 1; ++dz) {
                    const auto wanted = key({x + dx, y + dy, z + dz});
                    auto entry =
                        std::lower_bound(entries_.begin(), entries_.end(), std::pair(wanted, std::uint32_t{0}));
                    for (; entry != entries_.end() && entry->first == wanted; ++entry)
                        if (test(entry->second)) return true;
                }
        return false;
    }

private:
    using Cube = std::array<std::int64_t, 3>;
    Cube cube_of(const LatticePoint& p) const {
        const auto along = [&](std::int32_t c) { return static_cast<std::int64_t>(std::floor(c / side_)); };
        return {along(p.x), along(p.y), along(p.z)};
    }
    static std::int64_t key(const Cube& cube) {
        constexpr std::int64_t most = std::int64_t{1} << 20;  // cubes along an axis
        return ((cube[0] & (most - 1)) * most + (cube[1] & (most - 1))) * most + (cube[2] & (most - 1));
    }
    double side_;
    std::vector<std::pair<std::int64_t, std::uint32_t>> entries_;
};

// How far apart texture coordinates are at points a unit apart: the median of the triangles, since a few that lie
// across a seam can span the whole atlas.
double texcoords_per_unit(const LatticeMesh& mesh) {
    std::vector<double> ratios;
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto edge = [&](std::uint32_t from, std::uint32_t to) {
            const auto &p = mesh.positions[from], &q = mesh.positions[to];
            return Vector3d{double(q.x) - p.x, double(q.y) - p.y, double(q.z) - p.z};
        };
        const auto texcoord_edge = [&](std::uint32_t from, std::uint32_t to) {
            const auto &p = mesh.texcoords[from], &q = mesh.texcoords[to];
            return std::array<double, 2>{double(q[0]) - p[0], double(q[1]) - p[1]};
        };
        const double area = length(cross(edge(a, b), edge(a, c)));
        const auto s = texcoord_edge(a, b), t = texcoord_edge(a, c);
        if (area > 0) ratios.push_back(std::sqrt(std::abs(s[0] * t[1] - s[1] * t[0]) / area));
    }
    if (ratios.empty()) return 0;
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    return *middle;
}

}  // namespace

double share_with_other_texcoords(const LatticeMesh& tracked, const LatticeMesh& captured, LatticeUnits within) {
    const double reach = within.value;
    if (tracked.texcoords.empty() || captured.texcoords.empty() || !(reach > 0)) return 0;
    constexpr std::size_t wanted = 2000;
    constexpr double stretch = 2;  // of parts of the atlas, against its median
    const double reach_squared = reach * reach;
    const double tolerance = std::max(stretch * reach * texcoords_per_unit(captured), 1.0);
    const Cubes cubes(captured, reach);
    std::size_t samples = 0, others = 0;
    for (std::size_t v = 0, every = 1 + tracked.positions.size() / wanted; v < tracked.positions.size(); v += every) {
        const auto& p = tracked.positions[v];
        const auto& t = tracked.texcoords[v];
        bool near = false;
        const bool same = cubes.any_near(p, [&](std::uint32_t w) {
            const auto& q = captured.positions[w];
            const double x = double(q.x) - p.x, y = double(q.y) - p.y, z = double(q.z) - p.z;
            if (x * x + y * y + z * z > reach_squared) return false;
            near = true;
            const auto& u = captured.texcoords[w];
            return std::hypot(double(u[0]) - t[0], double(u[1]) - t[1]) <= tolerance;
        });
        if (!near) continue;  // tracking is lost there, which is for others to judge
        ++samples;
        others += same ? 0 : 1;
    }
    return samples > 0 ? static_cast<double>(others) / static_cast<double>(samples) : 0;
}

}  // namespace htvm::internal
