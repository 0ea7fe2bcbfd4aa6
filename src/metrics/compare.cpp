#include "metrics/compare.h"

#include <algorithm>

namespace htvm {
namespace {

void compare_vertices(const Mesh& original_mesh, const Mesh& decoded_mesh, const CompareOptions& options,
                      FrameComparison& out) {
    const auto first = without_hidden_vertices(original_mesh), second = without_hidden_vertices(decoded_mesh);
    const Mesh &original = first ? *first : original_mesh, &decoded = second ? *second : decoded_mesh;
    const auto forward = nearest_vertices(original.positions, decoded.positions, options.threads);
    const auto backward = nearest_vertices(decoded.positions, original.positions, options.threads);
    if (options.points)
        out.points = {sum_point_errors(original, decoded, forward), sum_point_errors(decoded, original, backward)};
    if (options.cloud)
        out.cloud = {sum_cloud_errors(original, decoded, forward), sum_cloud_errors(decoded, original, backward)};
}

Result<void> compare_pictures(const ShownMesh& original, const ShownMesh& decoded, const CompareOptions& options,
                              FrameComparison& out) {
    const auto cameras = cameras_round(options.view_box.value_or(out.original_box), options.views);
    if (!cameras) return tl::unexpected(cameras.error());
    RenderOptions render = options.render;
    render.colours = render.colours && original.has_colours() && decoded.has_colours();
    out.pictures =
        compare_views(make_drawable(original, render), make_drawable(decoded, render), *cameras, options.threads);
    if (!render.colours) return {};
    render.shading = Shading::unlit;
    out.unlit_pictures =
        compare_views(make_drawable(original, render), make_drawable(decoded, render), *cameras, options.threads);
    return {};
}

std::uint64_t shown_count(const Mesh& mesh) {
    return static_cast<std::uint64_t>(std::ranges::count(shown_vertices(mesh), true));
}

Topology& operator+=(Topology& sums, const Topology& t) {
    sums.vertices += t.vertices;
    sums.triangles += t.triangles;
    sums.isolated_vertices += t.isolated_vertices;
    sums.degenerate_triangles += t.degenerate_triangles;
    sums.duplicate_triangles += t.duplicate_triangles;
    sums.edges += t.edges;
    sums.boundary_edges += t.boundary_edges;
    sums.non_manifold_edges += t.non_manifold_edges;
    sums.components += t.components;
    sums.euler += t.euler;
    sums.open_edges += t.open_edges;
    sums.crack_edges += t.crack_edges;
    sums.cracks += t.cracks;
    sums.crack_length += t.crack_length;
    sums.flap_triangles += t.flap_triangles;
    sums.flaps += t.flaps;
    sums.flap_area += t.flap_area;
    return sums;
}

}  // namespace

Result<FrameComparison> compare_frame(const ComparedMesh& first, const ComparedMesh& second,
                                      const CompareOptions& options) {
    const Mesh &original = *first.mesh, &decoded = *second.mesh;
    if (const auto ok = check_measurable(original, "original"); !ok) return tl::unexpected(ok.error());
    if (const auto ok = check_measurable(decoded, "decoded mesh"); !ok) return tl::unexpected(ok.error());
    FrameComparison out;
    out.original_vertices = shown_count(original);
    out.decoded_vertices = shown_count(decoded);
    out.original_triangles = original.triangles.size();
    out.decoded_triangles = decoded.triangles.size();
    out.original_box = bounding_box(original);
    if (options.points || options.cloud) compare_vertices(original, decoded, options, out);
    if (options.surface) {
        SurfaceErrorOptions surface = options.surface_options;
        surface.threads = options.threads;
        const auto error = surface_error(original, decoded, surface);
        if (!error) return tl::unexpected(error.error());
        out.surface = *error;
    }
    if (options.regions) {
        RegionErrorOptions regions;
        regions.threads = options.threads;
        const auto error = worst_region(original, decoded, regions);
        if (!error) return tl::unexpected(error.error());
        out.region = *error;
    }
    if (options.coverage) {
        CoverageOptions covered = options.coverage_options;
        covered.threads = options.threads;
        const auto found = coverage(original, decoded, covered);
        if (!found) return tl::unexpected(found.error());
        out.coverage = *found;
    }
    if (options.texcoords) {
        const auto error = texcoord_error(original, decoded, options.threads);
        if (!error) return tl::unexpected(error.error());
        out.texcoords = *error;
    }
    if (options.pictures)
        if (const auto done = compare_pictures(first.shown, second.shown, options, out); !done)
            return tl::unexpected(done.error());
    if (options.topology) {
        const auto of_original = topology(original, options.topology_options, options.threads);
        if (!of_original) return tl::unexpected(of_original.error());
        const auto of_decoded = topology(decoded, options.topology_options, options.threads);
        if (!of_decoded) return tl::unexpected(of_decoded.error());
        out.original_topology = *of_original;
        out.decoded_topology = *of_decoded;
    }
    return out;
}

SequenceComparison& operator+=(SequenceComparison& sums, const FrameComparison& frame) {
    ++sums.frames;
    sums.original_vertices += frame.original_vertices;
    sums.decoded_vertices += frame.decoded_vertices;
    sums.original_triangles += frame.original_triangles;
    sums.decoded_triangles += frame.decoded_triangles;
    extend(sums.original_box, frame.original_box);
    sums.points += frame.points;
    sums.surface += frame.surface;
    sums.coverage += frame.coverage;
    sums.texcoords += frame.texcoords;
    sums.cloud += frame.cloud;
    sums.pictures += frame.pictures;
    sums.unlit_pictures += frame.unlit_pictures;
    sums.original_topology += frame.original_topology;
    sums.decoded_topology += frame.decoded_topology;
    return sums;
}

SequenceComparison as_sequence(const FrameComparison& frame) {
    SequenceComparison sums;
    sums += frame;
    return sums;
}

ComparisonSummary summarise(const SequenceComparison& sums, double peak_mm) {
    ComparisonSummary out;
    const auto& [forward, backward] = sums.points;
    out.m1_forward_mm = rms_distance(forward);
    out.m1_backward_mm = rms_distance(backward);
    out.m1_mm = m1_geometry(sums.points);
    out.m1_largest_mm = std::max(forward.largest_distance, backward.largest_distance);
    out.has_colour = forward.colour_vertices > 0 || backward.colour_vertices > 0;
    out.m1_colour_forward = rms_colour(forward);
    out.m1_colour_backward = rms_colour(backward);
    out.m1_colour = m1_colour(sums.points);
    out.m2_forward = sequence_forward(sums.surface);
    out.m2_backward = sequence_backward(sums.surface);
    out.m2_mm = m2(sums.surface);
    out.m2_worst_frame_mm = sums.surface.worst_frame_rms;
    out.captured_covered = covered_share(sums.coverage.captured);
    out.captured_absent = absent_share(sums.coverage.captured);
    out.captured_least_covered = sums.coverage.captured.least_covered;
    out.shown_covered = covered_share(sums.coverage.shown);
    out.shown_absent = absent_share(sums.coverage.shown);
    out.shown_least_covered = sums.coverage.shown.least_covered;
    out.has_covered = sums.coverage.errors.frames > 0;
    out.covered_forward = sequence_forward(sums.coverage.errors);
    out.covered_backward = sequence_backward(sums.coverage.errors);
    out.covered_m2_mm = m2(sums.coverage.errors);
    out.covered_worst_frame_mm = sums.coverage.errors.worst_frame_rms;
    out.has_texcoords = sums.texcoords.area > 0;
    out.texcoord_rms = rms_texcoord(sums.texcoords);
    out.texcoord_elsewhere = share_elsewhere(sums.texcoords);
    out.hausdorff_mm = std::max(out.m2_forward.largest, out.m2_backward.largest);
    out.peak_mm = peak_mm > 0 ? peak_mm : diagonal(sums.original_box);
    out.d1_db = d1_psnr(sums.cloud, out.peak_mm);
    out.d2_db = d2_psnr(sums.cloud, out.peak_mm);
    out.m3_foreground_db = psnr_foreground(sums.pictures);
    out.m3_full_db = psnr_full(sums.pictures);
    out.m3_ssim = mean_similarity(sums.pictures.similarity);
    if (sums.pictures.pixels > 0)
        out.foreground_share =
            static_cast<double>(sums.pictures.foreground_pixels) / static_cast<double>(sums.pictures.pixels);
    out.has_unlit = sums.unlit_pictures.pixels > 0;
    out.m3_unlit_foreground_db = psnr_foreground(sums.unlit_pictures);
    out.m3_unlit_full_db = psnr_full(sums.unlit_pictures);
    out.m3_unlit_ssim = mean_similarity(sums.unlit_pictures.similarity);
    return out;
}

}  // namespace htvm
