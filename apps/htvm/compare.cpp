// htvm compare: the metrics of a decoded sequence against its original.
#include "metrics/compare.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "command_line/capture.h"
#include "command_line/choice.h"
#include "command_line/headings.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "core/thread.h"
#include "io/mesh_file.h"
#include "io/output_file.h"
#include "io/sequence.h"
#include "metrics/drift.h"
#include "metrics/flicker.h"
#include "picture_options.h"
#include "sequences.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

// ---- The output of a comparison: a table for people, JSON and CSV for programs --------------------------------------

const char* shading_name(Shading shading) {
    return shading == Shading::flat ? "flat" : shading == Shading::smooth ? "smooth" : "unlit";
}

std::string row(const std::string& what, double forward, double backward, double larger, int digits) {
    return fmt::format("  {:<34} {:>11.{}f} {:>11.{}f} {:>11.{}f}\n", what, forward, digits, backward, digits, larger,
                       digits);
}

std::string single(const std::string& what, double value, int digits) {
    return fmt::format("  {:<34}{:>36.{}f}\n", what, value, digits);
}

// Means per frame of both sequences.
std::string topology_rows(const SequenceComparison& sums) {
    const double frames = static_cast<double>(sums.frames);
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}\n", "topology, mean per frame", "original", "decoded");
    auto add = [&](const char* what, auto member) {
        out += fmt::format("  {:<34}{:>12.1f}{:>12.1f}\n", what,
                           static_cast<double>(sums.original_topology.*member) / frames,
                           static_cast<double>(sums.decoded_topology.*member) / frames);
    };
    add("components", &Topology::components);
    add("boundary edges", &Topology::boundary_edges);
    add("  with coincident vertices merged", &Topology::open_edges);
    add("non-manifold edges", &Topology::non_manifold_edges);
    add("degenerate triangles", &Topology::degenerate_triangles);
    add("duplicate triangles", &Topology::duplicate_triangles);
    add("isolated vertices", &Topology::isolated_vertices);
    add("Euler characteristic", &Topology::euler);
    add("cracks", &Topology::cracks);
    add("  their length, mm", &Topology::crack_length);
    add("flaps", &Topology::flaps);
    add("  their area, mm^2", &Topology::flap_area);
    return out;
}

std::string picture_rows(const SequenceComparison& sums, const ComparisonSummary& s, const CompareOptions& options) {
    std::string out =
        fmt::format("\n  M3, {} of {} x {}, {} shading, {:.1f} % of the pixels foreground\n",
                    counted(static_cast<std::size_t>(options.views.views), "view"), options.views.width,
                    options.views.height, shading_name(options.render.shading), 100 * s.foreground_share) +
        single("PSNR of the foreground, dB", s.m3_foreground_db, 2) +
        single("PSNR of the full picture, dB", s.m3_full_db, 2) + single("SSIM of the foreground", s.m3_ssim, 4) +
        single("pixels of one mesh only, % of fgr.",
               sums.pictures.foreground_pixels > 0 ? 100.0 * static_cast<double>(sums.pictures.outline_pixels) /
                                                         static_cast<double>(sums.pictures.foreground_pixels)
                                                   : 0,
               3);
    if (s.has_unlit && options.render.shading != Shading::unlit)
        out += "  unlit M3, the same pictures without shading\n" +
               single("PSNR of the foreground, dB", s.m3_unlit_foreground_db, 2) +
               single("PSNR of the full picture, dB", s.m3_unlit_full_db, 2) +
               single("SSIM of the foreground", s.m3_unlit_ssim, 4);
    return out;
}

// A column of the per-frame table; empty where there is no value.
struct Column {
    const char* name;
    std::optional<double> value;
};

std::vector<Column> columns(const FrameComparison& frame, const CompareOptions& options, double peak_mm) {
    const ComparisonSummary s = summarise(as_sequence(frame), peak_mm);
    std::vector<Column> out{{"original_vertices", static_cast<double>(frame.original_vertices)},
                            {"decoded_vertices", static_cast<double>(frame.decoded_vertices)},
                            {"original_triangles", static_cast<double>(frame.original_triangles)},
                            {"decoded_triangles", static_cast<double>(frame.decoded_triangles)}};
    auto add = [&](std::initializer_list<Column> more) { out.insert(out.end(), more); };
    if (options.points)
        add({{"m1_mm", s.m1_mm},
             {"m1_forward_mm", s.m1_forward_mm},
             {"m1_backward_mm", s.m1_backward_mm},
             {"m1_colour", s.m1_colour}});
    if (options.surface)
        add({{"m2_mm", s.m2_mm},
             {"m2_forward_mm", s.m2_forward.rms},
             {"m2_backward_mm", s.m2_backward.rms},
             {"hausdorff_mm", s.hausdorff_mm}});
    if (options.regions) add({{"worst_region_mm", frame.region.worst_mm}});
    if (options.texcoords) add({{"texcoord_rms", s.texcoord_rms}, {"texcoord_elsewhere", s.texcoord_elsewhere}});
    if (options.cloud) add({{"d1_db", s.d1_db}, {"d2_db", s.d2_db}});
    if (options.pictures) {
        const auto unlit = [&](double value) { return s.has_unlit ? std::optional(value) : std::nullopt; };
        add({{"m3_foreground_db", s.m3_foreground_db},
             {"m3_full_db", s.m3_full_db},
             {"m3_ssim", s.m3_ssim},
             {"m3_unlit_foreground_db", unlit(s.m3_unlit_foreground_db)},
             {"m3_unlit_full_db", unlit(s.m3_unlit_full_db)},
             {"m3_unlit_ssim", unlit(s.m3_unlit_ssim)}});
    }
    if (options.topology)
        add({{"original_components", static_cast<double>(frame.original_topology.components)},
             {"decoded_components", static_cast<double>(frame.decoded_topology.components)},
             {"original_boundary_edges", static_cast<double>(frame.original_topology.boundary_edges)},
             {"decoded_boundary_edges", static_cast<double>(frame.decoded_topology.boundary_edges)},
             {"original_cracks", static_cast<double>(frame.original_topology.cracks)},
             {"decoded_cracks", static_cast<double>(frame.decoded_topology.cracks)},
             {"original_flaps", static_cast<double>(frame.original_topology.flaps)},
             {"decoded_flaps", static_cast<double>(frame.decoded_topology.flaps)}});
    return out;
}

