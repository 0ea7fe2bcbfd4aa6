// Materials of OBJ files: any text is passed over or gives names and images, none longer than the text.
#include "fuzz_input.h"
#include "io/obj.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    std::size_t length = 0;
    for (const auto& material : read_obj_materials(text)) length += material.name.size() + material.image.size();
    fuzz::require(length <= size, "names and images are parts of the text");
    return 0;
}
