#include "results.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace htvm::lab {

using namespace app;

// ---- A point of the sweep -------------------------------------------------------------------------------------------

namespace {

constexpr std::array<Measure, 19> all_measures = {{
    {"m1_mm", "M1, vertex to vertex, RMS", "M1", "mm", "m1", true, true, 3},
    {"m1_colour", "M1 colour, RMS", "M1 col", "levels", "m1", true, true, 2},
    {"m2_mm", "M2, point to surface, RMS", "M2", "mm", "m2", true, true, 3},
    {"hausdorff_mm", "largest distance", "Hausd.", "mm", "m2", true, false, 1},
    {"m2_worst_frame_mm", "M2 of the worst frame", "worst", "mm", "m2", true, false, 3},
    {"covered_m2_mm", "M2 over what is covered, RMS", "M2 cov.", "mm", "coverage", true, true, 3},
    {"captured_covered", "share of the captured surface that is covered", "capt.", "of 1", "coverage", false, false, 4},
    {"shown_covered", "share of the shown surface that is covered", "shown", "of 1", "coverage", false, false, 4},
    {"covered_region_p99_mm", "worst region over what is covered, 99th percentile", "reg. c.", "mm", "coverage", true,
     false, 3},
    {"region_p99_mm", "worst region of frames between I-frames, 99th percentile", "region", "mm", "regions", true,
     false, 3},
    {"region_intra_p99_mm", "worst region of I-frames, 99th percentile", "reg. I", "mm", "regions", true, false, 3},
    {"patched_share", "share of the surface that patches replace", "patch", "of 1", "m2", true, false, 4},
    {"m3_foreground_db", "M3, pictures, PSNR of the foreground", "M3 fgr", "dB", "m3", false, true, 2},
    {"m3_full_db", "M3, pictures, PSNR of the full picture", "M3", "dB", "m3", false, false, 2},
    {"m3_ssim", "SSIM of M3's pictures", "SSIM", "of 1", "m3", false, true, 4},
    {"m3_unlit_db", "unlit M3, PSNR of the foreground", "unlit", "dB", "m3", false, true, 2},
    {"m3_unlit_ssim", "SSIM of unlit M3's pictures", "u.SSIM", "of 1", "m3", false, true, 4},
    {"d1_db", "D1, point to point, PSNR", "D1", "dB", "d1", false, true, 2},
    {"d2_db", "D2, point to plane, PSNR", "D2", "dB", "d1", false, true, 2},
}};

FrameInfo info_of(const RdFrame& frame) {
    FrameInfo info;
    info.type = frame.type;
    info.source_vertices = frame.vertices;
    info.bytes = frame.bytes;
    return info;
}

nlohmann::json optional_json(const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
}

std::optional<double> optional_number(const nlohmann::json& json, const char* key) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_number()) return std::nullopt;
    return found->get<double>();
}

nlohmann::json frame_to_json(const RdFrame& frame) {
    return {{"type", kind_of(frame.type).letter},
            {"vertices", frame.vertices},
            {"bytes", layers_json(frame.bytes)},
            {"encode_ms", frame.encode_ms},
            {"decode_ms", optional_json(frame.decode_ms)},
            {"m1_mm", optional_json(frame.m1_mm)},
            {"m2_mm", optional_json(frame.m2_mm)},
            {"worst_region_mm", optional_json(frame.worst_region_mm)},
            {"covered_worst_region_mm", optional_json(frame.covered_region_mm)},
            {"recoded_share", frame.recoded}};
}

RdFrame frame_from_json(const nlohmann::json& json) {
    RdFrame frame;
    const auto* kind = kind_of_letter(json.at("type").get<std::string>());
    frame.type = kind ? kind->type : FrameType::intra;
    frame.vertices = json.at("vertices").get<std::uint32_t>();
    frame.bytes = layers_from_json(json.at("bytes"));
    frame.encode_ms = json.at("encode_ms").get<double>();
    frame.decode_ms = optional_number(json, "decode_ms");
    frame.m1_mm = optional_number(json, "m1_mm");
    frame.m2_mm = optional_number(json, "m2_mm");
    frame.worst_region_mm = optional_number(json, "worst_region_mm");
    frame.covered_region_mm = optional_number(json, "covered_worst_region_mm");
    frame.recoded = json.at("recoded_share").get<double>();
    return frame;
}

}  // namespace

std::span<const Measure> measures() { return all_measures; }

LayerTotals totals(const RdPoint& point) {
    LayerTotals out;
    for (const auto& frame : point.frames) add(out, info_of(frame));
    return out;
}

LayerTotals totals(const RdPoint& point, FrameType type) {
    LayerTotals out;
    for (const auto& frame : point.frames)
        if (frame.type == type) add(out, info_of(frame));
    return out;
}

double bits_per_vertex(const RdPoint& point) {
    const auto sums = totals(point);
    return app::bits_per_vertex(sums.bytes.total(), sums.source_vertices);
}

