// I-frames with levels: any layers on any base give a mesh and its detail, no more than may be, on the lattice; or an
// error. What is left of the detail after any part of the mesh goes, and triangles come that lie on others, is no more
// than before.
#include "codec/intra/leveled_frame.h"

#include <algorithm>

#include "codec/intra/intra_frame.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

constexpr std::size_t most_vertices = 6000;

void check_detail(const SurfaceDetail& detail, const LatticeMesh& mesh) {
    require(detail.levels.size() == detail.rules.size(), "each level has a rule");
    require(detail.colours.size() <= detail.vertices(), "no more colours than vertices");
    const auto shown = detailed(detail, mesh);
    require(shown.positions.size() == mesh.positions.size() + detail.vertices(), "all of its vertices are shown");
    require(fuzz::all_on_lattice(shown.positions), "its vertices are on the lattice");
    require(fuzz::names_vertices(shown.triangles, shown.positions.size()), "corners exist");
    require(mesh.colours.empty() || shown.colours.size() == shown.positions.size(), "each vertex has a colour");
    require(mesh.normals.empty() || shown.normals.size() == shown.positions.size(), "each vertex has a normal");
    if (detail.empty()) return;
    std::vector<std::uint8_t> presence(mesh.positions.size(), 1);
    add_detail(detail, detail.levels.size(), presence);
    require(presence.size() == shown.positions.size(), "of each vertex it is known whether it is there");
}

void check_patched(const LeveledFrame& frame, fuzz::FuzzInput& input) {
    LatticeMesh patched;
    std::vector<std::uint32_t> stays, number(frame.mesh.positions.size(), no_element);
    const std::uint32_t of = 1 + input.below(20);
    for (std::uint32_t v = 0; v < number.size(); ++v) {
        if (of > 1 && (v * 7u + of) % of == 0) continue;
        number[v] = static_cast<std::uint32_t>(stays.size());
        stays.push_back(v);
        patched.positions.push_back(frame.mesh.positions[v]);
    }
    for (const auto& t : frame.mesh.triangles)
        if (number[t[0]] != no_element && number[t[1]] != no_element && number[t[2]] != no_element)
            patched.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    if (!patched.triangles.empty())
        for (std::uint32_t n = input.below(256); n > 0; --n)
            patched.triangles.push_back(
                patched.triangles[input.below(static_cast<std::uint32_t>(patched.triangles.size()))]);
    const auto detail = detail_that_stays(frame.detail, frame.mesh.positions.size(), stays, patched);
    require(detail.vertices() <= frame.detail.vertices(), "detail does not grow");
    for (const auto& level : detail.levels)
        require(level.triangles.size() <= 4 * (patched.positions.size() + frame.detail.vertices()),
                "no more triangles than may be");
    check_detail(detail, patched);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto small = fuzz::small_mesh(input);
    LatticeMesh base;
    base.positions = small.positions;
    base.triangles = small.triangles;
    for (auto& p : base.positions) p = {p.x / 8 * 8, p.y / 8 * 8, p.z / 8 * 8};
    FramePayload payload;
    IntraFrameOptions options;
    options.geometry_step = 8;
    options.merge_duplicates = false;
    const auto coded = encode_intra_frame(base, options, payload);
    require(coded.has_value(), "any mesh can be a base");
    payload.header.intra_coder = intra_coder_levels;
    // What the layers make of it is not known before they are decoded, so their counts are tried out.
    const std::uint32_t referred = input.below(10);
    const auto colours = input.take(input.below(64)), normals = input.take(input.below(64));
    const auto level_colours = input.take(input.below(128));
    const bool has_colours = input.flag(), has_normals = input.flag(), has_level_colours = input.flag();
    const auto rest = input.take(input.left() - std::min<std::size_t>(input.left(), 16));
    payload.set(Layer::levels, write_levels_layer(referred, {payload.header.vertices, payload.header.triangles}, rest));
    const auto surface = decode_surface_levels(rest, *coded, most_vertices);
    const auto header = read_levels_header(rest);
    if (surface && header) {
        const auto whole = leveled_frame(header->levels, *surface, referred);
        payload.header.vertices = static_cast<std::uint32_t>(whole.mesh.positions.size());
        payload.header.triangles = static_cast<std::uint32_t>(whole.mesh.triangles.size());
    }
    if (has_colours) payload.set(Layer::colour, {colours.begin(), colours.end()});
    if (has_normals) payload.set(Layer::normals, {normals.begin(), normals.end()});
    if (has_level_colours) payload.set(Layer::level_colours, {level_colours.begin(), level_colours.end()});
    const auto frame = decode_leveled_frame(view_of(payload), most_vertices);
    if (!frame) return 0;
    require(surface.has_value() && header.has_value(), "its levels decode by themselves");
    require(frame->mesh.positions.size() + frame->detail.vertices() <=
                std::max(most_vertices, frame->mesh.positions.size()),
            "no more vertices than allowed");
    require(frame->detail.vertices() <= most_detail * frame->mesh.positions.size(), "no more detail than may be");
    check_detail(frame->detail, frame->mesh);
    if (!frame->detail.empty()) {
        const auto shown = detailed(frame->detail, frame->mesh);
        require(shown.positions == surface->positions && shown.triangles == surface->finest(),
                "the mesh with its detail is the surface");
    }
    check_patched(*frame, input);
    return 0;
}
