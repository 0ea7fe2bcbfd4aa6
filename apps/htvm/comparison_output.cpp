#include "comparison_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "command_line/terminal.h"

namespace htvm::app {
namespace {

const char* shading_name(Shading shading) {
    return shading == Shading::flat ? "flat" : shading == Shading::smooth ? "smooth" : "unlit";
}

}  // namespace

std::string row(const std::string& what, double forward, double backward, double larger, int digits) {
    return fmt::format("  {:<34} {:>11.{}f} {:>11.{}f} {:>11.{}f}\n", what, forward, digits, backward, digits, larger,
                       digits);
}

std::string single(const std::string& what, double value, int digits) {
    return fmt::format("  {:<34}{:>36.{}f}\n", what, value, digits);
}

namespace {

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

}  // namespace

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

nlohmann::json distances_json(const SurfaceDistances& d) {
    return {{"rms_mm", d.rms}, {"mean_mm", d.mean}, {"largest_mm", d.largest}, {"samples", d.samples}};
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

}  // namespace htvm::app
