#include "codec/choice/encoder_cost.h"

#include <algorithm>
#include <cmath>

#include "codec/intra/intra_frame.h"
#include "codec/stage_clock_enc.h"

namespace htvm::internal {
namespace {

using State = EncoderState;

// What a frame's errors may be: the I-frame's at the same quality, and a little for the estimate.
SurfaceErrors allowed_errors(const Group& group, const FrameSteps& steps) {
    constexpr double tolerance = 1.05;
    const double geometry = static_cast<double>(steps.geometry) / group.steps.geometry;
    const double colour = static_cast<double>(steps.colour) / group.steps.colour;
    return {tolerance * geometry * group.plain_intra.geometry_rms, tolerance * colour * group.plain_intra.colour_rms};
}

bool within(const SurfaceErrors& errors, const SurfaceErrors& allowed) {
    return errors.geometry_rms <= allowed.geometry_rms && errors.colour_rms <= allowed.colour_rms;
}

// An I-frame would hardly cost more.
bool is_dear(const Group& group, const FrameUnderWay& frame, const FrameCandidate& enhanced) {
    const double vertices = static_cast<double>(frame.mesh.positions.size());
    const double of_reference = static_cast<double>(std::max<std::size_t>(group.reference.mesh.positions.size(), 1));
    return static_cast<double>(enhanced.bytes()) >= 0.95 * group.intra_bytes * vertices / of_reference;
}

// The frames without residuals, or with some, where they are good enough.
std::optional<FrameCandidate> choose_animation(State& state, FrameUnderWay& frame, const FrameSteps& steps,
                                               const SurfaceErrors& allowed) {
    const auto& fit = fit_of(state, frame);
    std::vector<bool> coded;
    std::size_t animated = 0;
    for (const double rms : fit.rms) {
        coded.push_back(rms > allowed.geometry_rms);
        animated += coded.back() ? 0 : 1;
    }
    if (animated == 0) return std::nullopt;
    auto moved = encode_predicted(state, frame);
    if (within(errors_of(state, frame, moved.decoded), allowed)) return moved;
    if (animated == coded.size()) return std::nullopt;
    auto candidate = encode_coded_bones(state, frame, steps, coded);
    if (!within(errors_of(state, frame, candidate.decoded), allowed)) return std::nullopt;
    return candidate;
}

// True where what the frames since the I-frame have cost above the cheapest of them, this one too, would have paid for
// a new one.
bool intra_is_paid_for(const State& state, const FrameCandidate& candidate) {
    const auto& group = *state.group;
    const double bytes = static_cast<double>(candidate.bytes());
    const double least = group.least_bytes > 0 ? std::min(group.least_bytes, bytes) : bytes;
    return std::int64_t{state.next_frame} - group.reference.frame >= state.options.least_key_interval &&
           group.excess_bytes + bytes - least > group.intra_bytes - least;
}

}  // namespace

SurfaceErrors errors_of(const State& state, FrameUnderWay& frame, const LatticeMesh& decoded) {
    SurfaceDistanceOptions options;
    options.threads = state.threads;
    options.every = 4;
    if (!frame.surface) {
        auto points = points_of(frame.mesh.positions);
        SurfaceSearch search(points, frame.mesh.triangles);
        frame.surface = CapturedSurface{std::move(points), std::move(search)};
    }
    const auto shown = points_of(decoded.positions);
    return surface_errors({frame.surface->points, frame.mesh.triangles, frame.mesh.colours}, frame.surface->search,
                          {shown, decoded.triangles, decoded.colours}, options);
}

Result<FrameCandidate> encode_measured_intra(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    auto out = encode_intra(state, frame, steps);
    if (!out) return out;
    StageClock clock(state.stages);
    IntraFrameOptions plain;
    plain.geometry_step = steps.geometry;
    plain.colour_step = steps.colour;
    plain.merge_duplicates = state.options.topology.merge_duplicates;
    FramePayload payload;
    const auto decoded = encode_intra_frame(frame.mesh, plain, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    out->plain_intra = errors_of(state, frame, *decoded);
    out->steps = steps;
    clock.done("errors");
    return out;
}

Result<FrameCandidate> choose_by_cost(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const auto allowed = allowed_errors(*state.group, steps);
    if (auto animated = choose_animation(state, frame, steps, allowed)) return std::move(*animated);
    auto enhanced = encode_enhanced(state, frame, steps);
    const bool good = within(errors_of(state, frame, enhanced.decoded), allowed);
    const bool due = intra_is_paid_for(state, enhanced);
    if (good && !due && !is_dear(*state.group, frame, enhanced)) return enhanced;
    auto intra = encode_measured_intra(state, frame, steps);
    if (!intra) return intra;
    if (good && !due && enhanced.bytes() <= intra->bytes()) return enhanced;
    return intra;
}

}  // namespace htvm::internal
