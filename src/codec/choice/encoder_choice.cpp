#include "codec/choice/encoder_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "codec/choice/encoder_cost.h"
#include "codec/choice/scene_change_enc.h"
#include "codec/stage_clock_enc.h"

namespace htvm::internal {
namespace {

using State = EncoderState;

FrameSteps steps_of(const State& state, const QualitySteps& steps) {
    const double units = 1.0 / state.header.lattice.step();
    return {static_cast<std::int32_t>(
                std::clamp(std::lround(steps.geometry_step * units), 1L, static_cast<long>(lattice_limit))),
            static_cast<std::int32_t>(std::lround(steps.colour_step))};
}

bool same_attributes(const LatticeMesh& a, const LatticeMesh& b) {
    return a.colours.empty() == b.colours.empty() && a.normals.empty() == b.normals.empty() &&
           a.texcoords.empty() == b.texcoords.empty();
}

std::int64_t frames_since_intra(const State& state) {
    return std::int64_t{state.next_frame} - state.group->reference.frame;
}

bool cannot_refer(const State& state, const LatticeMesh& mesh) {
    return !state.group || state.group->reference.mesh.positions.empty() || mesh.positions.empty() ||
           !same_attributes(mesh, state.group->reference.mesh);
}

bool is_scene_change(State& state, FrameUnderWay& frame) {
    if (!state.options.topology.scene_changes || (state.options.profile == Profile::tracked)) return false;
    constexpr double far_mm = 150;
    return scene_changed(frame.mesh.positions, motion_of(state, frame).predicted, far_mm / state.header.lattice.step());
}

// What may be animated is at most this far off, lattice units; 0: unchecked.
double largest_animation_error(const State& state) {
    double largest = state.options.topology.animation_error;
    if (state.options.rate.target_error > 0) largest = std::min(largest > 0 ? largest : 1e6, state.options.rate.target_error);
    return largest / state.header.lattice.step();
}

// Motion-based coding where it is asked for and leaves something out; else all of the frame.
FrameCandidate encode_what_moves(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const auto& group = *state.group;
    if (!(state.options.topology.still_below > 0)) return encode_enhanced(state, frame, steps);
    const double units = 1.0 / state.header.lattice.step();
    const auto shifts = bone_shifts(group.reference, state.header.skeleton.bones, frame.pose);
    if (std::all_of(shifts.begin(), shifts.end(),
                    [&](double shift) { return shift >= state.options.topology.still_below * units; }))
        return encode_enhanced(state, frame, steps);
    const auto coded = choose_coded_bones(shifts, fit_of(state, frame), state.options.topology.still_below * units,
                                          largest_animation_error(state));
    return encode_coded_bones(state, frame, steps, coded);
}

bool animation_fits(State& state, FrameUnderWay& frame) {
    const double largest = largest_animation_error(state);
    if (!(largest > 0)) return true;
    const auto& fit = fit_of(state, frame);
    return std::all_of(fit.rms.begin(), fit.rms.end(), [&](double rms) { return rms <= largest; });
}

Result<FrameCandidate> choose_by_motion(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const auto shifts = bone_shifts(state.group->reference, state.header.skeleton.bones, frame.pose);
    const double skeletal_motion = std::accumulate(shifts.begin(), shifts.end(), 0.0) * state.header.lattice.step();
    const auto& options = state.options;
    if (options.topology.intra_above > 0 && skeletal_motion > options.topology.intra_above &&
        frames_since_intra(state) >= options.least_key_interval)
        return encode_intra(state, frame, steps);
    if (skeletal_motion < options.topology.predicted_below && animation_fits(state, frame))
        return encode_predicted(state, frame);
    return encode_what_moves(state, frame, steps);
}

// Whether a T-frame does worse than its group can: over all, or in one region, such as a hand, as far as that shows.
bool lost_track(const TrackedFit& fit, const Group& group, double units) {
    constexpr double more_strays = 0.004, worst_to_best = 2.2, region_to_best = 7, region_to_intra = 1.5;
    constexpr double visible = 6, visible_in_edges = 0.5;  // mm; of the capture's edges
    const double best = group.best_fit > 0 ? group.best_fit : fit.rms;
    return fit.stray_share > group.intra_fit.stray_share + more_strays || fit.rms > worst_to_best * best ||
           fit.worst_region > std::max({region_to_best * best, region_to_intra * group.intra_fit.worst_region,
                                        visible * units, visible_in_edges * group.edge});
}

// A T-frame where it fits the capture: where a hand has left a pocket, or an arm was lost, the I-frame's mesh no longer
// serves, and an I-frame is due; so it is, at the earliest the least key interval
// behind the last, where the T-frame takes more bits than the I-frame did.
Result<FrameCandidate> choose_tracked(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    auto candidate = encode_tracked(state, frame, steps);
    if (!candidate) return candidate;
    const auto& group = *state.group;
    const auto& fit = candidate->fit =
        tracked_fit(state, frame, candidate->decoded, group.edge, group.intra_fit.squared);
    const bool lost = lost_track(fit, group, 1.0 / state.header.lattice.step());
    const bool dear = frames_since_intra(state) >= state.options.least_key_interval &&
                      static_cast<double>(candidate->bytes()) > group.intra_bytes;
    return lost || dear ? encode_intra(state, frame, steps) : std::move(candidate);
}

bool is_due(const State& state, const LatticeMesh& mesh) {
    return cannot_refer(state, mesh) || frames_since_intra(state) >= state.options.key_interval;
}

Result<FrameCandidate> choose(State& state, FrameUnderWay& frame, const FrameSteps& steps, bool force_intra) {
    if (force_intra || is_due(state, frame.mesh) || is_scene_change(state, frame))
        return state.options.topology.frame_choice == FrameChoice::rate_distortion ? encode_measured_intra(state, frame, steps)
                                                                          : encode_intra(state, frame, steps);
    if (state.options.profile == Profile::tracked) return choose_tracked(state, frame, steps);
    switch (state.options.topology.frame_choice) {
        case FrameChoice::motion:
            return choose_by_motion(state, frame, steps);
        case FrameChoice::rate_distortion:
            return choose_by_cost(state, frame, steps);
        case FrameChoice::fixed:
            break;
    }
    return encode_what_moves(state, frame, steps);
}

// Under rate control, of a frame that takes so many bits even at the lowest quality.
tl::unexpected<Error> does_not_fit(const State& state, double bits) {
    const double capacity = state.options.rate.bits_per_second * state.options.rate.buffer_seconds;
    const auto number = [](double x) {
        std::array<char, 32> text{};
        std::snprintf(text.data(), text.size(), "%.3g", x);
        return std::string(text.data());
    };
    std::string message = "the frame takes " + number(bits / 8000) +
                          " kB even at the lowest quality, and the buffer has room for " +
                          number(state.rate->room() / 8000) + " kB of its " + number(capacity / 8000) + " kB; give ";
    // Rounded up, as what is asked for must do.
    const auto enough = [&](double x) { return number(1.01 * x); };
    if (bits > capacity)
        message += "a bitrate of at least " + enough(bits / state.options.rate.buffer_seconds / 1e6) +
                   " Mbit/s or a buffer of at least " + enough(bits / state.options.rate.bits_per_second) + " s";
    else
        message += "a higher bitrate or a larger buffer";
    return fail(ErrorKind::limit, message);
}

FrameType expected_type(const State& state, const FrameUnderWay& frame, bool force_intra) {
    if (force_intra || is_due(state, frame.mesh)) return FrameType::intra;
    return (state.options.profile == Profile::tracked) ? FrameType::tracked : FrameType::enhanced;
}

// Rate control: coarser until the frame fits into the buffer; a P-frame at the last. The first frames of a type are
// coded up to four times, until their quality is what the rate allows.
Result<FrameCandidate> code_within_buffer(State& state, FrameUnderWay& frame, bool force_intra) {
    const auto fits = [&](const FrameCandidate& candidate) { return bits_of(state, candidate) <= state.rate->room(); };
    double quality = state.rate->quality(expected_type(state, frame, force_intra)), bits = 0;
    constexpr double far_off = 3;
    for (int trials = 3;;) {
        auto candidate = choose(state, frame, steps_of(state, quality_steps(quality)), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        bits = bits_of(state, *candidate);
        if (trials-- > 0 && state.rate->is_guess(candidate->type)) {
            // The codebooks that come with the first frame are not in every one.
            const auto own = static_cast<double>(candidate->packets.back().payload.size() + packet_overhead);
            state.rate->tried(candidate->type, quality, 8 * own);
            const double better = state.rate->quality(candidate->type);
            if (std::abs(better - quality) > far_off) {
                quality = better;
                continue;
            }
        }
        if (fits(*candidate)) return candidate;
        const double lower = state.rate->lower_quality(candidate->type, quality, bits);
        if (lower >= quality) break;
        quality = lower;
    }
    if (!cannot_refer(state, frame.mesh)) {
        auto moved = encode_predicted(state, frame);
        moved.quality = quality;
        if (fits(moved)) return moved;
    }
    auto error = does_not_fit(state, bits);
    state.rate->coded(FrameType::predicted, quality, 0);
    return error;
}

// Error control: again with what was learnt where the error is off; of several attempts, the nearest.
Result<FrameCandidate> code_to_error(State& state, FrameUnderWay& frame, bool force_intra) {
    constexpr int attempts = 4;
    FrameType type = expected_type(state, frame, force_intra);
    std::optional<FrameCandidate> nearest;
    double nearest_off = 0;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        const double quality = state.error->quality(type);
        auto candidate = choose(state, frame, steps_of(state, quality_steps(quality)), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        type = candidate->type;
        const double error = errors_of(state, frame, candidate->decoded).geometry_rms * state.header.lattice.step();
        if (state.error->accept(type, quality, error) || type == FrameType::predicted) return candidate;
        const double off = std::abs(std::log2(error / state.options.rate.target_error));
        if (!nearest || off < nearest_off) nearest_off = off, nearest = std::move(*candidate);
    }
    return std::move(*nearest);
}

}  // namespace

bool brings_header(const State& state, const FrameCandidate& candidate) {
    constexpr std::uint32_t repeated_after = 10;  // frames
    return !state.begun ||
           (candidate.type == FrameType::intra && state.next_frame - state.header_sent >= repeated_after);
}

double bits_of(const State& state, const FrameCandidate& candidate) {
    const std::size_t header =
        brings_header(state, candidate) ? write_sequence_header(state.header).size() + packet_overhead : 0;
    return 8.0 * static_cast<double>(candidate.bytes() + header);
}

Result<FrameCandidate> code_frame(State& state, FrameUnderWay& frame, bool force_intra) {
    if (state.rate) return code_within_buffer(state, frame, force_intra);
    if (state.error) return code_to_error(state, frame, force_intra);
    return choose(state, frame, steps_of(state, {state.options.geometry_step, state.options.colour_step}), force_intra);
}

}  // namespace htvm::internal
