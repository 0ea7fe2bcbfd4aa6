#include "codec/encoder/bones/bones_strategy.h"

#include <utility>

#include "codec/encoder/bones/bones_coders.h"
#include "core/parallel.h"

namespace htvm::internal {

BonesWork begin_work(const Configuration& configuration, const BonesStrategy& strategy, BonesStrategy::Waiting frame,
                     BonesProgress& progress, std::vector<StageTime>& stages) {
    progress.quantised = std::move(frame.ahead.quantised);
    return {configuration, strategy.sequence, std::move(frame.captured), std::move(frame.ahead.motion), stages};
}

// ---- Frames in flight -----------------------------------------------------------------------------------------------

BonesAssumption assume(const BonesWork& work, BonesProgress& progress) {
    BonesAssumption out;
    if (intra_is_due(work) || work.sequence.next_frame < work.sequence.trial.next) return out;
    out.motion = work.motion->motion;
    const auto steps = enhanced_steps(work.configuration);
    if (!steps) return out;
    if (!progress.quantised) progress.quantised = quantise_whole(work, *steps);
    out.codebooks = progress.quantised->frame.codebooks;
    out.steps = *steps;
    return out;
}

namespace {

// before: the motion of the bones in the frame before this one, or null.
void find_motion(const BonesWork& work, const std::vector<RigidMotion>* before, BonesStrategy::Waiting& frame,
                 std::vector<StageTime>& stages) {
    if (before && !frame.ahead.motion && can_be_moved(work.sequence, frame.captured.mesh))
        frame.ahead.motion = motion_of_bones(work.configuration, work.reference(), frame.captured, *before, stages);
}

void quantise_next(const BonesWork& work, const BonesAssumption& assumed, BonesStrategy::Waiting& next,
                   std::vector<StageTime>& stages) {
    if (assumed.codebooks && next.ahead.motion)
        next.ahead.quantised = quantise_whole(work.configuration, work.reference(), next.captured.mesh,
                                              *next.ahead.motion, *assumed.codebooks, assumed.steps, stages);
}

}  // namespace

void work_ahead(const BonesWork& work, const BonesProgress&, const BonesAssumption& assumed,
                std::span<BonesStrategy::Waiting> waiting, std::vector<StageTime>& stages) {
    auto& next = waiting.front();
    // Each frame's motion is found two frames ahead, once the one before it is.
    find_motion(work, assumed.motion ? &*assumed.motion : nullptr, next, stages);
    const auto* motion_of_next = assumed.motion && next.ahead.motion ? &next.ahead.motion->motion : nullptr;
    std::vector<StageTime> of_last;
    parallel_invoke(
        work.configuration.threads, [&] { quantise_next(work, assumed, next, stages); },
        [&] {
            if (waiting.size() > 1) find_motion(work, motion_of_next, waiting.back(), of_last);
        });
    stages.insert(stages.end(), of_last.begin(), of_last.end());
}

void keep_what_holds(const BonesProgress&, const BonesWork::Frame* chosen, std::span<BonesStrategy::Waiting> waiting) {
    const auto* moved = chosen ? std::get_if<BonesMoved>(chosen) : nullptr;
    for (auto& frame : waiting) {
        if (!moved) frame.ahead.motion.reset();
        if (!moved || moved->frame.type != FrameType::enhanced) frame.ahead.quantised.reset();
    }
}

// ---- The sequence goes on -------------------------------------------------------------------------------------------

namespace {

Result<BonesSequence> after(const BonesWork& work, BonesMoved& moved) {
    const auto& before = work.sequence;
    return BonesSequence{before.next_frame + 1, before.reference, std::move(moved.history),
                         moved.trial.value_or(before.trial)};
}

Result<BonesSequence> after(const BonesWork& work, BonesIntra& intra) {
    const auto& before = work.sequence;
    const auto& configuration = work.configuration;
    const auto trial = intra.trial.value_or(before.trial);
    if (!intra.frame.referred) return BonesSequence{before.next_frame + 1, before.reference, before.history, trial};
    auto decoded =
        make_reference(configuration.header, {before.next_frame, intra.step, intra.frame.captured}, intra.frame.decoded,
                       std::move(intra.pose), {.bones = true, .nodes = false}, configuration.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    auto reference = std::make_shared<BonesReference>();
    reference->decoded = std::move(*decoded);
    reference->steps = intra.steps;
    reference->edge = intra.edge;
    reference->bytes = static_cast<double>(intra.frame.bytes());
    reference->plain = intra.plain;
    reference->search = make_reference_search(reference->decoded.skinned);
    return BonesSequence{before.next_frame + 1, std::move(reference), {}, trial};
}

}  // namespace

Result<BonesSequence> sequence_after(const BonesWork& work, BonesWork::Frame& chosen) {
    return std::visit([&](auto& of_kind) { return after(work, of_kind); }, chosen);
}

Result<BonesHandout> hand_out(const BonesStrategy&, const BonesWork& work, const BonesProgress&,
                              BonesWork::Frame chosen, const FrameCost& cost) {
    BonesHandout out;
    if (auto* moved = std::get_if<BonesMoved>(&chosen))
        out.distance_order_counts = std::move(moved->distance_order_counts);
    out.frames.push_back(outgoing(work.configuration, std::move(coded_frame(chosen)), nullptr, work.sequence.next_frame,
                                  work.captured.timestamp_us, cost));
    return out;
}

void commit(BonesStrategy& strategy, BonesHandout& handout, BonesSequence sequence) {
    strategy.distance_order_counts = std::move(handout.distance_order_counts);
    strategy.sequence = std::move(sequence);
}

}  // namespace htvm::internal
