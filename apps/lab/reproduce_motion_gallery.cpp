#include "reproduce_motion_gallery.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/thread.h"
#include "metrics/compare.h"

namespace htvm::lab {

using namespace app;
namespace {

constexpr Colour coded_tint{230, 125, 45}, animated_tint{90, 150, 215}, stitch_tint{60, 170, 90};
constexpr std::size_t most_seams = 10;  // frames whose seams are counted

struct MotionShot {
    std::size_t first = 0, frame = 0;       // the I-frame, and the frame shown
    std::vector<std::size_t> partly_coded;  // rising: where some bones move and some are still
};

std::vector<std::size_t> every_frame(std::size_t first, std::size_t last) {
    std::vector<std::size_t> out;
    for (std::size_t i = first; i <= last; ++i) out.push_back(i);
    return out;
}

// In the group two thirds into the sequence, the frame in which nearest to half of the bones move by the threshold.
Result<MotionShot> choose_shot(const SourceFrames& source, int key_interval, double threshold) {
    const auto interval = static_cast<std::size_t>(key_interval);
    MotionShot out;
    out.first = (source.size() * 2 / 3) / interval * interval;
    if (out.first + 1 >= source.size()) out.first = 0;
    const auto reference = source.frame(out.first);
    if (!reference) return tl::unexpected(reference.error());
    const auto& skeleton = source.facts().skeleton;
    double best = 2;
    for (const auto i : every_frame(out.first + 1, std::min(out.first + interval, source.size()) - 1)) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        if (!(*reference)->pose || !(*frame)->pose) continue;
        const auto motion = bone_motion(skeleton, *(*reference)->pose, *(*frame)->pose);
        const auto moving = std::count_if(motion.begin(), motion.end(), [&](double m) { return m >= threshold; });
        const double part = static_cast<double>(moving) / static_cast<double>(motion.size());
        if (moving > 0 && part < 1) out.partly_coded.push_back(i);
        if (std::abs(part - 0.5) > best) continue;
        best = std::abs(part - 0.5);
        out.frame = i;
    }
    if (out.frame == 0) return fail(ErrorKind::bad_input, "no frame behind an I-frame");
    return out;
}

// At most `most`, evenly spread, the frame shown among them.
std::vector<std::size_t> spread(const std::vector<std::size_t>& frames, std::size_t most, std::size_t shown) {
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < std::min(most, frames.size()); ++i)
        out.push_back(frames[i * frames.size() / std::min(most, frames.size())]);
    if (std::find(out.begin(), out.end(), shown) == out.end() && !out.empty()) {
        auto nearest = std::min_element(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
            return std::llabs(static_cast<long long>(a) - static_cast<long long>(shown)) <
                   std::llabs(static_cast<long long>(b) - static_cast<long long>(shown));
        });
        *nearest = shown;
        std::sort(out.begin(), out.end());
    }
    return out;
}

Result<double> surface_error(const Mesh& original, const Mesh& decoded, unsigned threads) {
    CompareOptions options;
    options.points = options.cloud = options.pictures = options.topology = false;
    options.surface_options.samples = 100000;
    const internal::ThreadPool pool(threads);
    options.threads = pool.threads();
    const auto compared = compare_frame(original, decoded, options);
    if (!compared) return tl::unexpected(compared.error());
    return m2(compared->surface);
}

// Three of the thresholds that code less than all: low, middle, high.
std::vector<std::pair<double, const RdPoint*>> shown_points(const Findings& findings) {
    auto all = by_threshold(findings.motion, still_below_words, findings.thresholds->still_below);
    std::erase_if(all, [](const auto& entry) { return !(entry.first > 0); });
    if (all.size() <= 3) return all;
    return {all.front(), all[all.size() / 2], all.back()};
}

