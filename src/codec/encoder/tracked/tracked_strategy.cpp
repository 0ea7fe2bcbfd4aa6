#include "codec/encoder/tracked/tracked_strategy.h"

#include <iterator>
#include <utility>

#include "codec/encoder/tracked/shared_tracking.h"
#include "core/parallel.h"

namespace htvm::internal {

namespace {

DeformableMesh deformable_of(const Configuration& configuration, const TrackedReference& reference) {
    return make_tracked_deformable(*reference.decoded.by_nodes, reference.decoded.detail,
                                   deformation_options(configuration), reference.origin.colours);
}

// Where there cannot be nodes, nothing can refer to the reference, so that an I-frame follows.
void derive_what_is_left(const Configuration& configuration, TrackedSequence& sequence,
                         std::vector<StageTime>& stages) {
    if (!sequence.to_derive) return;
    StageClock clock(stages);
    auto& [reference, before, before_last, last] = *sequence.to_derive;
    if (derive_nodes(reference->decoded, configuration.header, configuration.threads)) {
        reference->deformable = deformable_of(configuration, *reference);
        if (!before_last.empty())
            sequence.history.gone_on = moved_on(before->deformable, before_last, last, reference->deformable.handles);
    }
    sequence.to_derive.reset();
    clock.done("reference");
}

void find_surface(const Configuration& configuration, TrackedStrategy::Waiting& frame, std::vector<StageTime>& stages) {
    if (!frame.ahead.surface) frame.ahead.surface = surface_of(configuration, frame.captured, stages);
    if (!frame.ahead.vertices) frame.ahead.vertices = vertices_of(frame.captured.mesh);
}

}  // namespace

TrackedWork begin_work(const Configuration& configuration, TrackedStrategy& strategy, TrackedStrategy::Waiting frame,
                       Tracking& tracking, std::vector<StageTime>& stages) {
    derive_what_is_left(configuration, strategy.sequence, stages);
    find_surface(configuration, frame, stages);
    auto& [captured, ahead] = frame;
    tracking.registered = std::move(ahead.registered);
    const auto effort = tracking_effort(captured.effort);
    TrackedWork work{configuration, strategy.sequence,   strategy.sequence.reference.get(),
                     stages,        std::move(captured), effort,
                     ahead.surface, *ahead.surface,      ahead.vertices};
    if (!can_refer(work)) return work;
    const auto& registered = register_once(work, tracking);
    if (configuration.shared && !configuration.follows)
        configuration.shared->add(work.captured.timestamp_us,
                                  shared_step(configuration.header.lattice, work.reference->deformable,
                                              work.sequence.history.last, registered.motion));
    return work;
}

// ---- Frames in flight -----------------------------------------------------------------------------------------------

TrackedAssumption assume(const TrackedWork& work, const Tracking& tracking) {
    TrackedAssumption out;
    if (can_refer(work)) out.nodes = *tracking.registered;
    return out;
}

namespace {

void register_next(const TrackedWork& work, const Tracking& tracking, const TrackedAssumption& assumed,
                   TrackedStrategy::Waiting& next, std::vector<StageTime>& stages) {
    find_surface(work.configuration, next, stages);
    if (work.configuration.follows) return;  // the other encoder has yet to come to that frame
    if (assumed.nodes && !tracking.lost && can_be_moved(work.sequence, next.captured.mesh))
        next.ahead.registered =
            register_frame(work.configuration, *work.reference, *next.ahead.surface, next.captured,
                           {assumed.nodes->motion, work.sequence.history.last, {}, {}, {}}, work.vertices.get(),
                           *next.ahead.vertices, present(work.sequence, true), stages, &tracking.lost);
}

}  // namespace

void work_ahead(const TrackedWork& work, const Tracking& tracking, const TrackedAssumption& assumed,
                std::span<TrackedStrategy::Waiting> waiting, std::vector<StageTime>& stages) {
    std::vector<StageTime> of_last;
    parallel_invoke(
        work.configuration.threads, [&] { register_next(work, tracking, assumed, waiting.front(), stages); },
        [&] {
            if (waiting.size() > 1) find_surface(work.configuration, waiting.back(), of_last);
        });
    stages.insert(stages.end(), of_last.begin(), of_last.end());
}

void keep_what_holds(const Tracking& tracking, const TrackedWork::Frame* chosen,
                     std::span<TrackedStrategy::Waiting> waiting) {
    const bool as_assumed = chosen && std::holds_alternative<TrackedMotion>(*chosen) && tracking.registered &&
                            !tracking.moved_limbs && !tracking.lost;
    if (as_assumed) return;
    for (auto& frame : waiting) frame.ahead.registered.reset();
}

// ---- The sequence goes on -------------------------------------------------------------------------------------------

namespace {

// The reference that this frame becomes. step: Reference::step. kept: what it takes over of the one before. nodes:
// whether what depends on them is derived too, where frames will refer to it.
Result<std::shared_ptr<TrackedReference>> reference_of(const TrackedWork& work, const CodedFrame& frame,
                                                       ReferenceOrigin origin, CodedPose pose, std::int32_t step,
                                                       KeptNodes kept, bool nodes) {
    const auto& configuration = work.configuration;
    // Under rate control a stand-in for a frame that does not fit also refers to the I-frame. A tracked skeleton gives
    // a start for the motion of the nodes.
    const bool referred_to = !configuration.intra_only() || configuration.options.rate.bits_per_second > 0;
    auto decoded =
        make_reference(configuration.header,
                       {work.sequence.next_frame, step, frame.captured, std::move(kept), frame.textured, frame.presence,
                        frame.detail, frame.projection},
                       frame.decoded, std::move(pose),
                       {.bones = referred_to && configuration.header.has_skeleton, .nodes = referred_to && nodes},
                       configuration.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    auto out = std::make_shared<TrackedReference>();
    out->decoded = std::move(*decoded);
    out->origin = std::move(origin);
    if (out->decoded.by_nodes) out->deformable = deformable_of(configuration, *out);
    return out;
}

Result<TrackedSequence> after(const TrackedWork& work, TrackedMotion& motion) {
    return TrackedSequence{
        work.sequence.next_frame + 1, work.sequence.reference, std::move(motion.history), work.vertices, {}};
}

Result<TrackedSequence> after(const TrackedWork& work, TrackedIntra& intra) {
    const auto& before = work.sequence;
    if (!intra.frame.referred)
        return TrackedSequence{before.next_frame + 1, before.reference, before.history, before.captured, {}};
    auto reference =
        reference_of(work, intra.frame, std::move(intra.origin), std::move(intra.pose), intra.step, {}, true);
    if (!reference) return tl::unexpected(reference.error());
    auto& in_use = **reference;
    in_use.intra_frame = before.next_frame;
    in_use.intra_bytes = static_cast<double>(intra.frame.bytes());
    TrackedSequence out;
    out.next_frame = before.next_frame + 1;
    out.history.best_fit = intra.best_fit;
    out.history.targets = on_new_reference(before.history.targets, {}, 0, {});
    out.history.presence = std::move(intra.presence);
    out.history.followed = intra.followed;
    out.captured = work.vertices;
    out.reference = std::move(*reference);
    return out;
}

Result<TrackedSequence> after(const TrackedWork& work, TrackedPatch& patch) {
    const auto& before = *work.reference;
    auto reference = reference_of(work, patch.frame, std::move(patch.origin), std::move(patch.pose), 1,
                                  std::move(patch.kept), false);
    if (!reference) return tl::unexpected(reference.error());
    auto& in_use = **reference;
    in_use.intra_frame = before.intra_frame;
    in_use.intra_bytes = before.intra_bytes;
    in_use.patches = before.patches + 1;
    in_use.patch_bytes = before.patch_bytes + static_cast<double>(patch.frame.bytes());
    TrackedSequence out;
    out.next_frame = work.sequence.next_frame + 1;
    out.history.best_fit = patch.best_fit;
    out.history.targets = std::move(patch.targets);
    out.history.presence = std::move(patch.presence);
    out.history.in_vain = patch.in_vain;
    out.history.followed = patch.followed;
    out.captured = work.vertices;
    out.to_derive = {*reference, work.sequence.reference, std::move(patch.before_last), std::move(patch.last)};
    out.reference = std::move(*reference);
    return out;
}

}  // namespace

Result<TrackedSequence> sequence_after(const TrackedWork& work, TrackedWork::Frame& chosen) {
    return std::visit([&](auto& of_kind) { return after(work, of_kind); }, chosen);
}

// ---- What is sent ---------------------------------------------------------------------------------------------------

namespace {

// Codes these frames as a group. before: null where it is to refer to the reference alone.
Result<void> add_group(const Configuration& configuration, const TrackedReference& reference, const GroupAnchor* before,
                       std::span<const HeldFrame> held, std::vector<StageTime>& stages, TrackedHandout& handout) {
    auto group = code_group(configuration, reference, before, held, stages);
    if (!group) return tl::unexpected(group.error());
    std::ranges::move(group->frames, std::back_inserter(handout.frames));
    handout.anchor = std::move(group->anchor);
    return {};
}

// The held frames, if there are any, as a group of what came before.
Result<void> add_held(const TrackedStrategy& strategy, const Configuration& configuration,
                      std::span<const HeldFrame> held, std::vector<StageTime>& stages, TrackedHandout& handout) {
    if (held.empty()) return {};
    return add_group(configuration, *strategy.sequence.reference, strategy.anchor ? &*strategy.anchor : nullptr, held,
                     stages, handout);
}

// Holds a T-frame, and codes its group once that has all its frames. Where the frame refers to the reference alone, for
// decoding to start there, the group before ends, and it is one by itself.
Result<TrackedHandout> hold(TrackedStrategy& strategy, TrackedWork& work, Tracking& tracking, TrackedMotion& motion) {
    const auto& configuration = work.configuration;
    auto& held = strategy.held;
    const bool place_to_start = motion.frame.access && (strategy.anchor || !held.empty());
    held.push_back({work.sequence.next_frame, work.captured.timestamp_us, std::move(work.captured.mesh),
                    work.kept_surface, std::move(*tracking.registered), motion.steps, std::move(motion.noise),
                    motion.frame.presence, work.captured.projection});
    const std::span<const HeldFrame> all = held;
    TrackedHandout out;
    if (place_to_start) {
        if (auto ok = add_held(strategy, configuration, all.first(all.size() - 1), work.stages, out); !ok)
            return tl::unexpected(ok.error());
        if (auto ok = add_group(configuration, *strategy.sequence.reference, nullptr, all.last(1), work.stages, out);
            !ok)
            return tl::unexpected(ok.error());
    } else if (all.size() == static_cast<std::size_t>(configuration.options.tracked.group)) {
        if (auto ok = add_held(strategy, configuration, all, work.stages, out); !ok) return tl::unexpected(ok.error());
    }
    out.keeps_held = out.frames.empty();
    return out;
}

}  // namespace

Result<TrackedHandout> hand_out(TrackedStrategy& strategy, TrackedWork& work, Tracking& tracking,
                                TrackedWork::Frame chosen, const FrameCost& cost) {
    const auto& configuration = work.configuration;
    if (auto* motion = std::get_if<TrackedMotion>(&chosen); motion && configuration.options.tracked.group > 1)
        return hold(strategy, work, tracking, *motion);
    TrackedHandout out;
    if (auto ok = add_held(strategy, configuration, strategy.held, work.stages, out); !ok)
        return tl::unexpected(ok.error());
    const auto& reference = strategy.sequence.reference;
    out.frames.push_back(outgoing(configuration, std::move(coded_frame(chosen)),
                                  reference ? &reference->decoded : nullptr, strategy.sequence.next_frame,
                                  work.captured.timestamp_us, cost));
    return out;
}

Result<TrackedHandout> hand_out_held(const TrackedStrategy& strategy, const Configuration& configuration,
                                     std::vector<StageTime>& stages) {
    TrackedHandout out;
    if (auto ok = add_held(strategy, configuration, strategy.held, stages, out); !ok) return tl::unexpected(ok.error());
    return out;
}

void commit(TrackedStrategy& strategy, TrackedHandout& handout, TrackedSequence sequence) {
    if (!handout.keeps_held) strategy.held.clear();
    if (handout.anchor) strategy.anchor = std::move(handout.anchor);
    if (sequence.reference != strategy.sequence.reference) strategy.anchor.reset();
    strategy.sequence = std::move(sequence);
}

}  // namespace htvm::internal