nlohmann::json distances_json(const SurfaceDistances& d) {
    return {{"rms_mm", d.rms}, {"mean_mm", d.mean}, {"largest_mm", d.largest}, {"samples", d.samples}};
}

// A table of everything that `options` asked for.
std::string comparison_table(const SequenceComparison& sums, const CompareOptions& options, double peak_mm) {
    const ComparisonSummary s = summarise(sums, peak_mm);
    const double frames = static_cast<double>(sums.frames);
    std::string out = fmt::format(
        "{}; per frame {:.1f} vertices, {:.1f} triangles; decoded {:.1f} and {:.1f}\n", counted(sums.frames, "frame"),
        static_cast<double>(sums.original_vertices) / frames, static_cast<double>(sums.original_triangles) / frames,
        static_cast<double>(sums.decoded_vertices) / frames, static_cast<double>(sums.decoded_triangles) / frames);
    if (options.points || options.surface)
        out += fmt::format("\n  {:<34}{:>12}{:>12}{:>12}\n", "", "forward", "backward", "larger");
    if (options.points) {
        out += row("M1 geometry, RMS mm", s.m1_forward_mm, s.m1_backward_mm, s.m1_mm, 4);
        if (s.has_colour)
            out += row("M1 colour, RMS levels", s.m1_colour_forward, s.m1_colour_backward, s.m1_colour, 3);
    }
    if (options.surface) {
        const auto &f = s.m2_forward, &b = s.m2_backward;
        out += row("M2 surface, RMS mm", f.rms, b.rms, s.m2_mm, 4);
        out += row("  mean, mm", f.mean, b.mean, std::max(f.mean, b.mean), 4);
        out += row("  largest (Hausdorff), mm", f.largest, b.largest, s.hausdorff_mm, 3);
        out += single("  worst frame, RMS mm", s.m2_worst_frame_mm, 4);
    }
    if (options.texcoords && s.has_texcoords) {
        out += single("texture coordinates, RMS", s.texcoord_rms, 5);
        out += single("  elsewhere in the atlas, %", 100 * s.texcoord_elsewhere, 3);
    } else if (options.texcoords && !options.points) {
        out += "\nno texture coordinates to compare: not all meshes of both have them\n";
    }
    if (options.cloud) {
        out += fmt::format("\n  D1, D2 with peak {:.3f} mm ({})\n", s.peak_mm,
                           peak_mm > 0 ? "given" : "diagonal of the original's bounding box");
        out += single("D1 PSNR (point to point), dB", s.d1_db, 2) + single("D2 PSNR (point to plane), dB", s.d2_db, 2);
    }
    if (options.pictures) out += picture_rows(sums, s, options);
    if (options.topology) out += topology_rows(sums);
    return out;
}

nlohmann::json topology_json(const Topology& t) {
    return {{"vertices", t.vertices},
            {"triangles", t.triangles},
            {"isolated_vertices", t.isolated_vertices},
            {"degenerate_triangles", t.degenerate_triangles},
            {"duplicate_triangles", t.duplicate_triangles},
            {"edges", t.edges},
            {"boundary_edges", t.boundary_edges},
            {"non_manifold_edges", t.non_manifold_edges},
            {"components", t.components},
            {"euler", t.euler},
            {"open_edges", t.open_edges},
            {"crack_edges", t.crack_edges},
            {"cracks", t.cracks},
            {"crack_length_mm", t.crack_length},
            {"flap_triangles", t.flap_triangles},
            {"flaps", t.flaps},
            {"flap_area_mm2", t.flap_area}};
}

