#include "codec/encoder/bones/scene_change.h"

#include <algorithm>
#include <vector>

#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

std::vector<Point3f> every(std::span<const LatticePoint> positions, std::size_t stride) {
    std::vector<Point3f> out;
    for (std::size_t k = 0; k < positions.size(); k += stride) out.push_back(point_of(positions[k]));
    return out;
}

bool much_is_far(std::span<const LatticePoint> from, std::span<const LatticePoint> to, LatticeUnits far) {
    constexpr std::size_t samples = 500,
                          searched = 4000;  // points searched; their gaps are far smaller than `far`
    const auto queries = every(from, std::max<std::size_t>(from.size() / samples, 1));
    const NearestPoints tree(every(to, std::max<std::size_t>(to.size() / searched, 1)));
    const auto strays = std::count_if(queries.begin(), queries.end(), [&](const Point3f& query) {
        return static_cast<double>(tree.nearest(query).squared_distance) > far.value * far.value;
    });
    return 10 * static_cast<std::size_t>(strays) > queries.size();
}

}  // namespace

bool scene_changed(std::span<const LatticePoint> captured, std::span<const LatticePoint> predicted, LatticeUnits far) {
    return much_is_far(captured, predicted, far) || much_is_far(predicted, captured, far);
}

}  // namespace htvm::internal
