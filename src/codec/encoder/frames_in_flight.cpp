#include "codec/encoder/frames_in_flight.h"

#include <utility>

#include "codec/encoder/frame_coders.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

// What is taken for granted of the frame that is coded: that it becomes a T-frame, or an EP- or P-frame, whose nodes or
// bones move so, and an EP-frame that leaves these codebooks. What is missing is not known before it is coded.
struct Assumed {
    std::optional<NodeRegistration> nodes;
    std::optional<std::vector<RigidMotion>> bones;
    std::optional<Codebooks> codebooks;
    FrameSteps steps;  // with codebooks
};

Assumed assume(FrameWork& work, bool force_intra, const std::optional<FrameSteps>& enhanced_steps) {
    Assumed out;
    if (work.configuration.tracked()) {
        if (work.can_refer()) out.nodes = work.registered_nodes();
    } else if (!force_intra && !work.intra_is_due() && work.sequence.next_frame >= work.sequence.trial.next) {
        out.bones = work.bone_motion().motion;
        if (!enhanced_steps) return out;
        if (!work.quantised) work.quantised = quantise_whole(work, *enhanced_steps);
        out.codebooks = work.quantised->frame.codebooks;
        out.steps = *enhanced_steps;
    }
    return out;
}

// bones: their motion in the frame before this one, or null.
void begin_work(const FrameWork& before, const std::vector<RigidMotion>* bones, PushedFrame& frame,
                std::vector<StageTime>& stages) {
    const auto& configuration = before.configuration;
    auto& ahead = frame.ahead;
    if (configuration.tracked()) {
        if (!ahead.surface) ahead.surface = surface_of(configuration, frame.mesh, frame.colours, stages);
    } else if (bones && !ahead.bone_motion && can_be_moved(configuration, before.sequence, frame.mesh)) {
        ahead.bone_motion = motion_of_bones(configuration, before.reference(), frame.mesh, frame.pose, *bones, stages);
    }
}

// Not finished once the frame before it is found lost.
void go_on_with_work(const FrameWork& before, const Assumed& assumed, PushedFrame& frame,
                     std::vector<StageTime>& stages) {
    const auto& configuration = before.configuration;
    auto& ahead = frame.ahead;
    begin_work(before, assumed.bones ? &*assumed.bones : nullptr, frame, stages);
    if (assumed.nodes && !before.lost && can_be_moved(configuration, before.sequence, frame.mesh))
        ahead.registered = register_frame(configuration, before.reference(), *ahead.surface, frame.pose,
                                          {assumed.nodes->motion, before.sequence.nodes.last, {}, {}},
                                          tracking_effort(frame.effort), stages, &before.lost);
    if (assumed.codebooks && ahead.bone_motion)
        ahead.quantised = quantise_whole(configuration, before.reference(), frame.mesh, *ahead.bone_motion,
                                         *assumed.codebooks, assumed.steps, stages);
}

// Drops what does not hold for what the frame became.
void keep_what_holds(const FrameWork& work, const Result<Candidate>& chosen, std::vector<PushedFrame>& waiting) {
    const auto is = [&](FrameType type) { return chosen && chosen->type == type; };
    const bool by_bones = is(FrameType::enhanced) || is(FrameType::predicted);
    for (auto& frame : waiting) {
        if (!is(FrameType::tracked) || !work.is_as_first_registered() || work.lost) frame.ahead.registered.reset();
        if (!by_bones) frame.ahead.bone_motion.reset();
        if (!is(FrameType::enhanced)) frame.ahead.quantised.reset();
    }
}

}  // namespace

Result<Candidate> choose_beside(FrameWork& work, bool force_intra, const std::optional<FrameSteps>& enhanced_steps,
                                std::vector<PushedFrame>& waiting, const std::function<Result<Candidate>()>& choose) {
    if (waiting.empty()) return choose();
    const auto assumed = assume(work, force_intra, enhanced_steps);
    auto& next = waiting.front();
    std::optional<Result<Candidate>> chosen;
    std::vector<StageTime> of_next, of_last;
    const auto go_on = [&] { go_on_with_work(work, assumed, next, of_next); };
    const auto& threads = work.configuration.threads;
    if (waiting.size() == 1) {
        parallel_invoke(
            threads, [&] { chosen = choose(); }, go_on);
    } else {
        // From here on each frame's motion is found two frames ahead, since the one before it was.
        if (assumed.bones) begin_work(work, &*assumed.bones, next, of_next);
        std::optional<std::vector<RigidMotion>> bones;
        if (assumed.bones && next.ahead.bone_motion) bones = next.ahead.bone_motion->motion;
        parallel_invoke(
            threads, [&] { chosen = choose(); },
            [&] {
                parallel_invoke(threads, go_on,
                                [&] { begin_work(work, bones ? &*bones : nullptr, waiting.back(), of_last); });
            });
    }
    for (const auto* stages : {&of_next, &of_last})
        work.stages.insert(work.stages.end(), stages->begin(), stages->end());
    keep_what_holds(work, *chosen, waiting);
    return std::move(*chosen);
}

}  // namespace htvm::internal
