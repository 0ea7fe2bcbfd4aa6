// Presence that no encoder would tell, and streams with it: of any mesh anything is there, in I-, T-, TP- and P-frames,
// in groups and outside them.
#pragma once

#include <utility>
#include <vector>

#include "codec/levels_by_chance.h"
#include "codec/patches_by_chance.h"
#include "codec/tracked/frame_group.h"
#include "codec/tracked/presence.h"

namespace htvm::test {

inline Presence presence_by_chance(Removal gone, std::span<const LatticePoint> positions, std::mt19937& random) {
    Presence out;
    for (const bool is_gone : removed_by_chance(gone, positions, random)) out.push_back(is_gone ? 0 : 1);
    return out;
}

// A third of what is beside the border changes.
inline Presence changed_by_chance(const Presence& before, const VerticesAround& around, std::mt19937& random) {
    auto out = before;
    for (std::size_t v = 0; v < before.size(); ++v)
        for (const auto u : around.of(v))
            if (before[u] != before[v] && below(random, 3) == 0) out[v] = before[u];
    return out;
}

// Writes a stream frame by frame, as a decoder would have it.
class PresenceStreamByChance {
public:
    PresenceStreamByChance(const Packet& header, std::int32_t node_spacing, const ChanceMotion& motion, unsigned seed)
        : motion_(motion), random_(seed) {
        auto first = *read_sequence_header(header.payload);
        first.version = presence_version;
        Packet packet = header;
        packet.payload = write_sequence_header(first);
        out_.add_header(packet, node_spacing);
    }

    // The mesh of an I-frame, without the texture coordinates that a patched mesh cannot have. settled: as an I-frame
    // that renews a tracked mesh. told: without it the frame has no layer of presence.
    void add_intra(const Packet& intra, Removal gone, bool told = true, bool settled = false) {
        model_ = intra;
        auto payload = copy_of(*read_frame_payload(intra.payload));
        auto mesh = coded_mesh(view_of(payload));
        if (payload.header.intra_coder != intra_coder_levels)
            smooth_as_shown(mesh, static_cast<std::int32_t>(payload.header.geometry_step), settled, out_.header);
        Presence presence;
        if (told) {
            presence = presence_by_chance(gone, mesh.positions, random_);
            payload.set(Layer::presence, write_presence_layer(mesh.triangles, presence));
        }
        pose_ = payload.of(Layer::pose);
        add(PacketKind::intra, write_frame_payload(payload), out_.frame);
        if (settled) out_.packets.back().flags |= packet_flag::of_tracked_mesh;
        refer_to({.number = out_.frame - 1, .captured = captured_of(payload), .presence = std::move(presence)},
                 std::move(mesh));
    }
    // An I-frame that nothing refers to, whose layer of presence does not count.
    void add_unreferred_intra(const Packet& intra) {
        auto payload = copy_of(*read_frame_payload(intra.payload));
        payload.set(Layer::presence, {1, 2, 3});
        add(PacketKind::intra, write_frame_payload(payload), out_.frame, false);
    }
    void add_tracked(bool from_last, const Presence& presence) {
        const auto reference = from_last ? last_number_ : reference_.number;
        auto frame = tracked(from_last ? &last_ : nullptr, presence);
        add(PacketKind::tracked, write_group_payload({}, std::span(&frame.first, 1)), reference);
        last_ = std::move(frame.second.state);
        last_number_ = out_.frame - 1;
    }
    // The surface comes and goes from frame to frame; the last one is as what is before the group.
    void add_group(std::size_t length, bool from_last) {
        std::vector<std::optional<TrackedState>> states(length + 1);
        if (from_last) states[0] = last_;
        const auto first = out_.frame, before = from_last ? last_number_ : reference_.number;
        const auto state_of = [&](std::size_t frame) { return states[frame] ? &*states[frame] : nullptr; };
        for (std::size_t frame = 1; frame <= length; ++frame) {
            std::vector<std::vector<std::uint8_t>> payloads;
            for (const auto& brought : brought_by(frame, length)) {
                std::optional<TrackedState> between;
                if (brought.later > 0)
                    between = state_between(
                        by_nodes(), {state_of(brought.earlier), state_of(brought.later), &states[brought.above]->head},
                        brought);
                auto coded = tracked(between ? &*between : state_of(0),
                                     brought.later > 0 ? any_change() : last_presence(from_last));
                payloads.push_back(std::move(coded.first));
                states[brought.frame] = std::move(coded.second.state);
            }
            const auto needed = static_cast<std::uint32_t>(needed_by(frame, length));
            add(PacketKind::tracked, write_group_payload({length, frame}, payloads),
                needed == 0 ? before : first + needed - 1, is_needed(frame, length));
        }
        last_ = std::move(*states[length]);
        last_number_ = first;
    }
    void add_patched(Removal removal, Removal gone) {
        FramePayload payload;
        payload.set(Layer::pose, pose_);
        const auto& reference = by_nodes();
        auto coded = tracked(nullptr, presence_by_chance(gone, reference.mesh.positions, random_));
        payload.set(Layer::tracked, std::move(coded.first));
        const TrackedSurface surface{coded.second.positions, reference.mesh.triangles, coded.second.colours};
        const PatchSteps steps{between(random_, 1, 40), between(random_, 1, 40)};
        const auto patch = patch_by_chance(surface, removal, 30, steps.geometry, random_);
        auto patched = *encode_patch(surface, reference.hierarchy, patch, steps, payload);
        payload.header.source_vertices = below(random_, 70000);
        payload.header.source_triangles = below(random_, 140000);
        smooth_what_is_new(patched, steps.geometry, !reference.mesh.normals.empty());
        add(PacketKind::patched, write_frame_payload(payload), reference_.number);
        auto presence = presence_of_patched(coded.second.state.presence, patched.stays, patched.mesh.positions.size());
        refer_to({.number = out_.frame - 1,
                  .captured = captured_of(payload),
                  .kept = keep_nodes(reference.nodes, patched.stays),
                  .presence = std::move(presence)},
                 std::move(patched.mesh));
    }
    void add_predicted() {
        FramePayload payload;
        payload.header.vertices = static_cast<std::uint32_t>(by_nodes().mesh.positions.size());
        payload.header.triangles = static_cast<std::uint32_t>(by_nodes().mesh.triangles.size());
        std::vector<QuantisedTransform> transforms(out_.header.skeleton.bones.size());
        for (auto& transform : transforms) transform.shift = {between(random_, -90, 90), 7, 0};
        payload.set(Layer::transforms, encode_transforms(transforms));
        add(PacketKind::predicted, write_frame_payload(payload), reference_.number, false);
    }

