#include "codec/encoder_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "codec/scene_change_enc.h"

namespace htvm {
namespace {

using State = Encoder::State;

FrameSteps steps_of(const State& state, double geometry_mm, double colour_levels) {
    const double units = 1.0 / state.header.lattice.step();
    return {
        static_cast<std::int32_t>(std::clamp(std::lround(geometry_mm * units), 1L, static_cast<long>(lattice_limit))),
        static_cast<std::int32_t>(std::lround(colour_levels))};
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
    if (!state.options.scene_changes) return false;
    constexpr double far_mm = 150;
    return scene_changed(frame.mesh.positions, motion_of(state, frame).predicted, far_mm / state.header.lattice.step());
}

// Motion-based coding where it is asked for and leaves something out; else all of the frame.
FrameCandidate encode_what_moves(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const auto& group = *state.group;
    if (!(state.options.still_below > 0)) return encode_enhanced(state, frame, steps);
    const double units = 1.0 / state.header.lattice.step();
    const auto shifts = bone_shifts(group.reference, state.header.skeleton.bones, frame.pose);
    const auto coded = choose_coded_bones(shifts, fit_of(state, frame), state.options.still_below * units,
                                          state.options.animation_error * units);
    if (std::find(coded.begin(), coded.end(), true) == coded.end()) return encode_predicted(state, frame);
    bool something = false, everything = true;
    for (std::size_t bone = 0; bone < coded.size(); ++bone) {
        const bool bare = group.reference.sub_meshes.of(bone).empty();
        something = something || (coded[bone] && !bare);
        everything = everything && (coded[bone] || bare);
    }
    if (everything || !something) return encode_enhanced(state, frame, steps);
    return encode_moving(state, frame, steps, coded);
}

bool animation_fits(State& state, FrameUnderWay& frame) {
    const double largest = state.options.animation_error / state.header.lattice.step();
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

Result<FrameCandidate> choose(State& state, FrameUnderWay& frame, const FrameSteps& steps, bool force_intra) {
    const bool due = cannot_refer(state, frame.mesh) || frames_since_intra(state) >= state.options.key_interval;
    if (force_intra || due || is_scene_change(state, frame)) return encode_intra(state, frame, steps);
    switch (state.options.frame_choice) {
        case FrameChoice::motion:
            return choose_by_motion(state, frame, steps);
        case FrameChoice::rate_distortion:
        case FrameChoice::fixed:
            break;
    }
    return encode_what_moves(state, frame, steps);
}

}  // namespace

Result<FrameCandidate> code_frame(State& state, FrameUnderWay& frame, bool force_intra) {
    return choose(state, frame, steps_of(state, state.options.geometry_step, state.options.colour_step), force_intra);
}

}  // namespace htvm
