// A playlist of any text: what is read of it comes back when it is written and read again.
#include <cmath>

#include "container/playlist.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using fuzz::require;
    for (const auto& variant : read_variants({reinterpret_cast<const char*>(data), size}))
        require(!variant.uri.empty() && variant.uri.size() <= 2048,
                "a quality has a name, and no longer one than is taken");
    const auto list = read_playlist({reinterpret_cast<const char*>(data), size});
    if (!list) return 0;
    const auto again = read_playlist(write_playlist(*list));
    require(again.has_value(), "what is written is read");
    require(again->segments.size() == list->segments.size() && again->has_end == list->has_end &&
                again->first_number == list->first_number && again->kind == list->kind,
            "a playlist comes back");
    for (std::size_t i = 0; i < list->segments.size(); ++i) {
        const auto &a = list->segments[i], &b = again->segments[i];
        require(a.uri == b.uri && a.map_uri == b.map_uri && std::abs(a.seconds - b.seconds) < 1e-5,
                "a segment comes back");
    }
    return 0;
}
