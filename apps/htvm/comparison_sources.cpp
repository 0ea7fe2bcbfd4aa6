#include "comparison_sources.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <utility>

#include "command_line/terminal.h"

namespace htvm::app {
namespace {

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

}  // namespace

Result<Sources> open_sources(const ComparisonRequest& options) {
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

namespace {

// When the frames of a side were captured: as known; else, beside a stream, by their numbers at its frame rate.
std::vector<std::int64_t> times_of(const MeshSource& source, const MeshSource& other) {
    if (!source.times_us.empty() || source.is_stream || !other.is_stream) return source.times_us;
    std::vector<std::int64_t> out;
    for (const auto place : places_beside(source, other.frames))
        out.push_back(std::llround(static_cast<double>(place) / other.rate.per_second() * 1e6));
    return out;
}

}  // namespace

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

Result<Box> sequence_box(const ComparisonRequest& options, const std::vector<FramePair>& pairs) {
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

}  // namespace htvm::app
