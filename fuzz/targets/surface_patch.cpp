// Patches of any mesh: what is encoded comes back; damaged layers, and any bytes, give a valid mesh or an error.
#include "codec/tracked/surface_patch.h"

#include <algorithm>

#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

constexpr std::array layers = {Layer::removed, Layer::border, Layer::fans, Layer::geometry, Layer::colour};

SurfacePatch any_patch(const TrackedSurface& tracked, std::int32_t step, fuzz::FuzzInput& input) {
    SurfacePatch out;
    const auto vertices = tracked.positions.size();
    out.removed.assign(vertices, input.flag());
    for (std::uint32_t n = input.below(32); n > 0 && vertices > 0; --n) {
        const std::size_t at = input.below(static_cast<std::uint32_t>(vertices));
        for (std::size_t v = at; v < std::min(at + 1 + n % 4, vertices); ++v) out.removed[v] = !out.removed[v];
    }
    auto corners = open_border(tracked.triangles, out.removed);
    for (std::uint32_t n = input.below(16); n > 0; --n) {
        corners.push_back(static_cast<std::uint32_t>(vertices + out.positions.size()));
        const auto any = [&] { return input.number(lattice_limit / step) * step; };
        out.positions.push_back({any(), any(), any()});
        if (!tracked.colours.empty()) out.colours.push_back({input.u8(), input.u8(), input.u8()});
    }
    for (std::uint32_t n = corners.empty() ? 0 : input.below(48); n > 0; --n) {
        const auto any = [&] { return corners[input.below(static_cast<std::uint32_t>(corners.size()))]; };
        out.triangles.push_back({any(), any(), any()});
    }
    return out;
}

void check_decoded(const FramePayload& payload, const TrackedSurface& tracked, const VertexHierarchy& hierarchy) {
    const auto patched = decode_patch(view_of(payload), tracked, hierarchy);
    if (!patched) return;
    const auto& mesh = patched->mesh;
    require(patched->stays.size() <= tracked.positions.size() && patched->stays.size() <= mesh.positions.size(),
            "no more stay than were there");
    require(mesh.positions.size() - patched->stays.size() <= payload.header.vertices,
            "no more come than the header says");
    require(mesh.colours.size() == (tracked.colours.empty() ? 0 : mesh.positions.size()), "colours as before");
    require(fuzz::all_on_lattice(mesh.positions), "positions are on the lattice");
    require(fuzz::names_vertices(mesh.triangles, mesh.positions.size()), "triangles name vertices");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    std::vector<Colour> colours(input.flag() ? mesh.positions.size() : 0);
    for (auto& colour : colours) colour = {input.u8(), 60, 200};
    const TrackedSurface tracked{mesh.positions, mesh.triangles, colours};
    const auto hierarchy = build_vertex_hierarchy(mesh.positions, mesh.triangles);
    require(hierarchy.has_value(), "any mesh has a hierarchy");

    const PatchSteps steps{1 + static_cast<std::int32_t>(input.below(300)),
                           1 + static_cast<std::int32_t>(input.below(255))};
    FramePayload payload;
    const auto patched = encode_patch(tracked, *hierarchy, any_patch(tracked, steps.geometry, input), steps, payload);
    require(patched.has_value(), "a patch at the open border can be encoded");
    const auto again = decode_patch(view_of(payload), tracked, *hierarchy);
    require(again && again->stays == patched->stays && again->mesh.positions == patched->mesh.positions &&
                again->mesh.triangles == patched->mesh.triangles && again->mesh.colours == patched->mesh.colours,
            "a patch comes back as the encoder promised");

    auto changed = payload;
    for (const auto layer : layers)
        if (input.flag()) changed.set(layer, fuzz::damaged(changed.of(layer), input));
    if (input.flag()) changed.header.vertices = input.below(400);
    if (input.flag()) changed.header.triangles = input.below(800);
    check_decoded(changed, tracked, *hierarchy);

    for (const auto layer : layers) {
        const auto bytes = input.take(layer == layers.back() ? input.left() : input.u16() % 200);
        changed.set(layer, {bytes.begin(), bytes.end()});
    }
    check_decoded(changed, tracked, *hierarchy);
    return 0;
}
