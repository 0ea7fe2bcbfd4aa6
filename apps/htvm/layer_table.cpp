#include "layer_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

namespace htvm::app {
namespace {

using Column = std::pair<const char*, std::size_t LayerBytes::*>;
constexpr std::array<Column, 11> columns = {{{"pose", &LayerBytes::pose},
                                             {"transforms", &LayerBytes::transforms},
                                             {"geometry", &LayerBytes::geometry},
                                             {"colour", &LayerBytes::colour},
                                             {"normals", &LayerBytes::normals},
                                             {"texcoords", &LayerBytes::texcoords},
                                             {"mapping", &LayerBytes::mapping},
                                             {"fans", &LayerBytes::fans},
                                             {"distance order", &LayerBytes::distance_orders},
                                             {"external intra", &LayerBytes::external_intra},
                                             {"overhead", &LayerBytes::overhead}}};

std::string key_of(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

}  // namespace

void add(LayerTotals& totals, const FrameInfo& info) {
    ++totals.frames;
    totals.source_vertices += info.source_vertices;
    for (const auto& [name, member] : columns) totals.bytes.*member += info.bytes.*member;
}

double bits_per_vertex(std::size_t bytes, std::uint64_t vertices) {
    return vertices == 0 ? 0 : 8.0 * static_cast<double>(bytes) / static_cast<double>(vertices);
}

std::string layer_table(const LayerTotals& intra, const LayerTotals& enhanced) {
    LayerTotals all = intra;
    all.frames += enhanced.frames;
    all.source_vertices += enhanced.source_vertices;
    for (const auto& [name, member] : columns) all.bytes.*member += enhanced.bytes.*member;
    std::string out = fmt::format("{:<10}{:>8}", "bits/vertex", "frames");
    for (const auto& [name, member] : columns)
        if (all.bytes.*member > 0) out += fmt::format("{:>16}", name);
    out += fmt::format("{:>10}\n", "total");
    const std::array<std::pair<const char*, const LayerTotals*>, 3> rows = {
        {{"I", &intra}, {"EP", &enhanced}, {"all", &all}}};
    for (const auto& [name, totals] : rows) {
        if (totals->frames == 0) continue;
        out += fmt::format("{:<11}{:>7}", name, totals->frames);
        for (const auto& [column, member] : columns)
            if (all.bytes.*member > 0)
                out += fmt::format("{:>16.3f}", bits_per_vertex(totals->bytes.*member, totals->source_vertices));
        out += fmt::format("{:>10.3f}\n", bits_per_vertex(totals->bytes.total(), totals->source_vertices));
    }
    return out;
}

nlohmann::json layers_json(const LayerBytes& bytes) {
    nlohmann::json out;
    for (const auto& [name, member] : columns) out[key_of(name)] = bytes.*member;
    out["total"] = bytes.total();
    return out;
}

LayerBytes layers_from_json(const nlohmann::json& json) {
    LayerBytes out;
    for (const auto& [name, member] : columns) out.*member = json.at(key_of(name)).get<std::size_t>();
    return out;
}

nlohmann::json frame_json(const FrameInfo& info) {
    return {{"frame", info.frame},
            {"type", type_name(info.type)},
            {"reference", info.reference},
            {"timestamp_us", info.timestamp_us},
            {"source_vertices", info.source_vertices},
            {"source_triangles", info.source_triangles},
            {"vertices", info.vertices},
            {"triangles", info.triangles},
            {"bytes", layers_json(info.bytes)},
            {"bits_per_vertex", bits_per_vertex(info.bytes.total(), info.source_vertices)}};
}

const char* type_name(FrameType type) { return type == FrameType::intra ? "I" : "EP"; }

}  // namespace htvm::app