double megabits_per_second(const RdPoint& point) {
    if (point.frames.empty()) return 0;
    return 8e-6 * static_cast<double>(totals(point).bytes.total()) * point.fps /
           static_cast<double>(point.frames.size());
}

double encode_fps(const RdPoint& point) {
    double milliseconds = 0;
    for (const auto& frame : point.frames) milliseconds += frame.encode_ms;
    return milliseconds > 0 ? 1000 * static_cast<double>(point.frames.size()) / milliseconds : 0;
}

std::optional<double> decode_fps(const RdPoint& point) {
    double milliseconds = 0;
    for (const auto& frame : point.frames) {
        if (!frame.decode_ms) return std::nullopt;
        milliseconds += *frame.decode_ms;
    }
    if (milliseconds <= 0) return std::nullopt;
    return 1000 * static_cast<double>(point.frames.size()) / milliseconds;
}

std::vector<RatePoint> rate_curve(std::span<const RdPoint> points, const std::string& coder, const Measure& measure) {
    std::vector<RatePoint> curve;
    for (const auto& point : points) {
        const auto value = point.values.find(measure.key);
        if (point.coder != coder || value == point.values.end()) continue;
        curve.push_back({bits_per_vertex(point), measure.is_error ? quality_of_error(value->second) : value->second});
    }
    return curve;
}

void take_measures(const ComparisonSummary& s, const CompareOptions& options, std::map<std::string, double>& values) {
    auto take = [&](const char* key, bool measured, double value) {
        if (measured && std::isfinite(value)) values[key] = value;
    };
    take("m1_mm", options.points, s.m1_mm);
    take("m1_colour", options.points && s.has_colour, s.m1_colour);
    take("m2_mm", options.surface, s.m2_mm);
    take("hausdorff_mm", options.surface, s.hausdorff_mm);
    take("m2_worst_frame_mm", options.surface, s.m2_worst_frame_mm);
    take("covered_m2_mm", options.coverage && s.has_covered, s.covered_m2_mm);
    take("captured_covered", options.coverage, s.captured_covered);
    take("shown_covered", options.coverage, s.shown_covered);
    take("m3_foreground_db", options.pictures, s.m3_foreground_db);
    take("m3_full_db", options.pictures, s.m3_full_db);
    take("m3_ssim", options.pictures, s.m3_ssim);
    take("m3_unlit_db", options.pictures && s.has_unlit, s.m3_unlit_foreground_db);
    take("m3_unlit_ssim", options.pictures && s.has_unlit, s.m3_unlit_ssim);
    take("d1_db", options.cloud, s.d1_db);
    take("d2_db", options.cloud, s.d2_db);
}

void take_frame_measures(RdPoint& point) {
    std::vector<double> intra, between, covered;
    double patched = 0;
    std::size_t tracked = 0;
    for (const auto& frame : point.frames) {
        const bool is_intra = frame.type == FrameType::intra;
        if (frame.worst_region_mm && std::isfinite(*frame.worst_region_mm))
            (is_intra ? intra : between).push_back(*frame.worst_region_mm);
        if (frame.covered_region_mm) covered.push_back(*frame.covered_region_mm);
        if (frame.type != FrameType::tracked && frame.type != FrameType::patched) continue;
        ++tracked;
        patched += frame.recoded;
    }
    if (!intra.empty()) point.values["region_intra_p99_mm"] = summarise(std::move(intra)).p99_mm;
    if (!between.empty()) point.values["region_p99_mm"] = summarise(std::move(between)).p99_mm;
    if (!covered.empty()) point.values["covered_region_p99_mm"] = summarise(std::move(covered)).p99_mm;
    if (tracked > 0) point.values["patched_share"] = patched / static_cast<double>(tracked);
}

nlohmann::json to_json(const RdPoint& point) {
    const auto sums = totals(point);
    nlohmann::json frames = nlohmann::json::array();
    for (const auto& frame : point.frames) frames.push_back(frame_to_json(frame));
    return {{"coder", point.coder},
            {"quality", point.quality},
            {"geometry_step_mm", point.geometry_step},
            {"colour_step", point.colour_step},
            {"setting", point.setting},
            {"frames_per_second", point.fps},
            {"bits_per_vertex", bits_per_vertex(point)},
            {"megabits_per_second", megabits_per_second(point)},
            {"encode_frames_per_second", encode_fps(point)},
            {"decode_frames_per_second", optional_json(decode_fps(point))},
            {"bytes", layers_json(sums.bytes)},
            {"vertices", sums.source_vertices},
            {"measures", point.values},
            {"frames", std::move(frames)}};
}