// Only what `options` asked for. An infinite PSNR, without any difference, becomes null.
nlohmann::json summary_json(const ComparisonSummary& s, const CompareOptions& options) {
    nlohmann::json out;
    if (options.points) {
        out["m1"] = {{"rms_mm", s.m1_mm},
                     {"forward_mm", s.m1_forward_mm},
                     {"backward_mm", s.m1_backward_mm},
                     {"largest_mm", s.m1_largest_mm}};
        if (s.has_colour)
            out["m1_colour"] = {{"rms_levels", s.m1_colour},
                                {"forward_levels", s.m1_colour_forward},
                                {"backward_levels", s.m1_colour_backward}};
    }
    if (options.surface)
        out["m2"] = {{"rms_mm", s.m2_mm},
                     {"hausdorff_mm", s.hausdorff_mm},
                     {"worst_frame_mm", s.m2_worst_frame_mm},
                     {"forward", distances_json(s.m2_forward)},
                     {"backward", distances_json(s.m2_backward)}};
    if (options.texcoords && s.has_texcoords)
        out["texcoords"] = {{"rms", s.texcoord_rms}, {"elsewhere_share", s.texcoord_elsewhere}};
    if (options.cloud) out["cloud"] = {{"peak_mm", s.peak_mm}, {"d1_db", s.d1_db}, {"d2_db", s.d2_db}};
    if (options.pictures)
        out["m3"] = {{"foreground_db", s.m3_foreground_db},
                     {"full_db", s.m3_full_db},
                     {"ssim", s.m3_ssim},
                     {"foreground_share", s.foreground_share},
                     {"views", options.views.views},
                     {"width", options.views.width},
                     {"height", options.views.height},
                     {"shading", shading_name(options.render.shading)}};
    if (options.pictures && s.has_unlit)
        out["m3_unlit"] = {
            {"foreground_db", s.m3_unlit_foreground_db}, {"full_db", s.m3_unlit_full_db}, {"ssim", s.m3_unlit_ssim}};
    return out;
}

// One line per frame, without its end, with the columns that `options` asked for; infinity is written as inf.
std::string csv_header(const CompareOptions& options) {
    std::string out = "frame";
    for (const auto& column : columns({}, options, 1)) out += fmt::format(",{}", column.name);
    return out;
}

std::string csv_line(std::size_t frame, const FrameComparison& comparison, const CompareOptions& options,
                     double peak_mm) {
    std::string out = std::to_string(frame);
    for (const auto& column : columns(comparison, options, peak_mm))
        out += column.value ? fmt::format(",{:.8g}", *column.value) : ",";
    return out;
}

// ---- Flicker --------------------------------------------------------------------------------------------------------

// A frame's change of the pictures since the frame before, which a frame of files or behind a gap may not have; and its
// kind, if it is known.
struct FlickerFrame {
    std::optional<FrameFlicker> change;
    std::optional<FrameType> kind;
};

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

bool has_flicker(const std::vector<FlickerFrame>& frames) {
    return std::ranges::any_of(frames,
                               [](const FlickerFrame& frame) { return frame.change && frame.change->lit.pixels > 0; });
}

// The kinds that there are, in the order of their table.
std::vector<FrameType> kinds_in(const std::vector<FlickerFrame>& frames) {
    std::vector<FrameType> out;
    for (const auto& kind : frame_kinds)
        if (std::ranges::any_of(frames, [&](const FlickerFrame& f) { return f.change && f.kind == kind.type; }))
            out.push_back(kind.type);
    return out;
}

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

// ---- The worst regions ----------------------------------------------------------------------------------------------

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

RegionErrorSummary worst_regions(const std::vector<FrameComparison>& frames,
                                 const std::vector<std::optional<FrameType>>& kinds, const RegionGroup& group) {
    std::vector<double> worst;
    for (std::size_t i = 0; i < frames.size(); ++i)
        if (group.has(kinds[i])) worst.push_back(frames[i].region.worst_mm);
    return summarise(std::move(worst));
}

std::string region_rows(const std::vector<FrameComparison>& frames,
                        const std::vector<std::optional<FrameType>>& kinds) {
    std::string out =
        fmt::format("\n  {:<34}{:>12}{:>12}{:>12}\n", "worst region of 10 cm, RMS mm", "median", "99 %", "largest");
    for (const auto& group : region_groups) {
        const auto sums = worst_regions(frames, kinds, group);
        if (sums.frames == 0) continue;
        out +=
            row(fmt::format("  of {} ({})", group.name, sums.frames), sums.median_mm, sums.p99_mm, sums.largest_mm, 3);
    }
    return out;
}

nlohmann::json regions_json(const std::vector<FrameComparison>& frames,
                            const std::vector<std::optional<FrameType>>& kinds) {
    nlohmann::json out;
    for (const auto& group : region_groups) {
        const auto sums = worst_regions(frames, kinds, group);
        if (sums.frames == 0) continue;
        out[group.key] = {{"frames", sums.frames},
                          {"median_mm", sums.median_mm},
                          {"p99_mm", sums.p99_mm},
                          {"largest_mm", sums.largest_mm}};
    }
    return out;
}

// ---- The command ----------------------------------------------------------------------------------------------------

struct Options {
    std::string first;                   // name on the command line
    std::vector<std::string> others;     // names behind it
    std::vector<std::string> originals;  // of these
    std::string decoded;                 // and the last
    std::optional<LengthUnit> unit;      // of files; not given: guessed from the first one
    std::string timestamps;
    std::vector<std::string> ignored;  // globs: files that are no frames
    std::string truth;                 // folder; empty: no drift
    std::size_t frames = 0;            // 0: all
    std::vector<std::string> only;
    CompareOptions compare;
    unsigned threads = 0;
    DecoderOptions limits;   // for streams
    TextureOptions texture;  // of the originals
    ShadingOptions shading;
    bool flicker = true, follow_sequence = false, json = false;
    double peak_mm = 0;
    std::string csv, pictures;
    int picture_views = 1;
};

