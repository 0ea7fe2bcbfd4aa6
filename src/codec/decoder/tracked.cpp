// Decodes T-frames: the I-frame's mesh, moved by the nodes of a deformation graph and displaced. In groups, a packet
// may bring several of them, one of which is shown.
#include <string>
#include <utility>

#include "codec/decoder/frame_decoders.h"
#include "codec/format/frame_kinds.h"

namespace htvm::internal {
namespace {

// The I-frame's joints, each moved like the node nearest to it.
Pose tracked_pose(const DecoderState& state, std::span<const QuantisedTransform> transforms) {
    const auto& reference = state.reference->skinned;
    const auto& pivots = state.reference->by_nodes->graph.pivots;
    const auto& bones = state.header->skeleton.bones;
    std::vector<std::size_t> node_of_joint;
    Pose pose;
    for (const auto joint : reference.joints) {
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < pivots.size(); ++i)
            if (squared_distance(joint, pivots[i]) < squared_distance(joint, pivots[nearest])) nearest = i;
        node_of_joint.push_back(nearest);
        const auto moved = pivots.empty() ? joint
                                          : move(joint, rotation_matrix(transforms[nearest].rotation), pivots[nearest],
                                                 transforms[nearest].shift);
        pose.joints.push_back(to_millimetres(moved, state.header->lattice));
    }
    for (std::size_t i = 0; i < bones.size(); ++i) {
        const auto rest = to_rotation(rotation_matrix(reference.orientations[i]));
        const auto node = node_of_joint[bones[i].first];
        pose.orientations.push_back(
            pivots.empty() ? rest : product(to_rotation(rotation_matrix(transforms[node].rotation)), rest));
    }
    return pose;
}

void show_tracked(DecoderState& state, const DecodedTrackedFrame& frame, Pose pose) {
    const auto& mesh = state.reference->mesh();
    show(state,
         {frame.positions, mesh.triangles, frame.colours, frame.normals, mesh.texcoords, &state.reference->textured,
          frame.state.presence, &state.reference->detail,
          state.reference->projection ? &frame.state.head.projection : nullptr},
         state.reference_topology, std::move(pose));
}

// Shows a frame that is decoded, and remembers it to be shown again. Throws only std::bad_alloc.
void show_newest(DecoderState& state, const DecodedTrackedFrame& frame) {
    auto& history = state.nodes;
    auto pose = tracked_pose(state, frame.state.transforms);
    show_tracked(state, frame, pose);
    history.pose = std::move(pose);
    history.newest = &frame;
}

// Whether the packet refers to the last T-frame. An error if it does not refer to the reference either.
Result<bool> refers_to_last(const DecoderState& state, const Packet& packet) {
    const auto& last = state.nodes.frame;
    if (last && *last == packet.reference) return true;
    if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    return false;
}

// layers: of the payload, in streams before tracked_run_version; else run: all of it.
Result<void> decode_single(DecoderState& state, const Packet& packet, const FramePayloadView& layers,
                           std::span<const std::uint8_t> run) {
    auto& history = state.nodes;
    const auto of_last = refers_to_last(state, packet);
    if (!of_last) return tl::unexpected(of_last.error());
    if (auto ok = derive_nodes(*state.reference, *state.header, state.threads); !ok) return tl::unexpected(ok.error());
    if (history.newest == &history.next)
        history.newest = history.frame ? &history.last : nullptr;  // it is written over
    const auto& reference = *state.reference->by_nodes;
    const auto* before = *of_last ? &history.last.state : nullptr;
    if (auto ok = state.header->version >= tracked_run_version
                      ? decode_tracked_frame(run, reference, before, state.threads, history.next)
                      : decode_tracked_layers(layers, reference, before, state.threads, history.next);
        !ok)
        return tl::unexpected(ok.error());
    show_newest(state, history.next);
    history.shares = history.next.shares;
    if (!is_referred(packet, rules_of(FrameType::tracked))) return {};
    std::swap(history.last, history.next);
    history.newest = &history.last;
    history.frame = packet.frame;
    history.group = {};
    return {};
}

// ---- Groups ---------------------------------------------------------------------------------------------------------

// The frames that a packet brings. known: those of the group that were there before, by number, 0 for what is before
// it; null where that is the reference.
template <class Known>
Result<std::vector<DecodedTrackedFrame>> decode_brought(const NodeReference& reference, const GroupPayload& payload,
                                                        const Known& known, Threads threads) {
    const auto brought = brought_by(payload.place.frame, payload.place.length);
    std::vector<DecodedTrackedFrame> out(brought.size());
    const auto state_of = [&](std::size_t frame) {
        for (std::size_t i = 0; i < brought.size(); ++i)
            if (frame > 0 && brought[i].frame == frame) return &std::as_const(out[i]).state;
        const DecodedTrackedFrame* there = known(frame);
        return there ? &there->state : nullptr;
    };
    for (std::size_t i = 0; i < brought.size(); ++i) {
        const auto& frame = brought[i];
        std::optional<TrackedState> between;
        if (frame.later > 0)
            between = state_between(
                reference, {state_of(frame.earlier), state_of(frame.later), &state_of(frame.above)->head}, frame);
        if (auto ok =
                decode_tracked_frame(payload.frames[i], reference, between ? &*between : state_of(0), threads, out[i]);
            !ok)
            return tl::unexpected(ok.error());
    }
    return out;
}

const DecodedTrackedFrame& frame_of_group(const DecodedNodes& nodes, std::size_t frame) {
    return frame == nodes.group.length ? nodes.last : nodes.group.between[frame - 1];
}

// The frames are the group's from here on. Nothing can fail.
void keep_brought(DecodedNodes& nodes, const GroupPlace& place, std::vector<DecodedTrackedFrame> frames) {
    const auto brought = brought_by(place.frame, place.length);
    nodes.shares = {};
    for (std::size_t i = 0; i < frames.size(); ++i) {
        nodes.shares += frames[i].shares;
        const auto frame = brought[i].frame;
        if (frame == place.length) {
            nodes.last = std::move(frames[i]);
            continue;
        }
        nodes.group.between[frame - 1] = std::move(frames[i]);
        nodes.group.is_there[frame] = true;
    }
}

Result<void> begin_group(DecoderState& state, const Packet& packet, const GroupPayload& payload) {
    auto& history = state.nodes;
    const auto of_last = refers_to_last(state, packet);
    if (!of_last) return tl::unexpected(of_last.error());
    if (!is_referred(packet, rules_of(FrameType::tracked)))
        return fail(ErrorKind::corrupt_stream, "a group of tracked frames that nothing may refer to");
    if (auto ok = derive_nodes(*state.reference, *state.header, state.threads); !ok) return tl::unexpected(ok.error());
    auto brought = decode_brought(
        *state.reference->by_nodes, payload, [&](std::size_t) { return *of_last ? &history.last : nullptr; },
        state.threads);
    if (!brought) return tl::unexpected(brought.error());
    DecodedGroup group;
    group.first = packet.frame;
    group.length = payload.place.length;
    group.of_reference = !*of_last;
    group.between.resize(group.length - 1);
    history.newest = nullptr;
    if (*of_last) group.earlier = std::move(history.last);
    history.group = std::move(group);
    history.frame = packet.frame;
    keep_brought(history, payload.place, std::move(*brought));
    show_newest(state, frame_of_group(history, 1));
    return {};
}

Result<void> continue_group(DecoderState& state, const Packet& packet, const GroupPayload& payload) {
    auto& history = state.nodes;
    const auto& group = history.group;
    const auto frame = payload.place.frame, length = payload.place.length;
    const auto needed = needed_by(frame, length);
    const bool goes_on = group.length == length && std::uint64_t{group.first} + frame - 1 == packet.frame &&
                         packet.reference == group.first + needed - 1 && group.is_there[needed];
    if (!goes_on)
        return fail(ErrorKind::corrupt_stream, "frame " + std::to_string(packet.frame) +
                                                   ", one of a group, refers to frame " +
                                                   std::to_string(packet.reference) + ", which is not there");
    auto brought = decode_brought(
        *state.reference->by_nodes, payload,
        [&](std::size_t known) -> const DecodedTrackedFrame* {
            if (known > 0) return &frame_of_group(history, known);
            return group.of_reference ? nullptr : &group.earlier;
        },
        state.threads);
    if (!brought) return tl::unexpected(brought.error());
    history.newest = nullptr;
    keep_brought(history, payload.place, std::move(*brought));
    show_newest(state, frame_of_group(history, frame));
    return {};
}

}  // namespace

Result<void> decode_tracked(DecoderState& state, const Packet& packet, const FramePayloadView& layers) {
    if (state.header->node_spacing == 0)
        return fail(ErrorKind::corrupt_stream, "a tracked frame in a stream whose header says that it has none");
    if (state.header->version < grouped_version) return decode_single(state, packet, layers, packet.payload);
    const auto payload = read_group_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    if (payload->place.length == 1) return decode_single(state, packet, layers, payload->frames[0]);
    return payload->place.frame == 1 ? begin_group(state, packet, *payload) : continue_group(state, packet, *payload);
}

bool show_last_tracked(DecoderState& state) {
    const auto& history = state.nodes;
    if (!history.newest) return false;
    show_tracked(state, *history.newest, history.pose);
    return true;
}

bool show_hidden(DecoderState& state, std::uint32_t frame) {
    const auto& group = state.nodes.group;
    if (frame < group.first || frame - group.first >= group.length) return false;
    const std::size_t in_group = frame - group.first + 1;
    if (in_group < group.length && !group.is_there[in_group]) return false;
    show_newest(state, frame_of_group(state.nodes, in_group));
    return true;
}

}  // namespace htvm::internal
