// Sequences in which some bones move and others hardly do, for P-frames and motion-based coding.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "codec/enhanced_options.h"
#include "codec/format/frame_payload.h"
#include "codec/test_sequences.h"

namespace htvm::test {

using namespace internal;

// Consecutive frames of the synthetic person as it begins to walk, with all attributes.
inline TestSequence walking(int frames, int vertices, int first = 40) {
    TestSequence out{"walking", synth_skeleton(), {}};
    for (int t = 0; t < frames; ++t) {
        auto frame = synthetic_frame(vertices, first + t);
        auto with_texcoords = frame.mesh;
        give_attributes(with_texcoords, texcoords, static_cast<unsigned>(t));
        frame.mesh.texcoords = std::move(with_texcoords.texcoords);
        out.frames.push_back({std::move(frame.mesh), std::move(frame.pose)});
    }
    return out;
}

// The sequence with a skeleton like six spokes, three of which move by 100 mm per frame.
inline TestSequence with_spokes(TestSequence sequence) {
    sequence.name += ", with spokes";
    auto& skeleton = sequence.skeleton;
    skeleton = {};
    skeleton.joint_names = {"centre"};
    for (int k = 0; k < 6; ++k) {
        skeleton.joint_names.push_back("end " + std::to_string(k));
        skeleton.bones.push_back({0, static_cast<std::uint16_t>(k + 1)});
    }
    for (std::size_t t = 0; t < sequence.frames.size(); ++t) {
        Pose pose;
        pose.joints.push_back({0, 0, 0});
        for (std::size_t k = 0; k < 6; ++k) {
            Vector3d end{0, 0, 0};
            end[k % 3] = k < 3 ? 300 : -300;
            if (k >= 3) end[(k + 1) % 3] += 100.0 * static_cast<double>(t);
            pose.joints.push_back(end);
        }
        sequence.frames[t].pose = std::move(pose);
    }
    return sequence;
}

inline bool is_frame(const Packet& packet) { return frame_type(packet.kind).has_value(); }

// An EP-frame by motion-based coding.
inline bool is_in_part(const Packet& packet) {
    if (packet.kind != PacketKind::enhanced) return false;
    const auto payload = read_frame_payload(packet.payload);
    return payload && payload->has(Layer::coded_bones);
}

inline std::size_t frames_in_part(const CodedSequence& coded) {
    return static_cast<std::size_t>(std::count_if(coded.packets.begin(), coded.packets.end(), is_in_part));
}

inline std::size_t frames_of(const CodedSequence& coded, FrameType type) {
    return static_cast<std::size_t>(std::count_if(coded.infos.begin(), coded.infos.end(),
                                                  [&](const FrameInfo& info) { return info.type == type; }));
}

// Everything that moved less than this is animated, however badly it fits.
inline EncoderOptions motion_based(double still_below, int key_interval = 4) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = key_interval;
    options.topology.still_below = still_below;
    options.topology.animation_error = 0;
    options.topology.scene_changes = false;
    return options;
}

}  // namespace htvm::test
