// PLY files, from memory and from a stream: must give the same valid mesh, and the same again after writing.
#include <sstream>

#include "import_mesh.h"
#include "io/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::span<const std::uint8_t> bytes(data, size);
    // The size decides on the options, so that inputs are plain files.
    MeshReadOptions options;
    if (size % 4 > 0) options.colour_range = static_cast<ColourRange>(size % 4 - 1);
    if (size % 3 > 0) options.origin = {1e6, -0.5, 3e38};
    const auto mesh = read_ply(bytes, options);
    const auto first = read_ply_at_start(bytes, options);
    fuzz::require(!mesh || first, "a file that can be read begins with a mesh");
    if (first) {
        const auto& [images, parts, part_of_triangle, files, multiply] = first->findings.texture;
        fuzz::require(part_of_triangle.empty() || part_of_triangle.size() == first->mesh.triangles.size(),
                      "every triangle has a part");
        for (const auto part : part_of_triangle) fuzz::require(part < parts.size(), "which there is");
    }
    std::istringstream stream(std::string(bytes.begin(), bytes.end()));
    PlyStreamReader reader(stream, options);
    for (std::size_t n = 0;; ++n) {
        const auto next = reader.next();
        if (n == 0 && first) fuzz::require(next && *next && fuzz::same(**next, first->mesh), "a stream gives the same");
        if (!next || !*next || n > size) break;
    }
    if (!mesh) return 0;
    fuzz::require_importable(*mesh);
    const auto written = write_ply(*mesh);
    fuzz::require(written.has_value(), "what was read can be written");
    const auto again = read_ply(*written);
    fuzz::require(again && fuzz::same(*again, *mesh), "what was written reads back");
    return 0;
}
