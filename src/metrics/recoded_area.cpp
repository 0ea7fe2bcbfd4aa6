#include "metrics/recoded_area.h"

#include <algorithm>

#include "metrics/mesh_measures.h"

namespace htvm {

std::size_t kept_triangles(const MeshView& decoded, const FrameInfo& sent) {
    const std::size_t all = decoded.triangles.size();
    switch (sent.type) {
        case FrameType::intra:
        case FrameType::enhanced:
            return 0;
        case FrameType::predicted:
        case FrameType::tracked:
            return all;
        case FrameType::patched:
            return all - std::min<std::size_t>(sent.triangles, all);
    }
    return all;
}

double recoded_share(const MeshView& decoded, const FrameInfo& sent) {
    const double area = surface_area(decoded.positions, decoded.triangles);
    if (!(area > 0)) return 0;
    return surface_area(decoded.positions, decoded.triangles.subspan(kept_triangles(decoded, sent))) / area;
}

}  // namespace htvm
