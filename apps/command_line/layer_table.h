// How the bytes of a sequence are distributed over layers, summed over frames, and why its I- and TP-frames were sent,
// as text and as JSON.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "htvm/frame.hpp"

namespace htvm::app {

struct LayerTotals {
    std::size_t frames = 0;
    std::uint64_t source_vertices = 0;  // the "v" of bits per vertex: vertices of the captured meshes
    LayerBytes bytes;
    std::array<std::size_t, frame_reasons.size()> reasons{};  // how many frames each has
};

void add(LayerTotals& totals, const FrameInfo& info);
void add(LayerTotals& totals, const LayerTotals& others);

// The same for each kind of frame.
struct TotalsByType {
    std::array<LayerTotals, frame_type_count> totals;
    LayerTotals& of(FrameType type) { return totals[static_cast<std::size_t>(type)]; }
    const LayerTotals& of(FrameType type) const { return totals[static_cast<std::size_t>(type)]; }
    LayerTotals all() const;
};
void add(TotalsByType& totals, const FrameInfo& info);
void add(TotalsByType& totals, const TotalsByType& others);

// Bits per captured vertex; 0 if there is no vertex.
double bits_per_vertex(std::size_t bytes, std::uint64_t vertices);

// A table of bits per vertex by layer, one line per kind of frame and one for all, and the layers' shares of all bytes.
std::string layer_table(const TotalsByType& totals);

// "why I: 2 due, 1 region; why TP: 7 border" and the end of the line; nothing if no frame has a reason.
std::string reasons_text(const TotalsByType& totals);
// The same numbers by letter and name: {"I": {"due": 2, "region": 1}, "TP": {"border": 7}}.
nlohmann::json reasons_json(const TotalsByType& totals);

nlohmann::json layers_json(const LayerBytes& bytes);
// The inverse; throws as nlohmann-json does if a layer is missing or not a number.
LayerBytes layers_from_json(const nlohmann::json& json);
nlohmann::json frame_json(const FrameInfo& info);

}  // namespace htvm::app
