// OBJ files: must give a valid mesh or an error; what was read can be written and reads back.
#include "import_mesh.h"
#include "io/obj.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    // The size decides on the options, so that inputs are plain files.
    MeshReadOptions options;
    if (size % 4 > 0) options.colour_range = static_cast<ColourRange>(size % 4 - 1);
    if (size % 3 > 0) options.origin = {1e6, -0.5, 3e38};
    MeshFindings findings;
    const auto mesh = read_obj(text, options, &findings);
    if (!mesh) return 0;
    fuzz::require_importable(*mesh);
    const auto& texture = findings.texture;
    fuzz::require(texture.part_of_triangle.empty() || texture.part_of_triangle.size() == mesh->triangles.size(),
                  "every triangle has a part");
    for (const auto part : texture.part_of_triangle) fuzz::require(part < texture.parts.size(), "which there is");
    const auto written = write_obj(*mesh);
    fuzz::require(written.has_value(), "what was read can be written");
    const auto again = read_obj(*written);
    fuzz::require(again.has_value(), "what was written can be read");
    fuzz::require(
        again->triangles.size() == mesh->triangles.size() && again->positions.size() >= mesh->positions.size(),
        "what was written reads back");
    return 0;
}
