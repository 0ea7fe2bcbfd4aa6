#include "comparison_measuring.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "command_line/terminal.h"
#include "io/output_file.h"

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

// The marks of a true surface (htvm synth --truth), as they go with the originals: by number, else in order.
struct Marks {
    MeshSource source;
    std::vector<std::size_t> place_of;  // of each original; the number of frames: none
};

Result<Marks> open_marks(const ComparisonRequest& options, const MeshSource& original) {
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

}  // namespace

Result<Measured> measure(const ComparisonRequest& options, Sources& sources, const std::vector<FramePair>& pairs) {
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

}  // namespace htvm::app
