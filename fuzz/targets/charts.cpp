// The layer of charts over any mesh: any layout comes back as it was, the encoder's own fits into its picture, and
// damaged layers, or any bytes, give valid coordinates or an error.
#include <algorithm>

#include "codec/charts/chart_layer.h"
#include "codec/encoder/charts/chart_packing.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

ChartLayout any_layout(std::size_t triangles, fuzz::FuzzInput& input) {
    ChartLayout out;
    out.scale = 1 + input.below(largest_scale);
    for (std::size_t t = 0; t < triangles; ++t) {
        const auto so_far = static_cast<std::uint32_t>(out.charts.size());
        const std::uint32_t chart = so_far == 0 ? 0 : std::min(input.below(so_far + 1), std::uint32_t{most_charts - 1});
        out.chart_of_triangle.push_back(chart);
        if (chart != so_far) continue;
        Chart next;
        next.rotation.largest = static_cast<std::uint8_t>(input.below(4));
        for (auto& c : next.rotation.others) c = static_cast<std::int16_t>(coarse_rotation * input.between(-64, 64));
        next.size = input.between(1, largest_size);
        next.x = input.between(0, 4095);
        next.y = input.between(0, 4095);
        out.charts.push_back(next);
    }
    return out;
}

void check_shown(std::size_t vertices, std::span<const Triangle> triangles, std::vector<CornerTexcoords> corners) {
    constexpr std::int32_t side = 1 << picture_bits;
    for (const auto& triangle : corners)
        for (const auto& [u, v] : triangle)
            require(u >= 0 && u <= side && v >= 0 && v <= side, "coordinates lie in the picture");
    const auto textured = textured_surface(vertices, triangles, std::move(corners));
    if (!textured) return;
    require(textured->texcoords.size() == vertices + textured->copied.size(), "a vertex more for each copy");
    require(fuzz::names_vertices(textured->triangles, textured->texcoords.size()), "triangles name vertices");
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) {
            const auto shown = textured->triangles[t][i];
            require((shown < vertices ? shown : textured->copied[shown - vertices]) == triangles[t][i],
                    "a corner is its vertex or a copy of it");
            require(textured->texcoords[shown] == textured->corners[t][i], "a corner has its coordinates");
        }
}

void check_decoded(std::span<const std::uint8_t> bytes, const fuzz::SmallMesh& mesh, const StreamTexture& picture) {
    const auto layout = decode_charts(bytes, mesh.positions, mesh.triangles);
    if (!layout) return;
    auto corners = chart_texcoords(*layout, picture, mesh.positions, mesh.triangles);
    if (corners) check_shown(mesh.positions.size(), mesh.triangles, std::move(*corners));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const StreamTexture picture{TextureLayout::charts, input.between(1, 4096), input.between(1, 4096)};
    const auto layout = any_layout(mesh.triangles.size(), input);
    const auto bytes = encode_charts(layout, mesh.positions, mesh.triangles);
    if (!mesh.triangles.empty()) {
        const auto again = decode_charts(bytes, mesh.positions, mesh.triangles);
        require(again && again->scale == layout.scale && again->chart_of_triangle == layout.chart_of_triangle &&
                    again->charts.size() == layout.charts.size(),
                "a layout comes back");
        for (std::size_t i = 0; i < layout.charts.size(); ++i) {
            const auto &a = again->charts[i], &b = layout.charts[i];
            require(a.rotation == b.rotation && a.size == b.size && a.x == b.x && a.y == b.y, "its charts come back");
        }
    }
    check_decoded(fuzz::damaged(bytes, input), mesh, picture);

    if (input.flag() && !mesh.triangles.empty()) {
        const StreamTexture usual{TextureLayout::charts, 256, 256};
        const auto placed = lay_out(mesh.positions, mesh.triangles, usual);
        if (placed) {
            const auto again = decode_charts(placed->layer, mesh.positions, mesh.triangles);
            require(again.has_value(), "the encoder's layer can be decoded");
            const auto corners = chart_texcoords(*again, usual, mesh.positions, mesh.triangles);
            require(corners && *corners == placed->corners, "to the encoder's coordinates");
            check_shown(mesh.positions.size(), mesh.triangles, placed->corners);
        }
    }
    check_decoded(input.rest(), mesh, picture);
    return 0;
}
