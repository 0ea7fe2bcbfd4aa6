#include "region_report.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "comparison_output.h"
#include "metrics/region_error.h"

namespace htvm::app {
namespace {

// Frames of which the worst regions are summed up together. kind: of a stream's frame.
struct RegionGroup {
    const char* name;
    const char* key;
    bool (*has)(std::optional<FrameType> kind);
};
constexpr std::array region_groups = {
    RegionGroup{"all frames", "all", [](std::optional<FrameType>) { return true; }},
    RegionGroup{"I-frames", "intra", [](std::optional<FrameType> kind) { return kind == FrameType::intra; }},
    RegionGroup{"the others", "between",
                [](std::optional<FrameType> kind) { return kind && kind != FrameType::intra; }},
};

RegionErrorSummary worst_regions(const WorstRegions& frames, const RegionGroup& group) {
    std::vector<double> worst;
    for (std::size_t i = 0; i < frames.worst_mm.size(); ++i)
        if (!std::isnan(frames.worst_mm[i]) && group.has(frames.kinds[i])) worst.push_back(frames.worst_mm[i]);
    return summarise(std::move(worst));
}

}  // namespace

std::string region_rows(const char* title, const WorstRegions& frames) {
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}{:>12}\n", title, "median", "99 %", "largest");
    for (const auto& group : region_groups) {
        const auto sums = worst_regions(frames, group);
        if (sums.frames == 0) continue;
        out +=
            row(fmt::format("  of {} ({})", group.name, sums.frames), sums.median_mm, sums.p99_mm, sums.largest_mm, 3);
    }
    return out;
}

nlohmann::json regions_json(const WorstRegions& frames) {
    nlohmann::json out;
    for (const auto& group : region_groups) {
        const auto sums = worst_regions(frames, group);
        if (sums.frames == 0) continue;
        out[group.key] = {{"frames", sums.frames},
                          {"median_mm", sums.median_mm},
                          {"p99_mm", sums.p99_mm},
                          {"largest_mm", sums.largest_mm}};
    }
    return out;
}

}  // namespace htvm::app
