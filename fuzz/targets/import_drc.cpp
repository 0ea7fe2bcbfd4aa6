// DRC files through libdraco, which is not ours and not instrumented: must give a valid mesh or an error.
#include "import_mesh.h"
#include "io/drc.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const auto mesh = read_drc({data, size}, {{1u << 20, 1u << 20}});
    if (mesh) fuzz::require_importable(*mesh);
    return 0;
}
