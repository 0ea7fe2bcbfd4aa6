#include "command_line/layer_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
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

void add(TotalsByType& totals, const FrameInfo& info) { add(totals.of(info.type), info); }

LayerTotals TotalsByType::all() const {
    LayerTotals out;
    for (const auto& sums : totals) {
        out.frames += sums.frames;
        out.source_vertices += sums.source_vertices;
        for (const auto& [name, member] : columns) out.bytes.*member += sums.bytes.*member;
    }
    return out;
}

double bits_per_vertex(std::size_t bytes, std::uint64_t vertices) {
    return vertices == 0 ? 0 : 8.0 * static_cast<double>(bytes) / static_cast<double>(vertices);
}

std::string layer_table(const TotalsByType& totals) {
    const LayerTotals all = totals.all();
    std::string out = fmt::format("{:<10}{:>8}", "bits/vertex", "frames");
    for (const auto& [name, member] : columns)
        if (all.bytes.*member > 0) out += fmt::format("{:>16}", name);
    out += fmt::format("{:>10}\n", "total");
    const auto row = [&](const char* row_name, const LayerTotals& sums) {
        if (sums.frames == 0) return;
        out += fmt::format("{:<11}{:>7}", row_name, sums.frames);
        for (const auto& [column, member] : columns)
            if (all.bytes.*member > 0)
                out += fmt::format("{:>16.3f}", bits_per_vertex(sums.bytes.*member, sums.source_vertices));
        out += fmt::format("{:>10.3f}\n", bits_per_vertex(sums.bytes.total(), sums.source_vertices));
    };
    for (const auto type : all_frame_types) row(type_name(type), totals.of(type));
    row("all", all);
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

const char* type_name(FrameType type) {
    switch (type) {
        case FrameType::intra:
            return "I";
        case FrameType::enhanced:
            return "EP";
        case FrameType::predicted:
            return "P";
        case FrameType::tracked:
            return "T";
    }
    return "?";
}

std::optional<FrameType> type_named(const std::string& name) {
    for (const auto type : all_frame_types)
        if (name == type_name(type)) return type;
    return std::nullopt;
}

}  // namespace htvm::app
