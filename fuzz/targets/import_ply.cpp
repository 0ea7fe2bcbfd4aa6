// PLY files, from memory and from a stream: must give the same valid mesh, and the same again after writing.
#include <sstream>

#include "import_mesh.h"
#include "io/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::span<const std::uint8_t> bytes(data, size);
    const auto mesh = read_ply(bytes);
    const auto first = read_ply_at_start(bytes);
    fuzz::require(!mesh || first, "a file that can be read begins with a mesh");
    std::istringstream stream(std::string(bytes.begin(), bytes.end()));
    PlyStreamReader reader(stream);
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
