#include "codec/encoder/charts/captured_detail.h"

#include <cmath>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

// How much brightness changes along the edges at each captured vertex.
std::vector<float> change_around(const SurfaceIndex& captured) {
    std::vector<double> changes(captured.positions.size(), 0), lengths(captured.positions.size(), 0);
    const auto brightness = [&](std::uint32_t v) {
        const auto& c = captured.colours[v];
        return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
    };
    for (const auto& t : captured.triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            const auto a = t[i], b = t[(i + 1) % 3];
            const double change = std::abs(brightness(a) - brightness(b));
            const double apart = length(to_vector(captured.positions[a]) - to_vector(captured.positions[b]));
            for (const auto v : {a, b}) {
                changes[v] += change;
                lengths[v] += apart;
            }
        }
    std::vector<float> out;
    for (std::size_t v = 0; v < changes.size(); ++v)
        out.push_back(lengths[v] > 0 ? static_cast<float>(changes[v] / lengths[v]) : 0);
    return out;
}

}  // namespace

std::vector<float> captured_detail(std::span<const LatticePoint> positions, const SurfaceIndex& captured) {
    if (captured.triangles.empty() || captured.colours.size() != captured.positions.size()) return {};
    const auto change = change_around(captured);
    std::vector<float> out(positions.size(), 0);
    std::uint32_t guess = OrientedPoints::no_point;
    const float reach = 8 * captured.fine_gap;
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const auto found = captured.closest_within(point_of(positions[v]), reach, guess);
        if (!found.found()) continue;
        for (std::size_t i = 0; i < 3; ++i) out[v] += found.shares[i] * change[captured.triangles[found.triangle][i]];
    }
    return out;
}

}  // namespace htvm::internal
