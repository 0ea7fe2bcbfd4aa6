#include "rd_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace htvm::lab {

using namespace app;
namespace {

// Bytes as the tables group them; what no column names is "other".
struct LayerColumn {
    const char* title;
    const char* key;
    std::size_t (*bytes)(const LayerBytes&);
};
constexpr std::array<LayerColumn, 7> layer_columns = {{
    {"geometry", "geometry", [](const LayerBytes& b) { return b.geometry; }},
    {"colour", "colour", [](const LayerBytes& b) { return b.colour; }},
    {"mapping", "mapping", [](const LayerBytes& b) { return b.mapping; }},
    {"fans", "fans", [](const LayerBytes& b) { return b.fans; }},
    {"dist.ord.", "distance_order", [](const LayerBytes& b) { return b.distance_orders; }},
    {"one piece", "one_piece", [](const LayerBytes& b) { return b.external_intra; }},
    {"other", "other",
     [](const LayerBytes& b) { return b.overhead + b.pose + b.transforms + b.normals + b.texcoords; }},
}};

bool measured(std::span<const RdPoint> points, const Measure& measure) {
    return std::any_of(points.begin(), points.end(), [&](const RdPoint& p) { return p.values.contains(measure.key); });
}

std::vector<const Measure*> measured_curves(std::span<const RdPoint> points) {
    std::vector<const Measure*> out;
    for (const auto& measure : measures())
        if (measure.is_curve && measured(points, measure)) out.push_back(&measure);
    return out;
}

std::string number_or_dash(std::optional<double> value, int digits) {
    return value ? fmt::format("{:.{}f}", *value, digits) : std::string("-");
}

std::string layer_cells(const LayerTotals& sums) {
    std::string out;
    for (const auto& column : layer_columns) {
        const auto bytes = column.bytes(sums.bytes);
        out += fmt::format("{:>10}",
                           bytes == 0 ? "-" : fmt::format("{:.3f}", app::bits_per_vertex(bytes, sums.source_vertices)));
    }
    return out;
}

std::string layer_titles() {
    std::string out;
    for (const auto& column : layer_columns) out += fmt::format("{:>10}", column.title);
    return out;
}

std::optional<double> value_of(const RdPoint& point, const Measure& measure) {
    const auto found = point.values.find(measure.key);
    if (found == point.values.end()) return std::nullopt;
    return found->second;
}

// Of the bits.
double intra_share(const RdPoint& point) {
    const auto all = totals(point).bytes.total();
    return all == 0 ? 0 : static_cast<double>(totals(point, FrameType::intra).bytes.total()) / static_cast<double>(all);
}

const RdPoint* extreme(std::span<const RdPoint> points, const std::string& coder, bool cheapest) {
    const RdPoint* out = nullptr;
    for (const auto& point : points) {
        if (point.coder != coder) continue;
        if (!out || (bits_per_vertex(point) < bits_per_vertex(*out)) == cheapest) out = &point;
    }
    return out;
}

}  // namespace

std::vector<std::string> coders_of(std::span<const RdPoint> points) {
    std::vector<std::string> out;
    for (const auto& point : points)
        if (std::find(out.begin(), out.end(), point.coder) == out.end()) out.push_back(point.coder);
    return out;
}

std::string rate_table(std::span<const RdPoint> points) {
    std::string out = fmt::format("{:<10}{:>5}{:>9}{:>8}{:>8}{:>6}", "coder", "q", "step mm", "bpvf", "Mbit/s", "I %");
    out += layer_titles();
    const auto shown = measured_curves(points);
    for (const auto* measure : shown) out += fmt::format("{:>8}", measure->brief);
    out += fmt::format("{:>9}{:>9}  {}\n", "enc fps", "dec fps", "setting");
    for (const auto& point : points) {
        out +=
            fmt::format("{:<10}{:>5g}{:>9.2f}{:>8.3f}{:>8.2f}{:>6.0f}", point.coder, point.quality, point.geometry_step,
                        bits_per_vertex(point), megabits_per_second(point), 100 * intra_share(point));
        out += layer_cells(totals(point));
        for (const auto* measure : shown)
            out += fmt::format("{:>8}", number_or_dash(value_of(point, *measure), measure->digits));
        out += fmt::format("{:>9.1f}{:>9}", encode_fps(point), number_or_dash(decode_fps(point), 1));
        out += point.setting.empty() ? "\n" : "  " + point.setting + "\n";
    }
    return out;
}

