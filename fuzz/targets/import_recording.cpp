// Manifests of recordings, none of whose files are there: must give an error, nothing, or a recording without frames.
#include "fuzz_input.h"
#include "io/recording_manifest.h"
#include "io/skeleton_json_value.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const auto json = parse_json({reinterpret_cast<const char*>(data), size});
    if (!json) return 0;
    for (const auto read : {internal::scandy_recording, internal::universal_recording,
                            internal::geometry_sequence_recording, internal::depthkit_recording}) {
        const auto recording = read(*json, "/nonexistent");
        if (recording && *recording) fuzz::require((*recording)->meshes.empty(), "no file was found");
    }
    return 0;
}
