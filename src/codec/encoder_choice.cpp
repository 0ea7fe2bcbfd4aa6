#include "codec/encoder_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "codec/encoder_cost.h"
#include "codec/scene_change_enc.h"

namespace htvm {
namespace {

using State = Encoder::State;

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
    if (!state.options.scene_changes || state.options.tracked) return false;
    constexpr double far_mm = 150;
    return scene_changed(frame.mesh.positions, motion_of(state, frame).predicted, far_mm / state.header.lattice.step());
}

// What may be animated is at most this far off, lattice units; 0: unchecked.
double largest_animation_error(const State& state) {
    double largest = state.options.animation_error;
    if (state.options.target_error > 0) largest = std::min(largest > 0 ? largest : 1e6, state.options.target_error);
    return largest / state.header.lattice.step();
}

// Motion-based coding where it is asked for and leaves something out; else all of the frame.
FrameCandidate encode_what_moves(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const auto& group = *state.group;
    if (!(state.options.still_below > 0)) return encode_enhanced(state, frame, steps);
    const double units = 1.0 / state.header.lattice.step();
    const auto shifts = bone_shifts(group.reference, state.header.skeleton.bones, frame.pose);
    const auto coded = choose_coded_bones(shifts, fit_of(state, frame), state.options.still_below * units,
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
    if (options.intra_above > 0 && skeletal_motion > options.intra_above &&
        frames_since_intra(state) >= options.least_key_interval)
        return encode_intra(state, frame, steps);
    if (skeletal_motion < options.predicted_below && animation_fits(state, frame))
        return encode_predicted(state, frame);
    return encode_what_moves(state, frame, steps);
}

// A T-frame where it fits the capture, else an I-frame.
Result<FrameCandidate> choose_tracked(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    return encode_tracked(state, frame, steps);
}

bool is_due(const State& state, const LatticeMesh& mesh) {
    return cannot_refer(state, mesh) || frames_since_intra(state) >= state.options.key_interval;
}

Result<FrameCandidate> choose(State& state, FrameUnderWay& frame, const FrameSteps& steps, bool force_intra) {
    if (force_intra || is_due(state, frame.mesh) || is_scene_change(state, frame))
        return state.options.frame_choice == FrameChoice::rate_distortion ? encode_measured_intra(state, frame, steps)
                                                                          : encode_intra(state, frame, steps);
    if (state.options.tracked) return choose_tracked(state, frame, steps);
    switch (state.options.frame_choice) {
        case FrameChoice::motion:
            return choose_by_motion(state, frame, steps);
        case FrameChoice::rate_distortion:
            return choose_by_cost(state, frame, steps);
        case FrameChoice::fixed:
            break;
    }
    return encode_what_moves(state, frame, steps);
}

// Rate control: coarser until the frame fits into the buffer; a P-frame at the last.
Result<FrameCandidate> code_within_buffer(State& state, FrameUnderWay& frame, bool force_intra) {
    const auto fits = [&](const FrameCandidate& candidate) { return bits_of(state, candidate) <= state.rate->room(); };
    const bool intra = force_intra || is_due(state, frame.mesh);
    double quality = state.rate->quality(intra ? FrameType::intra : FrameType::enhanced);
    for (;;) {
        auto candidate = choose(state, frame, steps_of(state, quality_steps(quality)), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        if (fits(*candidate)) return candidate;
        const double lower = state.rate->lower_quality(candidate->type, quality, bits_of(state, *candidate));
        if (lower >= quality) break;
        quality = lower;
    }
    if (!cannot_refer(state, frame.mesh)) {
        auto moved = encode_predicted(state, frame);
        moved.quality = quality;
        if (fits(moved)) return moved;
    }
    state.rate->coded(FrameType::predicted, quality, 0);
    return fail(ErrorKind::limit, "frame " + std::to_string(state.next_frame) +
                                      " does not fit into the buffer even at the lowest quality; give a higher bitrate "
                                      "or a larger buffer");
}

// Error control: again with what was learnt where the error is off.
Result<FrameCandidate> code_to_error(State& state, FrameUnderWay& frame, bool force_intra) {
    constexpr int attempts = 3;
    const bool intra = force_intra || is_due(state, frame.mesh);
    FrameType type = intra ? FrameType::intra : FrameType::enhanced;
    for (int attempt = 1;; ++attempt) {
        const double quality = state.error->quality(type);
        auto candidate = choose(state, frame, steps_of(state, quality_steps(quality)), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        type = candidate->type;
        const double error = errors_of(state, frame, candidate->decoded).geometry_rms * state.header.lattice.step();
        if (state.error->accept(type, quality, error) || type == FrameType::predicted || attempt == attempts)
            return candidate;
    }
}

}  // namespace

double bits_of(const State& state, const FrameCandidate& candidate) {
    const std::size_t header = state.begun ? 0 : write_sequence_header(state.header).size() + packet_overhead;
    return 8.0 * static_cast<double>(candidate.bytes() + header);
}

Result<FrameCandidate> code_frame(State& state, FrameUnderWay& frame, bool force_intra) {
    if (state.rate) return code_within_buffer(state, frame, force_intra);
    if (state.error) return code_to_error(state, frame, force_intra);
    return choose(state, frame, steps_of(state, {state.options.geometry_step, state.options.colour_step}), force_intra);
}

}  // namespace htvm