Result<Figure> figure_19(const SourceFrames& source, const ExperimentPlan& plan, const Findings& findings,
                         const MotionShot& shot, double azimuth, const GalleryOptions& options) {
    Figure figure{"19",
                  fmt::format("a frame by motion-based coding, frame {}", shot.frame),
                  "Shows a frame at 11.5, 13.2 and 14.5 bpvf; differences are hard to see where the skeleton is good.",
                  {},
                  "From left to right: the original, and motion-based coding at falling thresholds; smooth shading. "
                  "Rates are the whole sequence's. The animation is unchecked, as in the paper."};
    const auto original = source.frame(shot.frame);
    if (!original) return tl::unexpected(original.error());
    std::vector<Mesh> decoded;
    std::vector<std::string> labels{"original"};
    auto points = shown_points(findings);
    std::reverse(points.begin(), points.end());
    for (const auto& [threshold, point] : points) {
        PictureJob job{motion_coder(plan.key_interval, threshold),
                       point->geometry_step,
                       point->colour_step,
                       bits_per_vertex(*point),
                       {shot.frame},
                       shot.first};
        auto meshes = decode_frames(source, job, options.threads);
        if (!meshes) return tl::unexpected(meshes.error());
        const auto error = surface_error((*original)->mesh, meshes->front(), options.threads);
        if (!error) return tl::unexpected(error.error());
        labels.push_back(
            fmt::format("coded above {:g} mm: {:.1f} bpvf, M2 {:.2f} mm", threshold, bits_per_vertex(*point), *error));
        figure.found += fmt::format("{}{:.2f} mm at {:.1f} bpvf", figure.found.empty() ? "M2 of this frame: " : ", ",
                                    *error, bits_per_vertex(*point));
        decoded.push_back(std::move(meshes->front()));
    }
    figure.found += ".";
    std::vector<const Mesh*> meshes{&(*original)->mesh};
    for (const auto& mesh : decoded) meshes.push_back(&mesh);
    for (const bool close_up : {false, true}) {
        RenderOptions render_options;
        const auto pictures =
            draw_tiles(meshes, {azimuth, close_up, close_up ? 300 : 440}, render_options, options.threads);
        if (!pictures) return tl::unexpected(pictures.error());
        auto row = save_tiles(*pictures, labels, options.folder, close_up ? "figure_19_close" : "figure_19");
        if (!row) return tl::unexpected(row.error());
        figure.tiles.push_back(std::move(*row));
    }
    return figure;
}

// The triangles near the spot, without what stands before it.
Mesh around(const Mesh& mesh, const SeamSpot& spot, double radius) {
    Mesh out = mesh;
    out.triangles.clear();
    const auto is_near = [&](std::uint32_t v) {
        const Point3 offset = to_point(mesh.positions[v]) - spot.centre;
        return length(offset) <= 1.5 * radius && dot(offset, spot.normal) <= 0.4 * radius;
    };
    for (const auto& t : mesh.triangles)
        if (std::all_of(t.begin(), t.end(), is_near)) out.triangles.push_back(t);
    return out;
}

Result<std::vector<Picture>> draw_spot(const std::vector<Mesh>& meshes, const SeamSpot& spot, double radius, int height,
                                       unsigned threads) {
    const double half = 0.55 * radius;
    Box box;
    box.low = spot.centre - Point3{{half, half, half}};
    box.high = spot.centre + Point3{{half, half, half}};
    box.empty = false;
    ViewOptions views;
    views.views = 1;
    views.first_azimuth = std::atan2(spot.normal[0], spot.normal[2]) * 180 / std::numbers::pi;
    views.elevation =
        std::clamp(std::asin(std::clamp(spot.normal[1], -1.0, 1.0)) * 180 / std::numbers::pi, -60.0, 60.0);
    views.orthographic = true;
    views.margin = 0;
    views.width = views.height = 2 * height;
    const auto cameras = cameras_round(box, views);
    if (!cameras) return tl::unexpected(cameras.error());
    RenderOptions options;
    options.shading = Shading::flat;
    const internal::ThreadPool pool(threads);
    std::vector<Picture> out;
    for (const auto& mesh : meshes)
        out.push_back(halved(render(around(mesh, spot, radius), cameras->front(), options, pool.threads())));
    return out;
}

struct Counts {
    double open_edges = 0, cracks = 0, crack_length = 0, flaps = 0, flap_area = 0, non_manifold = 0;
};

Counts mean_counts(const std::vector<SeamCounts>& seams, Topology SeamCounts::*stage) {
    Counts out;
    for (const auto& seam : seams) {
        const auto& t = seam.*stage;
        const double n = static_cast<double>(seams.size());
        out.open_edges += static_cast<double>(t.open_edges) / n;
        out.cracks += static_cast<double>(t.cracks) / n;
        out.crack_length += t.crack_length / n;
        out.flaps += static_cast<double>(t.flaps) / n;
        out.flap_area += t.flap_area / n;
        out.non_manifold += static_cast<double>(t.non_manifold_edges) / n;
    }
    return out;
}

