// T-frames in groups: which packet brings which frame, that each can be shown when its packet comes, and what lost ones
// cost.
#include "codec/tracked/frame_group.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "codec/format/sequence.h"
#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/dependency.hpp"
#include "htvm/option_list.hpp"

namespace htvm::internal {
namespace {

using namespace test;

std::vector<std::size_t> numbers(const std::vector<GroupFrame>& frames) {
    std::vector<std::size_t> out;
    for (const auto& frame : frames) out.push_back(frame.frame);
    return out;
}

// A person who hardly moves, re-meshed in every frame, without noise.
const TestSequence& calm_person() {
    static const auto made = [] {
        TestSequence out{"calm", {}, {}};
        SynthOptions options;
        options.motion = SynthMotion::calm;
        options.vertices = 1200;
        options.surface_noise_power = 0;
        for (int t = 0; t < 14; ++t) out.frames.push_back({synth_frame(options, t).mesh, {}});
        return out;
    }();
    return made;
}

EncoderOptions in_groups(int group) {
    auto out = default_options(Profile::tracked);
    out.tracked.group = group;
    return out;
}

// Header, I-frame, and T-frames: a group of eight and one of five.
const CodedSequence& grouped() {
    static const auto coded = encode(calm_person(), in_groups(8));
    return coded;
}

std::vector<Packet> frames_of(const std::vector<Packet>& packets) {
    std::vector<Packet> out;
    std::copy_if(packets.begin(), packets.end(), std::back_inserter(out), is_frame);
    return out;
}

std::vector<Packet> without_frames(std::vector<Packet> packets, const std::set<std::uint32_t>& lost) {
    std::erase_if(packets, [&](const Packet& packet) { return is_frame(packet) && lost.contains(packet.frame); });
    return packets;
}

std::set<std::uint32_t> shown(const std::vector<Packet>& packets) {
    std::set<std::uint32_t> out;
    for (const auto& frame : decode_packets(packets).frames) out.insert(frame.info.frame);
    return out;
}

// ---- Which packet brings what ---------------------------------------------------------------------------------------

TEST(FrameGroup, TheLastFrameComesFirstThenTheMiddleOfEachHalf) {
    EXPECT_EQ(numbers(path_to(1, 8)), (std::vector<std::size_t>{8, 4, 2, 1}));
    EXPECT_EQ(numbers(path_to(7, 8)), (std::vector<std::size_t>{8, 4, 6, 7}));
    EXPECT_EQ(numbers(path_to(8, 8)), (std::vector<std::size_t>{8}));
    EXPECT_EQ(numbers(path_to(1, 1)), (std::vector<std::size_t>{1}));
}

TEST(FrameGroup, AFrameIsPredictedFromThoseAroundItThatCameBefore) {
    for (std::size_t length = 1; length <= most_in_group; ++length)
        for (std::size_t frame = 1; frame <= length; ++frame) {
            std::set<std::size_t> there = {0};
            std::size_t level = 0;
            for (const auto& step : path_to(frame, length)) {
                EXPECT_EQ(step.level, level++);
                if (step.later > 0) {
                    EXPECT_LT(step.earlier, step.frame);
                    EXPECT_GT(step.later, step.frame);
                    EXPECT_TRUE(there.contains(step.earlier) && there.contains(step.later));
                    EXPECT_TRUE(step.above == step.earlier || step.above == step.later);
                }
                there.insert(step.frame);
            }
        }
}

TEST(FrameGroup, EachFrameIsBroughtOnceAndNoLaterThanByItsOwnPacket) {
    for (std::size_t length = 1; length <= most_in_group; ++length) {
        std::set<std::size_t> there;
        for (std::size_t packet = 1; packet <= length; ++packet) {
            for (const auto& frame : brought_by(packet, length)) {
                EXPECT_TRUE(there.insert(frame.frame).second) << "frame " << frame.frame << " of " << length;
                EXPECT_GE(frame.frame, packet);
            }
            EXPECT_TRUE(there.contains(packet)) << "frame " << packet << " of " << length;
        }
    }
}

TEST(FrameGroup, ThePacketThatOneRefersToLeadsToAllThatItNeeds) {
    for (std::size_t length = 1; length <= most_in_group; ++length)
        for (std::size_t frame = 1; frame <= length; ++frame) {
            std::set<std::size_t> there;
            for (std::size_t packet = frame; packet > 0; packet = needed_by(packet, length)) {
                EXPECT_LT(needed_by(packet, length), packet);
                for (const auto& brought : brought_by(packet, length)) there.insert(brought.frame);
                EXPECT_TRUE(packet == frame || is_needed(packet, length));
            }
            for (const auto& needed : path_to(frame, length)) EXPECT_TRUE(there.contains(needed.frame));
        }
}

// ---- The payload ----------------------------------------------------------------------------------------------------

TEST(GroupPayload, ComesBack) {
    const std::vector<std::vector<std::uint8_t>> frames = {{1, 2, 3}, {}, std::vector<std::uint8_t>(300, 7), {9}};
    const auto bytes = write_group_payload({8, 1}, frames);
    const auto payload = read_group_payload(bytes);
    ASSERT_TRUE(payload.has_value());
    EXPECT_EQ(payload->place.length, 8u);
    EXPECT_EQ(payload->place.frame, 1u);
    ASSERT_EQ(payload->frames.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_TRUE(
            std::equal(frames[i].begin(), frames[i].end(), payload->frames[i].begin(), payload->frames[i].end()));
    EXPECT_EQ(write_group_payload({8, 2}, {}).size(), 1u);
}

TEST(GroupPayload, WhatCannotBeIsAnError) {
    const auto message = [](const std::vector<std::uint8_t>& bytes) {
        const auto payload = read_group_payload(bytes);
        return payload ? std::string() : payload.error().message;
    };
    EXPECT_EQ(message({}), "tracked frame: it does not say which of its group it is");
    EXPECT_EQ(message({2 | 3 << 3, 0}), "tracked frame: it is said to be frame 4 of a group of 3");
    EXPECT_EQ(message({0x40}), "tracked frame: it is said to be frame 9 of a group of 1");
    EXPECT_EQ(message({1, 0x80}), "tracked frame: the sizes of the hidden frames are cut short");
    EXPECT_EQ(message({1, 3, 1, 2}), "tracked frame: a hidden frame is longer than the packet");
    EXPECT_EQ(message({1 | 1 << 3, 0}), "tracked frame: it brings a frame that an earlier packet of its group brought");
}

// ---- Between two frames ---------------------------------------------------------------------------------------------

TEST(FrameGroup, WhatStandsBetweenIsTheMeanWeightedByTime) {
    const NodeReference reference;
    TrackedState later;
    later.transforms.resize(1);
    later.transforms[0].shift = {400, -400, 3};
    later.displacement.planes.resize(1);
    later.displacement.planes[0].mean = {{-800, 5}};
    later.displacement.planes[0].magnitude = {{3}};
    later.head.displacement.step[0] = 1000;
    const auto at = [&](std::size_t frame, std::size_t of, const TrackedState* earlier) {
        return state_between(reference, {earlier, &later, &later.head}, {frame, 0, of, of, 1});
    };
    const auto middle = at(2, 4, nullptr);
    EXPECT_EQ(middle.transforms[0].shift, (LatticePoint{200, -200, 2}));
    EXPECT_EQ(middle.displacement.planes[0].mean[0], (std::vector<std::int32_t>{-400, 3}));
    EXPECT_EQ(middle.displacement.planes[0].magnitude[0], (std::vector<std::uint8_t>{2}));
    EXPECT_EQ(middle.head.displacement.step[0], 1200u);
    EXPECT_EQ(at(1, 4, nullptr).transforms[0].shift.x, 100);
    EXPECT_EQ(at(1, 3, nullptr).transforms[0].shift, (LatticePoint{133, -133, 1}));
    EXPECT_EQ(at(1, 4, &later).transforms[0].shift.x, 400);
}

// ---- Streams --------------------------------------------------------------------------------------------------------

TEST(GroupedStream, HasAPacketForEachFrameInTheOrderOfShowing) {
    ASSERT_TRUE(grouped().errors.empty());
    const auto frames = frames_of(grouped().packets);
    ASSERT_EQ(frames.size(), calm_person().frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].frame, i);
    EXPECT_EQ(frames[2].payload.size(), 1u);  // the first packet of its group brought it
    EXPECT_GT(frames[1].payload.size(), frames[5].payload.size());
}

TEST(GroupedStream, DecodesToWhatTheEncoderPromised) {
    const auto decoded = decode_packets(grouped().packets);
    for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
    ASSERT_EQ(decoded.frames.size(), grouped().reconstructions.size());
    for (std::size_t i = 0; i < decoded.frames.size(); ++i) {
        const auto &now = decoded.frames[i].info, &then = grouped().infos[i];
        expect_same_mesh(decoded.frames[i].mesh, grouped().reconstructions[i]);
        EXPECT_EQ(now.frame, i);
        EXPECT_EQ(now.group, then.group);
        EXPECT_EQ(now.place, then.place);
        EXPECT_EQ(now.source_vertices, then.source_vertices);
        EXPECT_EQ(now.bytes.of_layer, then.bytes.of_layer);
    }
    EXPECT_EQ(grouped().infos[1].group, 8);
    EXPECT_EQ(grouped().infos[13].group, 5);
    EXPECT_EQ(grouped().infos[13].place, 5);
}

TEST(GroupedStream, IsSmallerThanOneWithoutGroups) {
    const auto alone = encode(calm_person(), in_groups(1));
    const auto bytes_of_tracked = [](const CodedSequence& coded) {
        std::size_t out = 0;
        for (const auto& info : coded.infos)
            if (info.type == FrameType::tracked) out += info.bytes.total();
        return out;
    };
    EXPECT_LT(1.1 * static_cast<double>(bytes_of_tracked(grouped())), static_cast<double>(bytes_of_tracked(alone)));
}

TEST(GroupedStream, SaysVersionFiveAndOthersFour) {
    EXPECT_EQ(read_sequence_header(grouped().packets[0].payload)->version, grouped_version);
    TestSequence two = calm_person();
    two.frames.resize(2);
    EXPECT_EQ(read_sequence_header(encode(two, in_groups(1)).packets[0].payload)->version, stream_version);
}

TEST(GroupedStream, IsTheSameForAnyNumberOfThreads) {
    for (const unsigned threads : {1u, 2u}) {
        auto options = in_groups(8);
        options.threads = threads;
        EXPECT_EQ(encode(calm_person(), options).bytes, grouped().bytes) << threads;
    }
}

TEST(GroupedStream, TheEncoderHoldsFramesUntilTheirGroupIsWhole) {
    auto encoder = Encoder::create(in_groups(3));
    ASSERT_TRUE(encoder.has_value());
    std::vector<std::size_t> held, coded;
    for (int t = 0; t < 6; ++t) {
        ASSERT_TRUE(encoder->push(calm_person().frames[static_cast<std::size_t>(t)].mesh, nullptr, t));
        held.push_back(encoder->held_frames());
        coded.push_back(encoder->coded_frames().size());
    }
    EXPECT_EQ(held, (std::vector<std::size_t>{0, 1, 2, 0, 1, 2}));
    EXPECT_EQ(coded, (std::vector<std::size_t>{1, 0, 0, 3, 0, 0}));
    EXPECT_EQ(encoder->last_frame().frame, 3u);
    ASSERT_TRUE(encoder->finish());
    EXPECT_EQ(encoder->held_frames(), 0u);
    EXPECT_EQ(encoder->coded_frames().size(), 2u);
    EXPECT_EQ(encoder->last_frame().frame, 5u);
}

TEST(GroupedStream, GroupsEndBeforeFramesOfOtherKinds) {
    auto patched = patched_options();
    patched.tracked.group = 8;
    const auto lost = encode(horned_ball(7, 3), patched);
    ASSERT_TRUE(lost.errors.empty());
    ASSERT_NE(lost.infos[3].type, FrameType::tracked);
    EXPECT_EQ(lost.infos[1].group, 2);
    EXPECT_EQ(lost.infos[4].group, 3);
    auto options = in_groups(8);
    options.key_interval = 4;
    const auto renewed = encode(horned_ball(7, never), options);
    ASSERT_EQ(renewed.infos[4].type, FrameType::intra);
    EXPECT_EQ(renewed.infos[1].group, 3);
    for (const auto* coded : {&lost, &renewed}) {
        const auto decoded = decode_packets(coded->packets);
        for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
        ASSERT_EQ(decoded.frames.size(), 7u);
        for (std::size_t i = 0; i < 7; ++i) expect_same_mesh(decoded.frames[i].mesh, coded->reconstructions[i]);
    }
}

TEST(GroupedStream, AFrameWithoutASurfaceEndsTheGroupAndTheNextGoesOn) {
    auto gap = horned_ball(7, never);
    gap.frames[3].mesh = {};
    const auto coded = encode(gap, in_groups(8));
    ASSERT_TRUE(coded.errors.empty());
    EXPECT_EQ(coded.infos[1].group, 2);
    EXPECT_EQ(coded.infos[4].group, 3);
    EXPECT_EQ(coded.infos[4].reference, 1u);  // the packet that brought the last T-frame
    EXPECT_EQ(shown(coded.packets).size(), 7u);
}

TEST(GroupedStream, APlaceToStartIsAGroupByItself) {
    auto options = in_groups(4);
    options.tracked.access_interval = 6;
    const auto coded = encode(horned_ball(12, never), options);
    const auto frames = frames_of(coded.packets);
    std::vector<int> groups;
    std::vector<std::uint32_t> places;
    for (std::size_t i = 1; i < frames.size(); ++i) {
        groups.push_back(coded.infos[i].group);
        if (frames[i].has(packet_flag::access)) places.push_back(frames[i].frame);
    }
    // The first after the I-frame refers to it alone, and again six frames later.
    EXPECT_EQ(groups, (std::vector<int>{4, 4, 4, 4, 2, 2, 1, 4, 4, 4, 4}));
    EXPECT_EQ(places, (std::vector<std::uint32_t>{1, 7}));
    std::vector<Packet> joined = {coded.packets[0], frames[0]};
    joined.insert(joined.end(), frames.begin() + 7, frames.end());
    EXPECT_EQ(shown(joined), (std::set<std::uint32_t>{0, 7, 8, 9, 10, 11}));
}

// ---- Loss, seeking --------------------------------------------------------------------------------------------------

TEST(GroupedStream, ALostPacketCostsThoseWhoseClosureHasIt) {
    const auto& packets = grouped().packets;
    std::vector<PacketHeader> headers(packets.begin(), packets.end());
    std::map<std::uint32_t, std::set<std::uint32_t>> needed;
    for (std::size_t i = 0; i < packets.size(); ++i)
        for (const auto place : closure(headers, i))
            if (is_frame(packets[place])) needed[packets[i].frame].insert(packets[place].frame);
    EXPECT_EQ(needed[7], (std::set<std::uint32_t>{0, 1, 5, 7}));
    EXPECT_EQ(needed[8], (std::set<std::uint32_t>{0, 1, 8}));
    EXPECT_EQ(needed[9], (std::set<std::uint32_t>{0, 1, 9}));
    for (std::uint32_t lost = 1; lost < calm_person().frames.size(); ++lost) {
        std::set<std::uint32_t> left;
        for (const auto& [frame, needs] : needed)
            if (!needs.contains(lost)) left.insert(frame);
        EXPECT_EQ(shown(without_frames(packets, {lost})), left) << lost;
    }
}

TEST(GroupedStream, WhatNoneNeedsIsDroppable) {
    for (const auto& packet : frames_of(grouped().packets)) {
        std::vector<PacketHeader> headers(grouped().packets.begin(), grouped().packets.end());
        bool needed = packet.frame == 9;  // a group behind it might
        for (std::size_t i = 0; i < headers.size(); ++i)
            for (const auto place : closure(headers, i))
                if (headers[place].frame == packet.frame && headers[i].frame != packet.frame &&
                    is_frame(grouped().packets[place]))
                    needed = true;
        EXPECT_EQ(packet.has(packet_flag::referred), needed) << packet.frame;
        EXPECT_EQ(packet.has(packet_flag::droppable), !needed) << packet.frame;
    }
}

TEST(GroupedStream, SeekingIntoAGroupTakesTheFramesClosure) {
    const auto& packets = grouped().packets;
    std::vector<PacketHeader> headers(packets.begin(), packets.end());
    for (std::size_t i = 0; i < packets.size(); ++i) {
        if (!is_frame(packets[i])) continue;
        std::vector<Packet> taken;
        for (const auto place : closure(headers, i)) taken.push_back(packets[place]);
        const auto decoded = decode_packets(taken);
        ASSERT_TRUE(decoded.errors.empty()) << packets[i].frame;
        expect_same_mesh(decoded.frames.back().mesh, grouped().reconstructions[packets[i].frame]);
    }
}

TEST(GroupedStream, AFrameWhosePacketIsLostIsShownIfAnotherBroughtIt) {
    Decoder decoder;
    for (const auto& packet : without_frames(grouped().packets, {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}))
        ASSERT_TRUE(decoder.decode_copy(packet).has_value());
    const auto hidden = decoder.conceal_copy(4, 0);
    ASSERT_TRUE(hidden.has_value());
    EXPECT_TRUE(hidden->concealed);
    expect_same_mesh(hidden->mesh, grouped().reconstructions[4]);
    // What was shown last stands in for a frame that is not there.
    expect_same_mesh(decoder.conceal_copy(3, 0)->mesh, grouped().reconstructions[4]);
}

TEST(GroupedStream, PacketsOfAGroupInAnyOrderGiveTheirFramesOrAnError) {
    auto packets = grouped().packets;
    const auto repeated = frames_of(packets);
    std::reverse(packets.begin() + 3, packets.begin() + 10);  // frames 2 to 8
    packets.insert(packets.end(), repeated.begin() + 10, repeated.end());
    for (const auto& frame : decode_packets(packets).frames)
        expect_same_mesh(frame.mesh, grouped().reconstructions[frame.info.frame]);
    EXPECT_EQ(shown(packets), (std::set<std::uint32_t>{0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13}));
}

TEST(GroupedStream, APacketThatIsNotOfTheGroupInForceIsAnError) {
    const auto frames = frames_of(grouped().packets);
    const auto error_of = [&](const std::function<void(Packet&)>& change, std::size_t frame) {
        Decoder decoder;
        EXPECT_TRUE(decoder.decode_copy(grouped().packets[0]).has_value());
        for (std::size_t i = 0; i < frame; ++i) EXPECT_TRUE(decoder.decode_copy(frames[i]).has_value());
        auto packet = frames[frame];
        change(packet);
        const auto decoded = decoder.decode_copy(packet);
        return decoded ? std::string() : decoded.error().message;
    };
    const auto of_other_length = [](Packet& packet) { packet.payload[0] = 6 | 1 << 3; };
    const auto of_other_number = [](Packet& packet) { packet.frame += 1; };
    const auto of_other_reference = [](Packet& packet) { packet.reference = 0; };
    const auto that_nothing_refers_to = [](Packet& packet) { packet.flags = packet_flag::flags_valid; };
    EXPECT_EQ(error_of(of_other_length, 2), "frame 2, one of a group, refers to frame 1, which is not there");
    EXPECT_EQ(error_of(of_other_number, 2), "frame 3, one of a group, refers to frame 1, which is not there");
    EXPECT_EQ(error_of(of_other_reference, 2), "frame 2, one of a group, refers to frame 0, which is not there");
    EXPECT_EQ(error_of(that_nothing_refers_to, 1), "a group of tracked frames that nothing may refer to");
}

// ---- Options --------------------------------------------------------------------------------------------------------

TEST(GroupOption, IsKnownByName) {
    EncoderOptions options;
    EXPECT_EQ(options.tracked.group, 0);
    ASSERT_TRUE(set_option(options, "tracked.group", "8"));
    EXPECT_EQ(options.tracked.group, 8);
    EXPECT_FALSE(set_option(options, "tracked.group", "9"));
    EXPECT_TRUE(set_option(options, "tracked.group", "0"));
}

TEST(GroupOption, IsRefusedWhereItDoesNotGoTogether) {
    const auto refusal = [](const std::function<void(EncoderOptions&)>& change) {
        auto options = in_groups(4);
        change(options);
        const auto encoder = Encoder::create(options);
        return encoder ? std::string() : encoder.error().message;
    };
    const std::string fixed =
        "tracked.group goes with fixed steps only, not with rate.bits_per_second or rate.target_error";
    EXPECT_EQ(refusal([](auto& o) { o.rate.bits_per_second = 1e6; }), fixed);
    EXPECT_EQ(refusal([](auto& o) { o.rate.target_error = 1; }), fixed);
    EXPECT_EQ(refusal([](auto& o) { o.tracked.references = TrackedReferences::intra; }),
              "tracked.group does not go with tracked.references intra: frames of a group refer to each other");
    EXPECT_EQ(refusal([](auto& o) { o.key_interval = 1; }),
              "tracked.group does nothing with key_interval 1: there are no T-frames");
    EXPECT_EQ(refusal([](auto& o) { o.profile = Profile::topology; }),
              "tracked.group does nothing with the topology profile; choose the tracked profile");
}

}  // namespace
}  // namespace htvm::internal