void choose_metrics(Options& options) {
    CompareOptions& c = options.compare;
    if (c.views.views == 0) {
        c.pictures = options.flicker = false;
        c.views.views = 1;
    }
    c.render.colours = !options.shading.grey;
    c.render.shading = options.shading.shading.value_or(Shading::smooth);
    if (options.only.empty()) return;
    const std::set<std::string> only(options.only.begin(), options.only.end());
    c.points = only.contains("m1");
    c.surface = only.contains("m2");
    c.regions = only.contains("regions");
    c.texcoords = only.contains("texcoords");
    c.cloud = only.contains("d1") || only.contains("d2");
    c.pictures = c.pictures && only.contains("m3");
    c.topology = only.contains("topology");
    options.flicker = options.flicker && only.contains("flicker");
}

// As M3's pictures, but of half their size.
FlickerOptions flicker_options(const CompareOptions& c) {
    FlickerOptions out{c.views, c.render, c.view_box, c.threads};
    out.views.width = (c.views.width + 1) / 2;
    out.views.height = (c.views.height + 1) / 2;
    return out;
}

struct Sources {
    MeshSource original, decoded;
};

// Whether the originals, as large as the guess of their unit makes them, are nearer to the size of the decoded stream
// than in the unit that the stream's capture was in: then they are not the files that it was encoded from. By the first
// frames of both, read from `original` and `decoded` of their own. Nothing is known of what cannot be read.
bool guess_fits_better(MeshSource original, MeshSource decoded) {
    if (original.frames == 0 || decoded.frames == 0) return false;
    const auto first = original.mesh_at(original, 0);
    if (!first || original.millimetres_per_unit == decoded.millimetres_per_unit) return false;
    const auto second = decoded.mesh_at(decoded, 0);
    if (!second) return false;
    const double guessed = diagonal(bounding_box(first->mesh)), right = diagonal(bounding_box(second->mesh));
    const double by_stream = guessed / original.millimetres_per_unit * decoded.millimetres_per_unit;
    if (!(guessed > 0) || !(right > 0)) return false;
    return std::abs(std::log(guessed / right)) < std::abs(std::log(by_stream / right));
}

Result<Sources> open_sources(const Options& options) {
    auto original = open_meshes(options.originals,
                                {options.unit, options.timestamps, options.limits, options.texture, options.ignored});
    if (!original) return tl::unexpected(original.error());
    auto decoded = open_meshes({options.decoded}, {options.unit, "", options.limits, {}});
    if (!decoded) return tl::unexpected(decoded.error());
    // Both sides in the same coordinates.
    if (!decoded->is_stream && !original->is_stream)
        if (const auto first = original->mesh_at(*original, 0); !first) return tl::unexpected(first.error());
    if (!decoded->is_stream || !original->is_stream) {
        auto &from = decoded->is_stream ? *decoded : *original, &to = decoded->is_stream ? *original : *decoded;
        to.global_shift = from.global_shift;
        to.finds_shift = false;
    }
    // A stream knows what its capture's files are in, however --scale or --height made millimetres of them; but it may
    // have been encoded from others.
    if (decoded->is_stream && original->guesses_unit) {
        auto stream = open_meshes({options.decoded}, {options.unit, "", options.limits, {}});
        if (!stream) return tl::unexpected(stream.error());
        if (guess_fits_better(*original, std::move(*stream))) return Sources{std::move(*original), std::move(*decoded)};
        original->guesses_unit = false;
        original->millimetres_per_unit = decoded->millimetres_per_unit;
    }
    return Sources{std::move(*original), std::move(*decoded)};
}

// When the frames of a side were captured: as known; else, beside a stream, by their numbers at its frame rate.
std::vector<std::int64_t> times_of(const MeshSource& source, const MeshSource& other) {
    if (!source.times_us.empty() || source.is_stream || !other.is_stream) return source.times_us;
    std::vector<std::int64_t> out;
    for (const auto place : places_in_time({std::vector<std::filesystem::path>(source.frames), source.numbers}))
        out.push_back(std::llround(static_cast<double>(place) / other.rate.per_second() * 1e6));
    return out;
}

// The positions of the frames to compare: of files by time or the numbers in their names, of a stream by time; in order
// where that pairs none, or fewer than there are though both sides have as many.
std::vector<FramePair> pairs_of(const Sources& sources) {
    const auto& [original, decoded] = sources;
    const bool of_files = !original.is_stream && !decoded.is_stream;
    auto pairs = of_files ? pair_files(original, decoded)
                          : pair_by_time(times_of(original, decoded), times_of(decoded, original));
    const bool alike = !of_files && original.frames == decoded.frames && pairs.size() < original.frames;
    if (!pairs.empty() && !alike) return pairs;
    pairs.clear();
    for (std::size_t k = 0; k < std::min(original.frames, decoded.frames); ++k) pairs.push_back({k, k});
    return pairs;
}