std::string seam_words(const std::vector<SeamCounts>& seams) {
    const auto before = mean_counts(seams, &SeamCounts::overlapping), after = mean_counts(seams, &SeamCounts::zippered),
               trimmed = mean_counts(seams, &SeamCounts::trimmed), original = mean_counts(seams, &SeamCounts::original),
               animated = mean_counts(seams, &SeamCounts::animated);
    std::string out = fmt::format(
        "A frame on average, over {} frames: laid over each other, the parts have {:.0f} open edges, and {:.0f} mm² "
        "lie "
        "double or close to double; trimmed, {:.0f} open edges, {:.1f} cracks of {:.0f} mm in all and {:.0f} mm²; "
        "zippered, {:.1f} open edges, {:.1f} cracks of {:.1f} mm and {:.0f} mm².",
        seams.size(), before.open_edges, before.flap_area, trimmed.open_edges, trimmed.cracks, trimmed.crack_length,
        trimmed.flap_area, after.open_edges, after.cracks, after.crack_length, after.flap_area);
    return out + fmt::format(
                     " Without a seam, the captured mesh has {:.1f} open edges and {:.0f} mm², and the I-frame's mesh, "
                     "animated as a whole, {:.1f} and {:.0f} mm².",
                     original.open_edges, original.flap_area, animated.open_edges, animated.flap_area);
}

Result<Figure> zippering_figure(const Mesh& original, const SeamStages& stages, double azimuth,
                                const GalleryOptions& options, const Findings& findings) {
    Figure figure{"19b", fmt::format("the seams of a motion-coded frame, frame {}", stages.frame),
                  "Overlapping border triangles are trimmed, one border is cut back to the other, and both are "
                  "zippered into one surface.",
                  seam_words(findings.seams),
                  "Orange: coded. Blue: the I-frame's mesh, animated. Green: stitches. Below, a seam close up, flat "
                  "shading. A crack is an open edge that faces another within two mean edges; a flap, two layers of "
                  "surface within half an edge."};
    const Mesh overlapping = tinted(stages.overlapping, stages.coded_triangles, stages.overlapping.triangles.size()),
               trimmed = tinted(stages.trimmed, stages.coded_triangles, stages.kept_end),
               zippered = tinted(stages.zippered, stages.coded_triangles, stages.kept_end);
    const auto whole =
        draw_tiles({&original, &overlapping, &zippered, &stages.zippered}, {azimuth, false, 440}, {}, options.threads);
    if (!whole) return tl::unexpected(whole.error());
    auto row = save_tiles(*whole, {"original", "coded and animated parts", "zippered", "zippered, as it is shown"},
                          options.folder, "figure_19b");
    if (!row) return tl::unexpected(row.error());
    figure.tiles.push_back(std::move(*row));
    std::vector<Picture> strip(whole->begin(), whole->end());
    const double radius = 8 * mean_edge_length(original);
    if (const auto spot = busiest_seam(stages, radius)) {
        const auto close =
            draw_spot({overlapping, trimmed, zippered, stages.zippered}, *spot, radius, 440, options.threads);
        if (!close) return tl::unexpected(close.error());
        row = save_tiles(*close, {"overlapping", "trimmed", "zippered", "zippered, as it is shown"}, options.folder,
                         "figure_19b_close");
        if (!row) return tl::unexpected(row.error());
        figure.tiles.push_back(std::move(*row));
        strip = {(*whole)[0], (*whole)[1], (*whole)[2], (*close)[0], (*close)[1], (*close)[2]};
    }
    if (auto written = write_png(side_by_side(strip), (options.folder / "zippering.png").string()); !written)
        return tl::unexpected(written.error());
    return figure;
}

Result<Figure> seams(const SourceFrames& source, const ExperimentPlan& plan, const MotionShot& shot, double threshold,
                     double azimuth, const GalleryOptions& options, Findings& findings) {
    auto coder = paper_options(plan.key_interval);
    coder.topology.still_below = threshold;
    coder.topology.animation_error = 0;
    coder.geometry_step = plan.motion_step;
    coder.colour_step = plan.picture_colour_step;
    coder.threads = options.threads;
    auto numbers = spread(shot.partly_coded, most_seams, shot.frame);
    numbers.insert(numbers.begin(), shot.first);
    std::vector<std::shared_ptr<const SourceFrame>> frames;
    for (const auto number : numbers) {
        auto frame = source.frame(number);
        if (!frame) return tl::unexpected(frame.error());
        frames.push_back(std::move(*frame));
    }
    const auto stages = code_in_stages(frames, source.facts(), coder);
    if (!stages) return tl::unexpected(stages.error());
    const SeamStages* shown = nullptr;
    for (const auto& stage : *stages) {
        const auto original = source.frame(stage.frame);
        if (!original) return tl::unexpected(original.error());
        const auto counted = count_seams((*original)->mesh, stage, options.threads);
        if (!counted) return tl::unexpected(counted.error());
        findings.seams.push_back(*counted);
        if (!shown || stage.frame == shot.frame) shown = &stage;
    }
    if (!shown) {
        Figure figure{"19b", "the seams of a motion-coded frame", {}, {}, {}};
        figure.skipped = "no frame has both bones that move and bones that are still.";
        return figure;
    }
    const auto original = source.frame(shown->frame);
    if (!original) return tl::unexpected(original.error());
    return zippering_figure((*original)->mesh, *shown, azimuth, options, findings);
}

}  // namespace

