// glTF files, .glb and .gltf: must give a valid mesh or an error; what was read can be written and reads back.
#include "import_mesh.h"
#include "io/gltf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    // Nodes may show a mesh many times: a small file can be a large mesh.
    const MeshReadOptions limits{{100000, 100000}};
    const auto mesh = read_gltf({data, size}, {}, limits);
    if (!mesh) return 0;
    fuzz::require_importable(*mesh);
    const auto written = write_gltf(*mesh);
    fuzz::require(written.has_value(), "what was read can be written");
    auto again = read_gltf(*written, {}, limits);
    fuzz::require(again && again->texcoords.size() == mesh->texcoords.size(), "what was written can be read");
    again->texcoords = mesh->texcoords;  // 1 - v is not exact
    fuzz::require(fuzz::same(*again, *mesh), "what was written reads back");
    return 0;
}