void warn_of_frames_left_out(const Sources& sources, const std::vector<FramePair>& pairs) {
    std::vector<std::size_t> of_original, of_decoded;
    for (const auto& pair : pairs) {
        of_original.push_back(pair.original);
        of_decoded.push_back(pair.decoded);
    }
    const auto tell = [](const MeshSource& source, const MeshSource& other, const std::vector<std::size_t>& paired) {
        auto numbers = source.numbers;
        if (numbers.empty()) {
            numbers.resize(source.frames);
            std::iota(numbers.begin(), numbers.end(), std::uint64_t{0});
        }
        const auto frames = frames_left_out(numbers, paired);
        if (!frames.empty()) warn(fmt::format("{} of {} left out: {} has no such", frames, source.name, other.name));
    };
    tell(sources.original, sources.decoded, of_original);
    tell(sources.decoded, sources.original, of_decoded);
    if (may_be_out_of_step(sources.original, sources.decoded))
        warn(
            fmt::format("{} has fewer frames than {}, and they are paired by number: where frames were left out while "
                        "encoding, those behind are compared with others; compare the stream itself, or PLY files, "
                        "which tell their times",
                        sources.decoded.name, sources.original.name));
}

// The box around all originals, for cameras that stand still.
Result<Box> sequence_box(const Options& options, const std::vector<FramePair>& pairs) {
    auto sources = open_sources(options);
    if (!sources) return tl::unexpected(sources.error());
    Box box;
    Progress progress("bounding box", pairs.size());
    for (const auto& pair : pairs) {
        const auto mesh = sources->original.mesh_at(sources->original, pair.original);
        if (!mesh) return tl::unexpected(mesh.error());
        if (const auto ok = check_measurable(mesh->mesh, "original"); !ok) return tl::unexpected(ok.error());
        extend(box, bounding_box(mesh->mesh));
        progress.step();
    }
    return box;
}

Result<void> write_pictures(const Options& options, const TexturedMesh& original, const TexturedMesh& decoded,
                            std::size_t frame) {
    const CompareOptions& c = options.compare;
    const auto cameras = cameras_round(c.view_box.value_or(bounding_box(original.mesh)), c.views);
    if (!cameras) return tl::unexpected(cameras.error());
    RenderOptions render_options = c.render;
    render_options.colours =
        render_options.colours && ShownMesh(original).has_colours() && ShownMesh(decoded).has_colours();
    const DrawableMesh first = make_drawable(original, render_options), second = make_drawable(decoded, render_options);
    const int count = std::min(options.picture_views, static_cast<int>(cameras->size()));
    Canvas left, right;
    for (int i = 0; i < count; ++i) {
        const std::size_t view = cameras->size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
        draw(first, (*cameras)[view], left, c.threads);
        draw(second, (*cameras)[view], right, c.threads);
        const auto path = std::filesystem::path(options.pictures) / fmt::format("frame_{:05}_view_{}.png", frame, view);
        const Picture together =
            side_by_side({left.picture, right.picture, difference_picture(left.picture, right.picture)});
        if (auto ok = write_png(together, path.string()); !ok) return ok;
    }
    return {};
}

void warn_of_sizes(const Sources& sources, const Mesh& original, const Mesh& decoded) {
    constexpr double most = 5;
    const double first = diagonal(bounding_box(original)), second = diagonal(bounding_box(decoded));
    if (!(first > 0) || !(second > 0) || std::max(first, second) < most * std::min(first, second)) return;
    const bool larger = first > second;
    warn(fmt::format(
        "{} is about {:.0f} times as large as {}: if they are the same subject, give the unit of the files (--unit)",
        larger ? sources.original.name : sources.decoded.name, larger ? first / second : second / first,
        larger ? sources.decoded.name : sources.original.name));
}

// The marks of a true surface (htvm synth --truth), as they go with the originals: by number, else in order.
struct Marks {
    MeshSource source;
    std::vector<std::size_t> place_of;  // of each original; the number of frames: none
};

Result<Marks> open_marks(const Options& options, const MeshSource& original) {
    auto source = open_meshes({(std::filesystem::path(options.truth) / "marks").string()},
                              {LengthUnit::millimetre, "", options.limits, {}});
    if (!source) return tl::unexpected(source.error());
    Marks marks{std::move(*source), std::vector<std::size_t>(original.frames)};
    const auto& numbers = marks.source.numbers;
    const bool by_number = !original.numbers.empty() && !numbers.empty();
    for (std::size_t k = 0; k < original.frames; ++k)
        marks.place_of[k] =
            by_number ? static_cast<std::size_t>(std::ranges::find(numbers, original.numbers[k]) - numbers.begin())
                      : std::min(k, marks.source.frames);
    return marks;
}

struct Measured {
    SequenceComparison sums;
    DriftMeter drift;                // if the truth is given
    std::vector<FrameDrift> drifts;  // of each frame, likewise
    std::vector<FrameComparison> frames;
    std::vector<FlickerFrame> flickers;           // of each frame, if it is asked for
    std::vector<std::size_t> places;              // the position of each among the originals
    std::vector<std::optional<FrameType>> kinds;  // of each, if it is known
};

// original: its position, with that number.
Result<FrameDrift> measure_drift(Marks& marks, DriftMeter& meter, std::size_t original, std::uint64_t number,
                                 const Mesh& decoded) {
    if (marks.place_of[original] == marks.source.frames)
        return fail(ErrorKind::bad_input,
                    fmt::format("{} has no frame {}; is it the truth of these originals?", marks.source.name, number));
    const auto mesh = marks.source.mesh_at(marks.source, marks.place_of[original]);
    if (!mesh) return tl::unexpected(mesh.error());
    return meter.add(mesh->mesh, decoded);
}

