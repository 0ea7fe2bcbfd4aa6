// Zippering of any two meshes: the result indexes existing vertices, and begins with what was coded.
#include "codec/bones/zipper.h"

#include "codec/bones/enhanced_frame.h"
#include "small_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    const std::size_t bones = input.u8();
    const auto bits = input.take(input.below(40));
    if (const auto coded_bones = read_coded_bones(bits, bones)) {
        const auto again = read_coded_bones(write_coded_bones(*coded_bones), bones);
        require(again && *again == *coded_bones, "coded bones come back");
    }
    const auto a = fuzz::small_mesh(input), b = fuzz::small_mesh(input);
    LatticeMesh coded, animated;
    coded.positions = a.positions;
    coded.triangles = a.triangles;
    animated.positions = b.positions;
    animated.triangles = b.triangles;
    if (input.flag()) {
        coded.colours.assign(a.positions.size(), {1, 2, 3});
        animated.colours.assign(b.positions.size(), {4, 5, 6});
    }
    const std::uint32_t from = input.u16(), to = input.u16();
    std::vector<std::uint8_t> still;
    for (std::size_t v = 0; v < b.positions.size(); ++v)
        still.push_back(v < 64 ? input.flag() : v >= from % 300 && v < to % 300);
    const auto joined = zipper(coded, animated, still, {});
    require(fuzz::names_vertices(joined.triangles, joined.positions.size()), "triangles of vertices that are there");
    require(joined.positions.size() >= a.positions.size() && joined.triangles.size() >= a.triangles.size() &&
                std::equal(a.positions.begin(), a.positions.end(), joined.positions.begin()) &&
                std::equal(a.triangles.begin(), a.triangles.end(), joined.triangles.begin()),
            "what was coded comes first");
    require(joined.colours.size() == (coded.colours.empty() && animated.colours.empty() ? 0 : joined.positions.size()),
            "attributes of every vertex");
    return 0;
}
