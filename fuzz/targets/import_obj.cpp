// OBJ files: must give a valid mesh or an error; what was read can be written and reads back.
#include "import_mesh.h"
#include "io/obj.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    const auto mesh = read_obj(text);
    if (!mesh) return 0;
    fuzz::require_importable(*mesh);
    const auto written = write_obj(*mesh);
    fuzz::require(written.has_value(), "what was read can be written");
    const auto again = read_obj(*written);
    fuzz::require(again.has_value(), "what was written can be read");
    fuzz::require(
        again->triangles.size() == mesh->triangles.size() && again->positions.size() >= mesh->positions.size(),
        "what was written reads back");
    return 0;
}
