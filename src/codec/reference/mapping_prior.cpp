#include "codec/reference/mapping_prior.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace htvm::internal {
namespace {

// Twice the triangle's area. Differences have 26 bits, so the products are exact and the root is that of IEEE 754.
double double_area(LatticePoint a, LatticePoint b, LatticePoint c) {
    const LatticePoint u = b - a, v = c - a;
    const double ux = u.x, uy = u.y, uz = u.z, vx = v.x, vy = v.y, vz = v.z;
    const double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    return std::sqrt(x * x + y * y + z * z);
}

std::vector<std::uint8_t> area_classes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    constexpr std::array<double, 9> limits = {0.25, 0.45, 0.62, 0.78, 0.92, 1.08, 1.3, 1.65, 2.4};
    std::vector<double> around(positions.size(), 0);
    double sum = 0;
    for (const auto& t : triangles) {
        const double area = double_area(positions[t[0]], positions[t[1]], positions[t[2]]);
        for (const auto v : t) around[v] += area;
        sum += area * 3;
    }
    const double mean = positions.empty() ? 0 : sum / static_cast<double>(positions.size());
    std::vector<std::uint8_t> out;
    out.reserve(positions.size());
    for (const double area : around) {
        std::uint8_t area_class = 0;
        for (const double limit : limits) area_class = static_cast<std::uint8_t>(area_class + (area >= limit * mean));
        out.push_back(area_class);
    }
    return out;
}

}  // namespace

MappingPrior make_mapping_prior(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    constexpr std::uint32_t most_neighbours = 8;
    MappingPrior out;
    out.area_class = area_classes(positions, triangles);
    // Each triangle (a, b, c) gives each corner the next corner as a neighbour, so an inner vertex gets every neighbour
    // once.
    std::vector<std::uint32_t> count(positions.size(), 0);
    const auto each_lower = [&](const auto& take) {
        for (const auto& t : triangles)
            for (std::size_t i = 0; i < 3; ++i)
                if (t[(i + 1) % 3] < t[i]) take(t[i], t[(i + 1) % 3]);
    };
    each_lower([&](std::uint32_t v, std::uint32_t) { count[v] += count[v] < most_neighbours; });
    out.first_neighbour.assign(positions.size() + 1, 0);
    for (std::size_t v = 0; v < positions.size(); ++v) out.first_neighbour[v + 1] = out.first_neighbour[v] + count[v];
    out.neighbours.resize(out.first_neighbour.back());
    count.assign(positions.size(), 0);
    each_lower([&](std::uint32_t v, std::uint32_t neighbour) {
        if (count[v] < most_neighbours) out.neighbours[out.first_neighbour[v] + count[v]++] = neighbour;
    });
    return out;
}

}  // namespace htvm::internal
