#include "rd_result.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace htvm::lab {

using namespace app;
namespace {

constexpr std::array<Measure, 9> all_measures = {{
    {"m1_mm", "M1, vertex to vertex, RMS", "M1", "mm", "m1", true, true, 3},
    {"m1_colour", "M1 colour, RMS", "M1 col", "levels", "m1", true, true, 2},
    {"m2_mm", "M2, point to surface, RMS", "M2", "mm", "m2", true, true, 3},
    {"hausdorff_mm", "largest distance", "Hausd.", "mm", "m2", true, false, 1},
    {"m2_worst_frame_mm", "M2 of the worst frame", "worst", "mm", "m2", true, false, 3},
    {"m3_foreground_db", "M3, pictures, PSNR of the foreground", "M3 fgr", "dB", "m3", false, true, 2},
    {"m3_full_db", "M3, pictures, PSNR of the full picture", "M3", "dB", "m3", false, false, 2},
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
    return {{"type", type_name(frame.type)},
            {"vertices", frame.vertices},
            {"bytes", layers_json(frame.bytes)},
            {"encode_ms", frame.encode_ms},
            {"decode_ms", optional_json(frame.decode_ms)},
            {"m1_mm", optional_json(frame.m1_mm)},
            {"m2_mm", optional_json(frame.m2_mm)}};
}

RdFrame frame_from_json(const nlohmann::json& json) {
    RdFrame frame;
    frame.type = type_named(json.at("type").get<std::string>()).value_or(FrameType::intra);
    frame.vertices = json.at("vertices").get<std::uint32_t>();
    frame.bytes = layers_from_json(json.at("bytes"));
    frame.encode_ms = json.at("encode_ms").get<double>();
    frame.decode_ms = optional_number(json, "decode_ms");
    frame.m1_mm = optional_number(json, "m1_mm");
    frame.m2_mm = optional_number(json, "m2_mm");
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
    take("m3_foreground_db", options.pictures, s.m3_foreground_db);
    take("m3_full_db", options.pictures, s.m3_full_db);
    take("d1_db", options.cloud, s.d1_db);
    take("d2_db", options.cloud, s.d2_db);
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

}  // namespace htvm::lab