Result<Measured> measure(const Options& options, Sources& sources, const std::vector<FramePair>& pairs) {
    auto& [original, decoded] = sources;
    Measured out;
    std::optional<Marks> marks;
    if (!options.truth.empty()) {
        auto opened = open_marks(options, original);
        if (!opened) return tl::unexpected(opened.error());
        marks = std::move(*opened);
    }
    FlickerMeter flicker(flicker_options(options.compare));
    std::optional<FramePair> before;
    Progress progress("compare", pairs.size());
    for (const auto& pair : pairs) {
        auto first = original.mesh_at(original, pair.original);
        if (!first) return tl::unexpected(first.error());
        auto second = decoded.mesh_at(decoded, pair.decoded);
        if (!second) return tl::unexpected(second.error());
        // Triangles that keep their texture coordinates show the original's image.
        if (second->mesh.colours.empty() && !second->texture && !second->mesh.texcoords.empty())
            second->texture = first->texture;
        if (out.frames.empty()) warn_of_sizes(sources, first->mesh, second->mesh);
        auto comparison = compare_frame(*first, *second, options.compare);
        if (!comparison)
            return fail(comparison.error().kind,
                        fmt::format("Frame {}: {}", pair.original, comparison.error().message));
        out.sums += *comparison;
        out.frames.push_back(*comparison);
        out.places.push_back(pair.original);
        out.kinds.push_back(decoded.is_stream ? std::optional(decoded.kinds[pair.decoded]) : std::nullopt);
        if (marks) {
            const auto number = original.numbers.empty() ? pair.original : original.numbers[pair.original];
            const auto drift = measure_drift(*marks, out.drift, pair.original, number, second->mesh);
            if (!drift) return tl::unexpected(drift.error());
            out.drifts.push_back(*drift);
        }
        if (!options.pictures.empty())
            if (const auto ok = write_pictures(options, *first, *second, pair.original); !ok)
                return tl::unexpected(ok.error());
        if (options.flicker) {
            if (before && (pair.original != before->original + 1 || pair.decoded != before->decoded + 1))
                flicker.begin_anew();
            before = pair;
            auto change = flicker.add(std::move(*first), std::move(*second));
            if (!change) return tl::unexpected(change.error());
            out.flickers.push_back({*change, {}});
            if (decoded.is_stream) out.flickers.back().kind = decoded.kinds[pair.decoded];
        }
        progress.step();
    }
    if (original.millimetres_per_unit != decoded.millimetres_per_unit)
        note(fmt::format("took the original's unit for {:g} mm and the decoded's for {:g} mm; --unit says otherwise",
                         original.millimetres_per_unit, decoded.millimetres_per_unit));
    if (out.frames.empty()) return fail(ErrorKind::bad_input, "There was no frame to compare.");
    return out;
}

Result<void> write_csv(const Options& options, const Measured& measured, double peak_mm) {
    std::string text = csv_header(options.compare);
    if (!measured.flickers.empty()) text += ",kind,flicker_lit,flicker_unlit,flicker_still_lit,flicker_still_unlit";
    if (!measured.drifts.empty()) text += ",drift_age,drift_mean_mm,drift_p95_mm";
    text += '\n';
    for (std::size_t i = 0; i < measured.frames.size(); ++i) {
        text += csv_line(measured.places[i], measured.frames[i], options.compare, peak_mm);
        if (!measured.flickers.empty()) text += flicker_cells(measured.flickers[i]);
        if (!measured.drifts.empty()) {
            const FrameDrift& drift = measured.drifts[i];
            text += fmt::format(",{},{:.8g},{:.8g}", drift.age, drift.mean_mm, drift.p95_mm);
        }
        text += '\n';
    }
    if (options.csv == "-") {
        fmt::print("{}", text);
        return {};
    }
    return write_file(options.csv, text);
}

nlohmann::json drift_json(const FrameDrift& drift) {
    return {{"age", drift.age}, {"marks", drift.marks}, {"mean_mm", drift.mean_mm}, {"p95_mm", drift.p95_mm}};
}

// Overall, and at some ages.
std::string drift_rows(const DriftMeter& meter) {
    const auto by_age = meter.by_age();
    const FrameDrift all = meter.overall();
    std::string out = fmt::format("\n  {:<34}{:>12}{:>12}\n", "drift along the surface, mm", "mean", "95 %");
    const auto add = [&](const std::string& what, const FrameDrift& drift) {
        out += fmt::format("  {:<34}{:>12.3f}{:>12.3f}\n", what, drift.mean_mm, drift.p95_mm);
    };
    for (const std::size_t age : {0, 1, 2, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000})
        if (age < by_age.size() && by_age[age].marks > 0)
            add(age == 0 ? "  at the reference" : fmt::format("  after {}", counted(age, "frame")), by_age[age]);
    if (all.marks > 0)
        add("  all frames but references", all);
    else
        out += "  no frame has the same triangles as the one before: nothing slides\n";
    return out;
}