std::string enhanced_frame_table(std::span<const RdPoint> points) {
    std::string rows;
    for (const auto& point : points) {
        const auto sums = totals(point, FrameType::enhanced);
        if (sums.frames == 0) continue;
        rows += fmt::format("{:<10}{:>5g}{:>9}{:>8.3f}", point.coder, point.quality, sums.frames,
                            app::bits_per_vertex(sums.bytes.total(), sums.source_vertices));
        rows += layer_cells(sums);
        const auto connectivity = sums.bytes.fans + sums.bytes.distance_orders + sums.bytes.mapping;
        rows += fmt::format("{:>14.3f}\n", app::bits_per_vertex(connectivity, sums.source_vertices));
    }
    if (rows.empty()) return {};
    return fmt::format("{:<10}{:>5}{:>9}{:>8}", "EP alone", "q", "frames", "bpvf") + layer_titles() +
           fmt::format("{:>14}\n", "conn.+mapping") + rows;
}

std::string rate_difference_table(std::span<const RdPoint> points, const std::string& reference) {
    const auto coders = coders_of(points);
    if (std::find(coders.begin(), coders.end(), reference) == coders.end() || coders.size() < 2) return {};
    const auto shown = measured_curves(points);
    std::string out = fmt::format("{:<24}", "rate against " + reference);
    for (const auto* measure : shown) out += fmt::format("{:>12}", measure->brief);
    out += '\n';
    for (const auto& coder : coders) {
        if (coder == reference) continue;
        out += fmt::format("  {:<22}", coder);
        for (const auto* measure : shown) {
            const auto difference = bjontegaard_rate_difference(rate_curve(points, reference, *measure),
                                                                rate_curve(points, coder, *measure));
            out += fmt::format("{:>12}", difference ? fmt::format("{:+.1f} %", 100 * *difference) : "n/a");
        }
        out += '\n';
    }
    return out;
}

nlohmann::json rate_differences_json(std::span<const RdPoint> points, const std::string& reference) {
    nlohmann::json out = nlohmann::json::object();
    for (const auto& coder : coders_of(points)) {
        if (coder == reference) continue;
        for (const auto* measure : measured_curves(points)) {
            const auto difference = bjontegaard_rate_difference(rate_curve(points, reference, *measure),
                                                                rate_curve(points, coder, *measure));
            out[coder][measure->key] = difference ? nlohmann::json(*difference) : nlohmann::json();
        }
    }
    return out;
}

std::string crossing_sentence(std::span<const RdPoint> points, const std::string& first, const std::string& second) {
    const Measure& m1 = measures()[0];
    const auto a = rate_curve(points, first, m1), b = rate_curve(points, second, m1);
    if (a.size() < 2 || b.size() < 2) return {};
    const auto crossings = curve_crossings(a, b);
    if (!crossings.empty()) {
        std::string out = fmt::format("M1: {} and {} cross at", first, second);
        for (std::size_t i = 0; i < crossings.size(); ++i)
            out += fmt::format("{} {:.2f} bpvf ({:.2f} mm; {} ahead below)", i == 0 ? "" : " and", crossings[i].rate,
                               std::exp(-crossings[i].quality), crossings[i].first_ahead_below ? first : second);
        return out + "\n";
    }
    const double low =
        std::max(bits_per_vertex(*extreme(points, first, true)), bits_per_vertex(*extreme(points, second, true)));
    const double high =
        std::min(bits_per_vertex(*extreme(points, first, false)), bits_per_vertex(*extreme(points, second, false)));
    if (!(low < high)) return fmt::format("M1: {} and {} share no range of rates\n", first, second);
    const double middle = std::sqrt(low * high);
    const auto qa = quality_at_rate(a, middle), qb = quality_at_rate(b, middle);
    const std::string ahead = qa && qb && *qa != *qb ? (*qa > *qb ? first : second) + " is ahead" : "they are level";
    return fmt::format("M1: {} and {} do not cross between {:.2f} and {:.2f} bpvf, the rates both reach: {}\n", first,
                       second, low, high, ahead);
}

std::string rd_csv(std::span<const RdPoint> points) {
    std::string out = "coder,quality,geometry_step_mm,colour_step,setting,frames,bits_per_vertex,megabits_per_second";
    for (const auto& column : layer_columns) out += fmt::format(",{}_bpv", column.key);
    for (const auto& measure : measures()) out += fmt::format(",{}", measure.key);
    out += ",encode_frames_per_second,decode_frames_per_second\n";
    for (const auto& point : points) {
        const auto sums = totals(point);
        out += fmt::format("{},{:g},{:.8g},{:.8g},{},{},{:.8g},{:.8g}", point.coder, point.quality, point.geometry_step,
                           point.colour_step, point.setting, point.frames.size(), bits_per_vertex(point),
                           megabits_per_second(point));
        for (const auto& column : layer_columns)
            out += fmt::format(",{:.8g}", app::bits_per_vertex(column.bytes(sums.bytes), sums.source_vertices));
        for (const auto& measure : measures()) {
            const auto value = value_of(point, measure);
            out += value ? fmt::format(",{:.8g}", *value) : std::string(",");
        }
        const auto decoding = decode_fps(point);
        out += fmt::format(",{:.6g},{}\n", encode_fps(point), decoding ? fmt::format("{:.6g}", *decoding) : "");
    }
    return out;
}

}  // namespace htvm::lab
