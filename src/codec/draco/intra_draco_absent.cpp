// In place of intra_draco.cpp where there is no libdraco.
#include "codec/format/frame_payload.h"
#include "htvm/intra_coder.hpp"

namespace htvm {
namespace {

tl::unexpected<Error> without_draco() {
    return fail(ErrorKind::unsupported, "this htvm was built without Draco, so it has no I-frames by Draco");
}

}  // namespace

ExternalIntraCoder draco_intra_coder() {
    return {.number = internal::intra_coder_draco,
            .name = "draco",
            .encode = [](const LatticeMesh&) -> Result<std::vector<std::uint8_t>> { return without_draco(); },
            .decode = [](std::span<const std::uint8_t>) -> Result<LatticeMesh> { return without_draco(); }};
}

}  // namespace htvm