nlohmann::json as_json(const Options& options, const Measured& measured, double peak_mm) {
    nlohmann::json frames = nlohmann::json::array();
    for (std::size_t i = 0; i < measured.frames.size(); ++i) {
        const auto& frame = measured.frames[i];
        auto line = summary_json(summarise(as_sequence(frame), peak_mm), options.compare);
        line["frame"] = measured.places[i];
        if (options.compare.regions)
            line["worst_region"] = {{"rms_mm", frame.region.worst_mm}, {"centre_mm", frame.region.centre}};
        line["original_vertices"] = frame.original_vertices;
        line["decoded_vertices"] = frame.decoded_vertices;
        if (options.compare.topology) {
            line["original_topology"] = topology_json(frame.original_topology);
            line["decoded_topology"] = topology_json(frame.decoded_topology);
        }
        if (!measured.drifts.empty()) line["drift"] = drift_json(measured.drifts[i]);
        if (!measured.flickers.empty()) {
            const auto& [change, kind] = measured.flickers[i];
            if (change) line["flicker"] = flicker_json(*change);
            if (kind) line["kind"] = kind_of(*kind).letter;
        }
        frames.push_back(std::move(line));
    }
    nlohmann::json out = {
        {"original", options.originals.front()}, {"decoded", options.decoded}, {"frames", std::move(frames)}};
    out["sequence"] = summary_json(summarise(measured.sums, peak_mm), options.compare);
    if (options.compare.regions) out["sequence"]["worst_region"] = regions_json(measured.frames, measured.kinds);
    if (!measured.drifts.empty()) {
        auto& drift = out["sequence"]["drift"] = drift_json(measured.drift.overall());
        drift.erase("age");
        for (const FrameDrift& of_age : measured.drift.by_age()) drift["by_age"].push_back(drift_json(of_age));
    }
    if (has_flicker(measured.flickers)) out["sequence"]["flicker"] = flicker_json(measured.flickers);
    return out;
}

Result<void> compare(Options options) {
    choose_metrics(options);
    if (!options.pictures.empty()) {
        std::error_code error;
        std::filesystem::create_directories(options.pictures, error);
        if (error) return fail(ErrorKind::bad_input, options.pictures + " cannot be made: " + error.message());
    }
    auto sources = open_sources(options);
    if (!sources) return tl::unexpected(sources.error());
    auto pairs = pairs_of(*sources);
    if (options.frames > 0 && pairs.size() > options.frames)
        pairs.resize(options.frames);  // frames behind these were not asked for
    else
        warn_of_frames_left_out(*sources, pairs);
    if (options.follow_sequence) {
        const auto box = sequence_box(options, pairs);
        if (!box) return tl::unexpected(box.error());
        options.compare.view_box = *box;
    }
    const internal::ThreadPool pool(options.threads);
    options.compare.threads = pool.threads();
    const auto measured = measure(options, *sources, pairs);
    if (!measured) return tl::unexpected(measured.error());
    // The PSNR of each frame uses the peak of the sequence, so that frames can be compared with each other.
    const double peak_mm = summarise(measured->sums, options.peak_mm).peak_mm;
    if (!options.csv.empty())
        if (auto ok = write_csv(options, *measured, peak_mm); !ok) return ok;
    if (options.json) {
        fmt::print("{}\n", as_json(options, *measured, peak_mm).dump(2));
    } else if (options.csv != "-") {
        fmt::print("{}", comparison_table(measured->sums, options.compare, options.peak_mm));
        if (options.compare.regions) fmt::print("{}", region_rows(measured->frames, measured->kinds));
        if (!measured->drifts.empty()) fmt::print("{}", drift_rows(measured->drift));
        if (has_flicker(measured->flickers))
            fmt::print("{}", flicker_rows(measured->flickers, options.compare.render.shading));
    }
    return {};
}

// All names but the last are originals, as a shell makes many of a pattern. It makes them of two patterns as well, and
// then nobody can tell where the second begins.
void take_apart(Options& options) {
    options.originals = {options.first};
    options.originals.insert(options.originals.end(), options.others.begin(), options.others.end() - 1);
    options.decoded = options.others.back();
    std::error_code error;
    if (options.originals.size() > 1 && std::filesystem::is_regular_file(options.decoded, error) &&
        is_mesh_file_name(options.decoded))
        throw CLI::ValidationError(
            "DECODED", options.decoded + " is one mesh, behind several originals; give patterns in quotes, or folders");
}

void add_sequences(CLI::App& command, Options& o) {
    command.add_option("ORIGINAL", o.first, "A mesh file, folder, glob or %05d pattern; or several files")
        ->type_name("FILE")
        ->required();
    command
        .add_option("DECODED", o.others,
                    "The same for the decoded meshes, or an .htvm stream; behind several originals a stream or a "
                    "folder")
        ->type_name("FILE")
        ->expected(1, -1)
        ->required();
    command.add_option("--frames", o.frames, "Compare at most this many frames; 0: all (default: all)")
        ->group(heading::input);
    constexpr std::array<Choice<std::optional<LengthUnit>>, 4> units = {{{"auto", std::nullopt},
                                                                         {"mm", LengthUnit::millimetre},
                                                                         {"cm", LengthUnit::centimetre},
                                                                         {"m", LengthUnit::metre}}};
    add_choice(command, "--unit", o.unit, units, "Unit of the files: mm, cm, m, or auto (by the first frame's size)")
        ->default_str("auto")
        ->group(heading::input);
    command
        .add_option(
            "--timestamps", o.timestamps,
            "When each original was captured, as for 'htvm encode', if frames of a stream are to find theirs by it")
        ->type_name("FILE")
        ->group(heading::input);
    command.add_option("--ignore", o.ignored, "Originals that are no frames, by a glob, as for 'htvm encode'")
        ->type_name("GLOB")
        ->allow_extra_args(false)
        ->group(heading::input);
    add_texture_options(command, o.texture);
}