    // What the last T-frame has, or else the reference.
    Presence last_presence(bool from_last) const {
        const auto& presence = from_last ? last_.presence : by_nodes().presence;
        return presence.empty() ? Presence(by_nodes().mesh.positions.size(), 1) : presence;
    }
    // Another hole; or the borders of what the reference has, moved.
    Presence any_change() {
        const auto presence = last_presence(false);
        if (!anything_absent(presence) || below(random_, 2) == 0)
            return presence_by_chance(Removal::region, by_nodes().mesh.positions, random_);
        return changed_by_chance(presence, by_nodes().around, random_);
    }
    const std::vector<Packet>& packets() const { return out_.packets; }

private:
    const NodeReference& by_nodes() const { return *reference_.by_nodes; }
    static CapturedCounts captured_of(const FramePayload& payload) {
        return {payload.header.source_vertices, payload.header.source_triangles};
    }
    void add(PacketKind kind, std::vector<std::uint8_t> payload, std::uint32_t reference, bool referred = true) {
        Packet packet = model_;
        packet.kind = kind;
        packet.payload = std::move(payload);
        out_.add(std::move(packet), reference);
        if (!referred) out_.packets.back().flags = packet_flag::flags_valid | packet_flag::droppable;
    }
    void refer_to(ReferenceFacts facts, LatticeMesh mesh) {
        const auto& skeleton = out_.header.skeleton;
        auto pose = *decode_pose(pose_, skeleton.joint_names.size(), skeleton.bones.size());
        reference_ = *make_reference(out_.header, std::move(facts), std::move(mesh), std::move(pose),
                                     {.bones = false, .nodes = true}, {});
    }
    // The payload of one frame, and what decoders make of it.
    std::pair<std::vector<std::uint8_t>, DecodedTrackedFrame> tracked(const TrackedState* before,
                                                                      const Presence& presence) {
        std::pair<std::vector<std::uint8_t>, DecodedTrackedFrame> out;
        out.first = tracked_by_chance(by_nodes(), before, motion_, random_, presence);
        EXPECT_TRUE(decode_tracked_frame(out.first, by_nodes(), before, {}, out.second).has_value());
        EXPECT_EQ(out.second.state.presence, presence);
        return out;
    }

    StreamByChance out_;
    ChanceMotion motion_;
    std::mt19937 random_;
    Packet model_;
    std::vector<std::uint8_t> pose_;
    Reference reference_;
    TrackedState last_;
    std::uint32_t last_number_ = 0;
};

// I-frames, and behind each what may follow it.
inline std::vector<Packet> with_presence(const std::vector<Packet>& intra, std::int32_t node_spacing,
                                         const ChanceMotion& motion, unsigned seed) {
    PresenceStreamByChance out(intra[0], node_spacing, motion, seed);
    std::size_t meshes = 0;
    for (const auto& packet : intra) {
        if (packet.kind != PacketKind::intra) continue;
        const auto gone = removals[(meshes + 3) % 4];
        out.add_intra(packet, gone, meshes % 3 != 2);
        out.add_tracked(false, out.last_presence(false));  // nothing changes
        out.add_tracked(true, out.any_change());
        out.add_tracked(true, out.any_change());
        out.add_tracked(false, out.any_change());  // decoding can start here
        if (meshes == 0) out.add_unreferred_intra(packet);
        if (meshes < 2) out.add_predicted();
        out.add_group(5, true);
        out.add_group(2, false);
        out.add_patched(removals[(meshes + 2) % 4], Removal::region);
        out.add_group(3, false);
        out.add_tracked(true, out.any_change());
        out.add_patched(Removal::region, Removal::some);
        out.add_tracked(false, out.any_change());
        if (meshes < 2) out.add_intra(packet, Removal::region, true, true);  // renews the tracked mesh
        if (meshes < 2) out.add_tracked(false, out.any_change());
        ++meshes;
    }
    return out.packets();
}

}  // namespace htvm::test
