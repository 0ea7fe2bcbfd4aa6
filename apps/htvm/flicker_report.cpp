#include "flicker_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace htvm::app {
namespace {

// Ascending: by how much frames stand out from the T-frames beside them.
struct StandingOut {
    std::vector<double> values;
    double median() const { return values[values.size() / 2]; }
    double largest() const { return values.back(); }
};

// Several frames together, in one shading.
struct FlickerTotal {
    std::size_t frames = 0;
    ChangeSums sums;
    StandingOut ratio, still;  // of a single kind
};

StandingOut standing_out(const std::vector<FlickerFrame>& frames, ChangeSums FrameFlicker::*shading, FrameType kind,
                         double (*measure)(const ChangeSums&)) {
    std::vector<FrameType> kinds;
    std::vector<double> values;
    for (const auto& frame : frames) {
        const bool changed = frame.kind && frame.change && ((*frame.change).*shading).pixels > 0;
        kinds.push_back(frame.kind.value_or(FrameType::intra));
        values.push_back(changed ? measure((*frame.change).*shading) : std::numeric_limits<double>::infinity());
    }
    StandingOut out;
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (const auto beside = flicker_beside_tracked(kinds, values, i); beside && frames[i].kind == kind)
            out.values.push_back(*beside);
    std::ranges::sort(out.values);
    return out;
}

// kind: only frames of this kind; none: all.
FlickerTotal flicker_total(const std::vector<FlickerFrame>& frames, ChangeSums FrameFlicker::*shading,
                           std::optional<FrameType> kind) {
    FlickerTotal out;
    for (const auto& frame : frames) {
        if (!frame.change || (kind && frame.kind != kind)) continue;
        ++out.frames;
        out.sums += (*frame.change).*shading;
    }
    if (!kind) return out;
    out.ratio = standing_out(frames, shading, *kind, flicker_ratio);
    out.still = standing_out(frames, shading, *kind, still_change);
    return out;
}

}  // namespace

bool has_flicker(const std::vector<FlickerFrame>& frames) {
    return std::ranges::any_of(frames,
                               [](const FlickerFrame& frame) { return frame.change && frame.change->lit.pixels > 0; });
}

namespace {

// The kinds that there are, in the order of their table.
std::vector<FrameType> kinds_in(const std::vector<FlickerFrame>& frames) {
    std::vector<FrameType> out;
    for (const auto& kind : frame_kinds)
        if (std::ranges::any_of(frames, [&](const FlickerFrame& f) { return f.change && f.kind == kind.type; }))
            out.push_back(kind.type);
    return out;
}

}  // namespace

std::string flicker_rows(const std::vector<FlickerFrame>& frames, Shading shading_of_lit) {
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}{:>12}{:>12}  {}\n", "flicker: change from frame to frame",
                                  "original", "decoded", "ratio", "still", "over T beside: median, largest");
    const auto add = [&](const std::string& what, const FlickerTotal& total) {
        out += fmt::format("  {:<34}{:>12.3f}{:>12.3f}{:>12.3f}{:>12.3f}", what, original_change(total.sums),
                           decoded_change(total.sums), flicker_ratio(total.sums), still_change(total.sums));
        for (const auto& [name, of] : {std::pair{"ratio", &total.ratio}, std::pair{"still", &total.still}})
            if (!of->values.empty()) out += fmt::format("  {} {:.3f}, {:.3f}", name, of->median(), of->largest());
        out += '\n';
    };
    for (const auto& [name, shading] :
         {std::pair{"RMS levels", &FrameFlicker::lit}, std::pair{"unlit, RMS levels", &FrameFlicker::unlit}}) {
        const auto all = flicker_total(frames, shading, {});
        if (all.sums.pixels == 0 || (shading == &FrameFlicker::unlit && shading_of_lit == Shading::unlit)) continue;
        add(name, all);
        for (const auto kind : kinds_in(frames)) {
            const auto total = flicker_total(frames, shading, kind);
            add(fmt::format("  into {} {}-frame{}", total.frames, kind_of(kind).letter, total.frames == 1 ? "" : "s"),
                total);
        }
    }
    return out;
}

std::string flicker_cells(const FlickerFrame& frame) {
    std::string out = fmt::format(",{}", frame.kind ? kind_of(*frame.kind).letter : "");
    for (const auto measure : {flicker_ratio, still_change})
        for (const auto shading : {&FrameFlicker::lit, &FrameFlicker::unlit}) {
            const bool measured = frame.change && ((*frame.change).*shading).pixels > 0;
            out += measured ? fmt::format(",{:.8g}", measure((*frame.change).*shading)) : ",";
        }
    return out;
}

namespace {

nlohmann::json change_json(const ChangeSums& sums) {
    const auto pixels = static_cast<double>(std::max<std::uint64_t>(sums.pixels, 1));
    return {{"original_levels", original_change(sums)},
            {"decoded_levels", decoded_change(sums)},
            {"ratio", flicker_ratio(sums)},
            {"still_levels", still_change(sums)},
            {"still_share", static_cast<double>(sums.still_pixels) / pixels}};
}

nlohmann::json total_json(const FlickerTotal& total) {
    auto out = change_json(total.sums);
    for (const auto& [name, of] : {std::pair{"ratio", &total.ratio}, std::pair{"still", &total.still}})
        if (!of->values.empty())
            out["over_tracked_beside"][name] = {{"median", of->median()}, {"largest", of->largest()}};
    return out;
}

}  // namespace

nlohmann::json flicker_json(const FrameFlicker& flicker) {
    nlohmann::json out{{"lit", change_json(flicker.lit)}};
    if (flicker.unlit.pixels > 0) out["unlit"] = change_json(flicker.unlit);
    return out;
}

nlohmann::json flicker_json(const std::vector<FlickerFrame>& frames) {
    nlohmann::json out;
    for (const auto& [name, shading] :
         {std::pair{"lit", &FrameFlicker::lit}, std::pair{"unlit", &FrameFlicker::unlit}}) {
        const auto all = flicker_total(frames, shading, {});
        if (all.sums.pixels == 0) continue;
        out[name] = total_json(all);
        for (const auto kind : kinds_in(frames)) {
            const auto total = flicker_total(frames, shading, kind);
            auto& of_kind = out["into"][kind_of(kind).letter];
            of_kind["frames"] = total.frames;
            of_kind[name] = total_json(total);
        }
    }
    return out;
}

}  // namespace htvm::app
