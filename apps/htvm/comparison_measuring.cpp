#include "comparison_measuring.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "command_line/terminal.h"
#include "coverage_report.h"
#include "io/output_file.h"
#include "metrics/presence_change.h"
#include "metrics/surface_border.h"
#include "metrics/truth_coverage.h"

namespace htvm::app {
namespace {

// As M3's pictures, but of half their size.
FlickerOptions flicker_options(const CompareOptions& c) {
    FlickerOptions out{c.views, c.render, c.view_box, c.threads};
    out.views.width = (c.views.width + 1) / 2;
    out.views.height = (c.views.height + 1) / 2;
    return out;
}

Result<void> write_pictures(const ComparisonRequest& options, const TexturedMesh& original, const TexturedMesh& decoded,
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

// Meshes of the truth (htvm synth --truth), as they go with the originals: by number, else in order.
struct TrueMeshes {
    MeshSource source;
    std::vector<std::size_t> place_of;  // of each original; the number of frames: none
};

std::filesystem::path part_of_truth(const ComparisonRequest& options, const char* name) {
    return std::filesystem::path(options.truth) / name;
}

bool has_part_of_truth(const ComparisonRequest& options, const char* name) {
    std::error_code error;
    return !options.truth.empty() && std::filesystem::is_directory(part_of_truth(options, name), error);
}

// A truth that there is, and that something can be measured by.
Result<void> check_truth(const ComparisonRequest& options) {
    if (options.truth.empty()) return {};
    std::error_code error;
    if (!std::filesystem::is_directory(options.truth, error))
        return fail(ErrorKind::bad_input,
                    fmt::format("--truth: there is no folder {}; 'htvm synth CAPTURE --truth {}' writes one beside a "
                                "synthetic capture",
                                options.truth, options.truth));
    if (has_part_of_truth(options, "marks") || has_part_of_truth(options, "surface")) return {};
    return fail(ErrorKind::bad_input,
                fmt::format("--truth: {} is no truth: it must hold the folders marks, by which drift is measured, or "
                            "surface, by which coverage is, as 'htvm synth CAPTURE --truth FOLDER' writes them",
                            options.truth));
}

Result<TrueMeshes> open_truth(const ComparisonRequest& options, const char* name, const MeshSource& original) {
    auto source =
        open_meshes({part_of_truth(options, name).string()}, {LengthUnit::millimetre, "", options.limits, {}});
    if (!source) return tl::unexpected(source.error());
    TrueMeshes out{std::move(*source), std::vector<std::size_t>(original.frames)};
    const auto& numbers = out.source.numbers;
    const bool by_number = !original.numbers.empty() && !numbers.empty();
    for (std::size_t k = 0; k < original.frames; ++k)
        out.place_of[k] =
            by_number ? static_cast<std::size_t>(std::ranges::find(numbers, original.numbers[k]) - numbers.begin())
                      : std::min(k, out.source.frames);
    return out;
}

// The truth of the original at this position.
Result<Mesh> true_mesh(TrueMeshes& truth, const MeshSource& original, std::size_t position) {
    if (truth.place_of[position] == truth.source.frames)
        return fail(ErrorKind::bad_input,
                    fmt::format("{} has no frame {}; is it the truth of these originals?", truth.source.name,
                                original.numbers.empty() ? position : original.numbers[position]));
    auto mesh = truth.source.mesh_at(truth.source, truth.place_of[position]);
    if (!mesh) return tl::unexpected(mesh.error());
    return std::move(mesh->mesh);
}

// Whether a pair of frames follows the one before in both sequences.
bool follows(const FramePair& pair, const std::optional<FramePair>& before) {
    return before && pair.original == before->original + 1 && pair.decoded == before->decoded + 1;
}

// What the request leaves to the capture: whether it is so open that its errors are measured over what is covered.
void decide_coverage(ComparisonRequest& options, const Mesh& first) {
    const bool errors_alone =
        !options.compare.coverage && !options.coverage_if_open && (options.compare.surface || options.compare.regions);
    if (!options.coverage_if_open && !errors_alone) return;
    if (!is_open(first)) return;
    if (errors_alone) {
        note("the capture is open: what lies beside its borders counts as an error; --only coverage tells them apart");
        return;
    }
    options.compare.coverage = true;
    note("the capture is open: coverage is measured, too, and the errors over what is covered");
}

// What coverage needs besides compare_frame.
class CoverageMeasuring {
public:
    static Result<CoverageMeasuring> begin(const ComparisonRequest& options, const MeshSource& original) {
        CoverageOptions chosen = options.compare.coverage_options;
        chosen.threads = options.compare.threads;
        CoverageMeasuring out(chosen);
        if (!has_part_of_truth(options, "surface")) return out;
        auto opened = open_truth(options, "surface", original);
        if (!opened) return tl::unexpected(opened.error());
        out.truth_ = std::move(*opened);
        return out;
    }
    // The next frame; is_next: it follows the one before.
    Result<void> add(const MeshSource& original, std::size_t position, const Mesh& captured, const Mesh& shown,
                     bool is_next, CoverageFrames& frames) {
        if (!is_next) presence_.begin_anew();
        const auto change = presence_.add(captured, shown);
        if (!change) return tl::unexpected(change.error());
        frames.changes.push_back(*change);
        if (!truth_) return {};
        const auto truth = true_mesh(*truth_, original, position);
        if (!truth) return tl::unexpected(truth.error());
        if (const auto ok = check_measurable(*truth, "true surface"); !ok) return ok;
        const auto found = truth_coverage(captured, shown, *truth, {}, options_);
        if (!found) return tl::unexpected(found.error());
        frames.truths.push_back(*found);
        return {};
    }

private:
    explicit CoverageMeasuring(const CoverageOptions& options) : options_(options), presence_(options) {}
    CoverageOptions options_;
    PresenceMeter presence_;
    std::optional<TrueMeshes> truth_;
};

Result<FrameDrift> measure_drift(TrueMeshes& marks, DriftMeter& meter, const MeshSource& original, std::size_t position,
                                 const Mesh& decoded, const ShownVertices& shown) {
    const auto mesh = true_mesh(marks, original, position);
    if (!mesh) return tl::unexpected(mesh.error());
    return meter.add(*mesh, decoded, shown);
}

}  // namespace

Result<Measured> measure(ComparisonRequest& options, Sources& sources, const std::vector<FramePair>& pairs) {
    auto& [original, decoded] = sources;
    Measured out;
    std::optional<TrueMeshes> marks;
    if (const auto ok = check_truth(options); !ok) return tl::unexpected(ok.error());
    if (has_part_of_truth(options, "marks")) {
        auto opened = open_truth(options, "marks", original);
        if (!opened) return tl::unexpected(opened.error());
        marks = std::move(*opened);
    }
    FlickerMeter flicker(flicker_options(options.compare));
    std::optional<CoverageMeasuring> coverage;
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
        if (out.frames.empty()) {
            warn_of_sizes(sources, first->mesh, second->mesh);
            decide_coverage(options, first->mesh);
        }
        auto comparison = compare_frame(*first, *second, options.compare);
        if (!comparison)
            return fail(comparison.error().kind,
                        fmt::format("Frame {}: {}", pair.original, comparison.error().message));
        out.sums += *comparison;
        out.frames.push_back(*comparison);
        out.places.push_back(pair.original);
        out.kinds.push_back(decoded.is_stream ? std::optional(decoded.kinds[pair.decoded]) : std::nullopt);
        if (marks) {
            const auto drift = measure_drift(*marks, out.drift, original, pair.original, second->mesh, decoded.shown);
            if (!drift) return tl::unexpected(drift.error());
            out.drifts.push_back(*drift);
        }
        const bool is_next = follows(pair, before);
        before = pair;
        if (options.compare.coverage) {
            add_region(out.coverage, comparison->coverage, out.kinds.back());
            if (!coverage) {
                auto begun = CoverageMeasuring::begin(options, original);
                if (!begun) return tl::unexpected(begun.error());
                coverage.emplace(std::move(*begun));
            }
            if (const auto ok =
                    coverage->add(original, pair.original, first->mesh, second->mesh, is_next, out.coverage);
                !ok)
                return tl::unexpected(ok.error());
        }
        if (!options.pictures.empty())
            if (const auto ok = write_pictures(options, *first, *second, pair.original); !ok)
                return tl::unexpected(ok.error());
        if (options.flicker) {
            if (!is_next) flicker.begin_anew();
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
    if (!options.truth.empty() && !marks && !options.compare.coverage)
        note(fmt::format("{} has no folder marks, so drift is not measured; --only coverage measures by its surface",
                         options.truth));
    if (out.frames.empty()) return fail(ErrorKind::bad_input, "There was no frame to compare.");
    return out;
}

}  // namespace htvm::app
