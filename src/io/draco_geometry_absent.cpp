// In place of draco_geometry.cpp where there is no libdraco.
#include "io/draco_geometry.h"

namespace htvm::internal {

Result<DracoGeometry> read_draco_geometry(std::span<const std::uint8_t>, const MeshLimits&) {
    return fail(ErrorKind::unsupported, "this htvm was built without Draco, so it cannot read Draco's meshes");
}

Result<std::vector<double>> draco_rows(const DracoGeometry&, const DracoAttribute&) {
    return fail(ErrorKind::unsupported, "this htvm was built without Draco, so it cannot read Draco's meshes");
}

}  // namespace htvm::internal
