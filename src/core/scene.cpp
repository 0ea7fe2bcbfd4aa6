#include "htvm/scene.hpp"

#include <algorithm>

namespace htvm {

SpaceBounds united(const SpaceBounds& a, const SpaceBounds& b) {
    SpaceBounds out = a;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        out.low[axis] = std::min(a.low[axis], b.low[axis]);
        out.high[axis] = std::max(a.high[axis], b.high[axis]);
    }
    return out;
}

std::optional<SpaceBounds> bounds_of(std::span<const Vector3f> positions) {
    if (positions.empty()) return std::nullopt;
    SpaceBounds out{positions[0], positions[0]};
    for (const auto& p : positions)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            out.low[axis] = std::min(out.low[axis], p[axis]);
            out.high[axis] = std::max(out.high[axis], p[axis]);
        }
    return out;
}

}  // namespace htvm