std::optional<RdPoint> rd_point_from_json(const nlohmann::json& json) {
    try {
        RdPoint point;
        point.coder = json.at("coder").get<std::string>();
        point.quality = json.at("quality").get<double>();
        point.geometry_step = json.at("geometry_step_mm").get<double>();
        point.colour_step = json.at("colour_step").get<double>();
        point.setting = json.at("setting").get<std::string>();
        point.fps = json.at("frames_per_second").get<double>();
        point.values = json.at("measures").get<std::map<std::string, double>>();
        for (const auto& frame : json.at("frames")) point.frames.push_back(frame_from_json(frame));
        return point;
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

// ---- The output of the sweep: tables for people, CSV for programs ---------------------------------------------------

namespace {

// Bytes grouped as in the tables; whatever is in no column is "other".
struct LayerColumn {
    const char* title;
    const char* key;
    std::size_t (*bytes)(const LayerBytes&);
};
constexpr std::array<LayerColumn, 9> layer_columns = {{
    {"motion", "motion", [](const LayerBytes& b) { return b[Layer::pose] + b[Layer::transforms]; }},
    {"geometry", "geometry", [](const LayerBytes& b) { return b[Layer::geometry]; }},
    {"colour", "colour", [](const LayerBytes& b) { return b[Layer::colour]; }},
    {"mapping", "mapping", [](const LayerBytes& b) { return b[Layer::mapping]; }},
    {"fans", "fans", [](const LayerBytes& b) { return b[Layer::fans]; }},
    {"dist.ord.", "distance_order", [](const LayerBytes& b) { return b[Layer::distance_orders]; }},
    {"one piece", "one_piece", [](const LayerBytes& b) { return b[Layer::external_intra]; }},
    {"overhead", "overhead", [](const LayerBytes& b) { return b.overhead; }},
    {"other", "other",
     [](const LayerBytes& b) { return b[Layer::normals] + b[Layer::texcoords] + b[Layer::coded_bones]; }},
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

// The share of the bits that I-frames take.
double intra_share(const RdPoint& point) {
    const auto all = totals(point).bytes.total();
    return all == 0 ? 0 : static_cast<double>(totals(point, FrameType::intra).bytes.total()) / static_cast<double>(all);
}

std::string value_or_dash(const RdPoint& point, const char* key, double scale, int digits) {
    const auto found = point.values.find(key);
    return found == point.values.end() ? "-" : fmt::format("{:.{}f}", scale * found->second, digits);
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
        const auto connectivity =
            sums.bytes[Layer::fans] + sums.bytes[Layer::distance_orders] + sums.bytes[Layer::mapping];
        rows += fmt::format("{:>14.3f}\n", app::bits_per_vertex(connectivity, sums.source_vertices));
    }
    if (rows.empty()) return {};
    return fmt::format("{:<10}{:>5}{:>9}{:>8}", "EP alone", "q", "frames", "bpvf") + layer_titles() +
           fmt::format("{:>14}\n", "conn.+mapping") + rows;
}

std::string region_table(std::span<const RdPoint> points) {
    std::string rows;
    for (const auto& point : points) {
        const auto value = [&](const char* key, double scale, int digits) {
            return value_or_dash(point, key, scale, digits);
        };
        if (!point.values.contains("region_p99_mm") && !point.values.contains("region_intra_p99_mm") &&
            totals(point, FrameType::patched).frames == 0)
            continue;
        rows += fmt::format("{:<10}{:>5g}{:>9}{:>9}{:>9}{:>12}{:>12}{:>14}\n", point.coder, point.quality,
                            totals(point, FrameType::intra).frames, totals(point, FrameType::tracked).frames,
                            totals(point, FrameType::patched).frames, value("region_intra_p99_mm", 1, 3),
                            value("region_p99_mm", 1, 3), value("patched_share", 100, 3));
    }
    if (rows.empty()) return {};
    return fmt::format("{:<10}{:>5}{:>9}{:>9}{:>9}{:>12}{:>12}{:>14}\n", "regions", "q", "I", "T", "TP", "of I, mm",
                       "others, mm", "patched, %") +
           rows;
}

std::string coverage_table(std::span<const RdPoint> points) {
    std::string rows;
    for (const auto& point : points) {
        if (!point.values.contains("captured_covered")) continue;
        rows += fmt::format("{:<10}{:>5g}{:>9.3f}{:>13}{:>10}{:>14}{:>14}\n", point.coder, point.quality,
                            bits_per_vertex(point), value_or_dash(point, "captured_covered", 100, 2),
                            value_or_dash(point, "shown_covered", 100, 2), value_or_dash(point, "covered_m2_mm", 1, 3),
                            value_or_dash(point, "covered_region_p99_mm", 1, 3));
    }
    if (rows.empty()) return {};
    return fmt::format("{:<10}{:>5}{:>9}{:>13}{:>10}{:>14}{:>14}\n", "coverage", "q", "bpvf", "captured, %", "shown, %",
                       "M2 there, mm", "region p99") +
           rows;
}

const Measure& equal_m2_measure(std::span<const RdPoint> points) {
    const auto all = measures();
    const auto called = [&](const std::string& key) -> const Measure& {
        return *std::ranges::find_if(all, [&](const Measure& measure) { return key == measure.key; });
    };
    const Measure& covered = called("covered_m2_mm");
    return measured(points, covered) ? covered : called("m2_mm");
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
