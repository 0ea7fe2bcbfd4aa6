// BVH files, and what any skeleton file is recognised as: must give a valid track or an error.
#include "import_skeleton.h"
#include "io/skeleton_bvh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    fuzz::check_track(parse_skeleton_bvh(text));
    BvhOptions metres;
    metres.mm_per_unit = 1000;
    fuzz::check_track(parse_skeleton_bvh(text, metres));
    return 0;
}
