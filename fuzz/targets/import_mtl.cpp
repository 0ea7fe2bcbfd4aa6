// Materials of OBJ files: any text is passed over or gives names and images, none longer than the text; so do the names
// on a line of mtllib.
#include "fuzz_input.h"
#include "io/obj_material.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    const std::string text(data, data + size);
    std::size_t length = 0;
    const auto materials = read_obj_materials(text);
    for (const auto& material : materials) length += material.name.size() + material.image.size();
    fuzz::require(length <= size, "names and images are parts of the text");
    if (!materials.empty())
        fuzz::require(find_material(materials, materials.back().name) != nullptr, "a material is found by its name");
    for (const auto& names : material_file_names(text)) {
        std::size_t all = 0;
        for (const auto& name : names) all += name.size();
        fuzz::require(!names.empty() && all <= size, "names are parts of the line");
    }
    return 0;
}