Mesh tinted(const Mesh& mesh, std::size_t coded_triangles, std::size_t kept_end) {
    Mesh out;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        for (const auto v : mesh.triangles[t]) out.positions.push_back(mesh.positions[v]);
        const auto tint = t < coded_triangles ? coded_tint : t < kept_end ? animated_tint : stitch_tint;
        out.colours.insert(out.colours.end(), 3, tint);
        out.triangles.push_back({first, first + 1, first + 2});
    }
    return out;
}

std::optional<SeamSpot> busiest_seam(const SeamStages& stages, double radius) {
    const auto& mesh = stages.zippered;
    std::vector<SeamSpot> stitches;
    for (std::size_t t = stages.kept_end; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Point3 corners[] = {to_point(mesh.positions[a]), to_point(mesh.positions[b]),
                                  to_point(mesh.positions[c])};
        stitches.push_back({(corners[0] + corners[1] + corners[2]) * (1.0 / 3),
                            normalised(cross(corners[1] - corners[0], corners[2] - corners[0]))});
    }
    std::optional<SeamSpot> best;
    double most = 0;
    for (const auto& stitch : stitches) {
        Point3 normal{{0, 0, 0}};
        double near = 0;
        for (const auto& other : stitches) {
            if (length(other.centre - stitch.centre) > radius / 2) continue;
            normal = normal + other.normal;
            ++near;
        }
        // Many stitches, that face the same way: they lie side by side in a picture from there.
        const double together = length(normal), score = together * together / near;
        if (!(score > most)) continue;
        most = score;
        best = SeamSpot{stitch.centre, normalised(normal)};
    }
    return best;
}

std::optional<Table> seam_table(const Findings& findings) {
    if (findings.seams.empty()) return std::nullopt;
    Table table;
    table.title = "Seams of motion-based coding";
    table.head = {"Stage, mean of a frame", "open edges", "cracks", "crack mm", "flaps", "flap mm²",
                  "non-manifold edges"};
    const std::pair<const char*, Topology SeamCounts::*> stages[] = {{"as captured", &SeamCounts::original},
                                                                     {"animated alone", &SeamCounts::animated},
                                                                     {"laid over each other", &SeamCounts::overlapping},
                                                                     {"trimmed", &SeamCounts::trimmed},
                                                                     {"zippered", &SeamCounts::zippered}};
    for (const auto& [name, stage] : stages) {
        const auto counts = mean_counts(findings.seams, stage);
        table.rows.push_back({name, fmt::format("{:.1f}", counts.open_edges), fmt::format("{:.1f}", counts.cracks),
                              fmt::format("{:.1f}", counts.crack_length), fmt::format("{:.1f}", counts.flaps),
                              fmt::format("{:.0f}", counts.flap_area), fmt::format("{:.1f}", counts.non_manifold)});
    }
    table.note = fmt::format("{} frames, partly coded.", findings.seams.size());
    return table;
}

Result<std::vector<Figure>> motion_pictures(const SourceFrames& source, const ExperimentPlan& plan,
                                            const std::set<int>& wanted, const GalleryOptions& options,
                                            Findings& findings) {
    std::vector<Figure> out;
    if (!wanted.contains(19)) return out;
    if (!findings.thresholds || findings.motion.empty()) {
        Figure figure{"19", "a frame by motion-based coding", {}, {}, {}};
        figure.skipped = "the capture has no skeleton whose motion could choose.";
        out.push_back(std::move(figure));
        return out;
    }
    const auto points = shown_points(findings);
    if (points.empty()) return out;
    const double threshold = points[points.size() / 2].first;
    const auto shot = choose_shot(source, plan.key_interval, threshold);
    if (!shot) return tl::unexpected(shot.error());
    const auto shown = source.frame(shot->frame);
    if (!shown) return tl::unexpected(shown.error());
    const double azimuth =
        options.azimuth.value_or(front_azimuth((*shown)->mesh, source.facts().skeleton, (*shown)->pose));
    auto pictures = figure_19(source, plan, findings, *shot, azimuth, options);
    if (!pictures) return tl::unexpected(pictures.error());
    out.push_back(std::move(*pictures));
    auto zippered = seams(source, plan, *shot, threshold, azimuth, options, findings);
    if (!zippered) return tl::unexpected(zippered.error());
    out.push_back(std::move(*zippered));
    return out;
}

}  // namespace htvm::lab
