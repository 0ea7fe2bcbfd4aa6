#include "command_line/layer_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace htvm::app {
namespace {

// The parts by which a frame's bytes are listed: its layers, and the rest.
template <class Visit>
void for_each_part(const LayerBytes& bytes, const Visit& visit) {
    for (const auto& [layer, name] : frame_layers) visit(name, bytes[layer]);
    visit("overhead", bytes.overhead);
}

// The reasons that are told of any of these frames: visit(name, frames).
template <class Visit>
void for_each_reason(const LayerTotals& totals, const Visit& visit) {
    for (const auto& reason : frame_reasons)
        if (const auto frames = totals.reasons[static_cast<std::size_t>(reason.reason)];
            frames > 0 && reason.reason != FrameReason::none)
            visit(reason.name, frames);
}

std::string key_of(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

}  // namespace

void add(LayerTotals& totals, const FrameInfo& info) {
    ++totals.frames;
    totals.source_vertices += info.source_vertices;
    totals.bytes += info.bytes;
    ++totals.reasons[static_cast<std::size_t>(info.reason)];
}

void add(LayerTotals& totals, const LayerTotals& others) {
    totals.frames += others.frames;
    totals.source_vertices += others.source_vertices;
    totals.bytes += others.bytes;
    for (std::size_t i = 0; i < totals.reasons.size(); ++i) totals.reasons[i] += others.reasons[i];
}

void add(TotalsByType& totals, const FrameInfo& info) { add(totals.of(info.type), info); }

void add(TotalsByType& totals, const TotalsByType& others) {
    for (std::size_t type = 0; type < frame_type_count; ++type) add(totals.totals[type], others.totals[type]);
}

LayerTotals TotalsByType::all() const {
    LayerTotals out;
    for (const auto& sums : totals) add(out, sums);
    return out;
}

double bits_per_vertex(std::size_t bytes, std::uint64_t vertices) {
    return vertices == 0 ? 0 : 8.0 * static_cast<double>(bytes) / static_cast<double>(vertices);
}

std::string layer_table(const TotalsByType& totals) {
    const LayerTotals all = totals.all();
    std::vector<std::string> columns;  // for everything that any frame has
    for_each_part(all.bytes, [&](const char* name, std::size_t bytes) {
        if (bytes > 0) columns.emplace_back(name);
    });
    std::string out = fmt::format("{:<10}{:>8}", "bits/vertex", "frames");
    for (const auto& name : columns) out += fmt::format("{:>16}", name);
    out += fmt::format("{:>10}\n", "total");
    const auto row = [&](const char* row_name, const LayerTotals& sums) {
        if (sums.frames == 0) return;
        out += fmt::format("{:<11}{:>7}", row_name, sums.frames);
        for_each_part(sums.bytes, [&](const char* name, std::size_t bytes) {
            if (std::find(columns.begin(), columns.end(), name) != columns.end())
                out += fmt::format("{:>16.3f}", bits_per_vertex(bytes, sums.source_vertices));
        });
        out += fmt::format("{:>10.3f}\n", bits_per_vertex(sums.bytes.total(), sums.source_vertices));
    };
    for (const auto& kind : frame_kinds) row(kind.letter, totals.of(kind.type));
    row("all", all);
    if (all.bytes.total() == 0) return out;
    const auto share = [&](std::size_t bytes) {
        return 100.0 * static_cast<double>(bytes) / static_cast<double>(all.bytes.total());
    };
    out += fmt::format("{:<18}", "% of all");
    for_each_part(all.bytes, [&](const char*, std::size_t bytes) {
        if (bytes > 0) out += fmt::format("{:>16.1f}", share(bytes));
    });
    out += fmt::format("{:>10.1f}\n", share(all.bytes.total()));
    return out;
}

std::string reasons_text(const TotalsByType& totals) {
    std::string out;
    for (const auto& kind : frame_kinds) {
        std::string reasons;
        for_each_reason(totals.of(kind.type), [&](const char* name, std::size_t frames) {
            reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", frames, name);
        });
        if (!reasons.empty()) out += fmt::format("{}why {}: {}", out.empty() ? "" : "; ", kind.letter, reasons);
    }
    return out.empty() ? out : out + "\n";
}

nlohmann::json reasons_json(const TotalsByType& totals) {
    auto out = nlohmann::json::object();
    for (const auto& kind : frame_kinds)
        for_each_reason(totals.of(kind.type),
                        [&](const char* name, std::size_t frames) { out[kind.letter][name] = frames; });
    return out;
}

nlohmann::json layers_json(const LayerBytes& bytes) {
    nlohmann::json out;
    for_each_part(bytes, [&](const char* name, std::size_t part) { out[key_of(name)] = part; });
    out["total"] = bytes.total();
    return out;
}

LayerBytes layers_from_json(const nlohmann::json& json) {
    LayerBytes out;
    for (const auto& [layer, name] : frame_layers) out[layer] = json.at(key_of(name)).get<std::size_t>();
    out.overhead = json.at("overhead").get<std::size_t>();
    return out;
}

nlohmann::json frame_json(const FrameInfo& info) {
    nlohmann::json out = {{"frame", info.frame},
                          {"type", kind_of(info.type).letter},
                          {"reference", info.reference},
                          {"timestamp_us", info.timestamp_us},
                          {"source_vertices", info.source_vertices},
                          {"source_triangles", info.source_triangles},
                          {"vertices", info.vertices},
                          {"triangles", info.triangles},
                          {"bytes", layers_json(info.bytes)},
                          {"bits_per_vertex", bits_per_vertex(info.bytes.total(), info.source_vertices)}};
    if (info.reason != FrameReason::none) out["reason"] = name_of(info.reason);
    if (info.group > 1) out["group"] = {{"frames", info.group}, {"place", info.place}};
    return out;
}

}  // namespace htvm::app
