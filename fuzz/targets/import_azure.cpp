// Azure Kinect's skeleton files, and any skeleton file recognised by its contents: must give a valid track or an error.
#include "import_skeleton.h"
#include "io/skeleton_azure.h"
#include "io/skeleton_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    fuzz::check_track(parse_skeleton_azure(text));
    fuzz::check_track(parse_skeleton(text));
    return 0;
}
