// Volograms in one file: must give valid meshes or an error.
#include "import_mesh.h"
#include "io/vologram.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const auto vologram = open_vologram(byte_source(std::span(data, size)));
    if (!vologram) return 0;
    for (std::size_t frame = 0; frame < vologram->frames.size() && frame < 100; ++frame)
        if (const auto mesh = read_vologram_frame(*vologram, frame)) fuzz::require_importable(*mesh);
    return 0;
}