void add_measurements(CLI::App& command, Options& o) {
    command.option_defaults()->group(heading::measurements);
    command
        .add_option("--only", o.only,
                    "Measure only some of m1, m2, regions, texcoords, d1, d2, m3, flicker, topology, separated by\n"
                    "commas")
        ->delimiter(',')
        ->check(CLI::IsMember({"m1", "m2", "regions", "texcoords", "d1", "d2", "m3", "flicker", "topology"}))
        ->option_text("LIST");
    command
        .add_option("--truth", o.truth,
                    "What 'htvm synth --truth' wrote beside the originals: measures how far the decoded surface\n"
                    "slides along the true one while its triangles stay the same, by frames since they were new")
        ->type_name("FOLDER");
    command.add_option("--samples", o.compare.surface_options.samples,
                       "Samples for M2, in each direction (default: 10 times the triangles, like METRO)");
    command.add_option("--seed", o.compare.surface_options.seed, "Seed of M2's samples")->capture_default_str();
    command.add_option("--peak", o.peak_mm, "Peak of D1 and D2, mm (default: the originals' bounding box diagonal)")
        ->check(CLI::PositiveNumber);
    command.add_option("--crack-width", o.compare.topology_options.crack_width,
                       "Widest crack, mm (default: half of the mean edge length)");
    command.add_option("--flap-distance", o.compare.topology_options.flap_distance,
                       "Largest distance of a flap's layers, mm (default: the same)");
}

void add_pictures(CLI::App& command, Options& o) {
    command.option_defaults()->group(heading::pictures);
    ViewOptions& v = o.compare.views;
    command.add_option("--views", v.views, "Views around the body for M3 and flicker; 0: neither")
        ->check(CLI::Range(0, 1000))
        ->capture_default_str();
    add_camera_options(command, v, "");
    add_shading_options(command, o.shading, "");
    command.add_flag("--still-camera", o.follow_sequence,
                     "The cameras look at the box around the whole sequence instead of each frame's own\n"
                     "(reads the originals twice)");
    command.add_option("--pictures", o.pictures, "Folder for PNG files: original, decoded, difference (4-fold)")
        ->type_name("FOLDER");
    command.add_option("--picture-views", o.picture_views, "How many of the views are written")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
}

void add_results(CLI::App& command, Options& o) {
    command.option_defaults()->group(heading::output);
    command
        .add_option("--csv", o.csv,
                    "One line per frame to this file, or - for standard output; an infinite PSNR is inf")
        ->type_name("FILE");
    command.add_flag("--json", o.json, "Everything as JSON on standard output; an infinite PSNR is null");
    command.add_option("--threads", o.threads, "Threads to use (default: one per core); the result is the same")
        ->group(heading::parallel);
}

constexpr const char* what_is_measured =
    "Measure decoded meshes against their originals, frame by frame: by the times that streams and PLY files\n"
    "tell, else by the numbers in their names, or in the order of their names if they have none:\n"
    "  M1  vertex to nearest vertex, and the colour there (RMS, both ways; the paper's eq. 9, 10)\n"
    "  M2  point to surface, as METRO samples it (RMS, mean, largest; both ways; eq. 11, 12)\n"
    "  regions  the worst region of the surface, a ball of 10 cm: RMS distance there, in the worse direction; of\n"
    "      frames their median, 99th percentile and largest, of a stream's I-frames and its others apart\n"
    "  texture coordinates, at closest points of the surface; where they differ by more than 1/16 of the atlas "
    "they\n"
    "      are elsewhere in it, and counted by themselves\n"
    "  D1, D2  point-to-point and point-to-plane PSNR, as MPEG's point cloud metric\n"
    "  M3  PSNR and SSIM of pictures from all sides; unlit M3: of the same pictures without shading, which show\n"
    "      texture, where there are colours\n"
    "  flicker  how such pictures change from frame to frame, decoded beside original: a ratio of 1 is as calm "
    "as\n"
    "      the original; and how much the decoded ones change where the original is still; of a stream by kind of\n"
    "      frame, and beside the T-frames around it\n"
    "  topology  components, boundaries, cracks, flaps";

}  // namespace

void add_compare(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    CLI::App* command = app.add_subcommand("compare", "Measure decoded meshes against their originals");
    command->description(what_is_measured);
    add_sequences(*command, o);
    add_measurements(*command, o);
    add_pictures(*command, o);
    add_results(*command, o);
    add_decoder_limits(*command, o.limits);
    command->option_defaults()->group("Options");
    command->footer(
        "Examples:\n"
        "  htvm compare capture/ person.htvm\n"
        "  htvm compare 'scan_%05d.obj' meshes/ --only m1,m2 --csv errors.csv");
    add_front_page(*command, {{{"--only"},
                               {"--frames"},
                               {"--unit"},
                               {"--views"},
                               {"--shading"},
                               {"--pictures"},
                               {"--csv"},
                               {"--json"},
                               {"--threads"}}});
    command->callback([options, &run] {
        take_apart(*options);
        run = [options] { return compare(*options); };
    });
}

}  // namespace htvm::app
