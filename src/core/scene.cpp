#include "htvm/scene.hpp"

#include <algorithm>

namespace htvm {

void extend(std::optional<SpaceBounds>& all, const std::optional<SpaceBounds>& more) {
    if (!all) all = more;
    if (!more) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        all->low[axis] = std::min(all->low[axis], more->low[axis]);
        all->high[axis] = std::max(all->high[axis], more->high[axis]);
    }
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
