// The project's own skeleton files: must give a valid track or an error; what was read can be written and reads back.
#include "import_skeleton.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    fuzz::check_track(parse_skeleton_json(text));
    return 0;
}
