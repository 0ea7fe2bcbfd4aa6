// How much is searched for a T-frame: what more of it brings, and that it may change from frame to frame.
#include "codec/encoder/tracked/tracking_effort.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "codec/encoder/tracking_numbers.h"
#include "codec/moving_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"
#include "htvm/option_list.hpp"

namespace htvm::internal {
namespace {

using namespace test;

const TestSequence& person() {
    static const auto made = [] {
        TestSequence out{"everyday", {}, {}};
        SynthOptions options;
        options.vertices = 1200;
        options.surface_noise_power = 0;
        for (int t = 0; t < 12; ++t) out.frames.push_back({synth_frame(options, t).mesh, {}});
        return out;
    }();
    return made;
}

EncoderOptions with_effort_of(int effort) {
    auto out = default_options(Profile::tracked);
    out.tracked.effort = effort;
    return out;
}

// efforts: of each frame, or one for all.
struct Coded {
    std::vector<Packet> packets;
    std::size_t tracked_bytes = 0;
};
Coded code(EncoderOptions options, const std::vector<int>& efforts = {}) {
    options.threads = 1;
    auto encoder = *Encoder::create(options);
    Coded out;
    const auto take = [&] {
        while (auto packet = encoder.pull()) {
            if (packet->kind == PacketKind::tracked) out.tracked_bytes += packet->payload.size();
            out.packets.push_back(std::move(*packet));
        }
    };
    for (std::size_t i = 0; i < person().frames.size(); ++i) {
        if (i < efforts.size()) {
            EXPECT_TRUE(encoder.set_effort(efforts[i]));
        }
        EXPECT_TRUE(encoder.push(person().frames[i].mesh, nullptr, 33333 * static_cast<std::int64_t>(i)));
        take();
    }
    EXPECT_TRUE(encoder.finish());
    take();
    return out;
}

bool same(const std::vector<Packet>& a, const std::vector<Packet>& b) {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const Packet& x, const Packet& y) {
               return write_packet(x) == write_packet(y);
           });
}

TEST(TrackingEffort, OfArchivesTakesFewerBitsThanThatOfLiveStreams) {
    const auto usual = code(with_effort_of(5)), archive = code(with_effort_of(9));
    EXPECT_LT(1.1 * static_cast<double>(archive.tracked_bytes), static_cast<double>(usual.tracked_bytes));
}

TEST(TrackingEffort, FiveIsTheUsualOne) {
    EXPECT_TRUE(same(code(with_effort_of(5)).packets, code(default_options(Profile::tracked)).packets));
}

TEST(TrackingEffort, FiveIsWhatTheOptionsOfRegistrationAreByDefault) {
    const DeformationOptions options;
    const auto usual = with_effort(options, tracking_effort(usual_effort));
    EXPECT_EQ(usual.coarse_rounds, options.coarse_rounds);
    EXPECT_EQ(usual.fine_rounds, options.fine_rounds);
    EXPECT_EQ(usual.surface_rounds, options.surface_rounds);
    EXPECT_EQ(usual.solver_iterations, options.solver_iterations);
    EXPECT_EQ(usual.samples, options.samples);
    EXPECT_EQ(usual.back_samples, options.back_samples);
}

TEST(UsualRequest, IsWhatAnEncoderIsAskedForByDefault) {
    const EncoderOptions options;
    const auto steps = quality_steps(options);
    EXPECT_EQ(usual_request.geometry_step.value, std::round(steps.geometry_step * Scale{}.units));
    EXPECT_EQ(usual_request.colour_step, std::round(steps.colour_step));
    EXPECT_EQ(usual_request.simplify, options.tracked.simplify);
}

TEST(TrackingEffort, SetForAllFramesIsTheOptionButForTheReferencesSamples) {
    EXPECT_TRUE(same(code(with_effort_of(2)).packets, code(with_effort_of(5), std::vector<int>(12, 2)).packets));
}

TEST(TrackingEffort, TheSameEffortsGiveTheSameBytes) {
    const std::vector<int> efforts = {5, 5, 1, 0, 0, 3, 5, 9, 2, 0, 5, 5};
    const auto once = code(with_effort_of(5), efforts);
    EXPECT_TRUE(same(once.packets, code(with_effort_of(5), efforts).packets));
    EXPECT_FALSE(same(once.packets, code(with_effort_of(5)).packets));
    Decoder decoder;
    std::size_t shown = 0;
    for (const auto& packet : once.packets) {
        const auto frame = decoder.decode(packet);
        ASSERT_TRUE(frame) << frame.error().message;
        shown += *frame ? 1 : 0;
    }
    EXPECT_EQ(shown, 12u);
}

TEST(TrackingEffort, OfNoughtCodesTheMotionAlone) {
    const auto all = code(with_effort_of(5)), alone = code(with_effort_of(5), {5, 5, 5, 5, 5, 5, 0, 0, 0, 0, 0, 0});
    const auto size = [](const Coded& coded, std::uint32_t frame) {
        for (const auto& packet : coded.packets)
            if (packet.frame == frame && packet.kind == PacketKind::tracked) return packet.payload.size();
        return std::size_t{0};
    };
    EXPECT_EQ(size(alone, 5), size(all, 5));
    for (std::uint32_t frame = 6; frame < 12; ++frame) {
        EXPECT_GT(size(alone, frame), 0u) << frame;
        EXPECT_LT(size(alone, frame), size(all, frame)) << frame;
    }
}

TEST(TrackingEffort, BringsGroupsOnlyWhereTheyMayBe) {
    const auto group_at = [](int effort, const std::function<void(EncoderOptions&)>& change = {}) {
        auto options = with_effort_of(effort);
        if (change) change(options);
        EXPECT_TRUE(Encoder::create(options));
        return frames_in_group(options);
    };
    for (int effort = 1; effort <= 5; ++effort) EXPECT_EQ(group_at(effort), 1) << effort;
    EXPECT_EQ(group_at(6), 2);
    EXPECT_EQ(group_at(7), 4);
    EXPECT_EQ(group_at(8), 8);
    EXPECT_EQ(group_at(9), 8);
    EXPECT_EQ(group_at(9, [](auto& o) { o.tracked.group = 1; }), 1);
    EXPECT_EQ(group_at(2, [](auto& o) { o.tracked.group = 3; }), 3);
    EXPECT_EQ(group_at(9, [](auto& o) { o.rate.bits_per_second = 1e6; }), 1);
    EXPECT_EQ(group_at(9, [](auto& o) { o.rate.target_error = 1; }), 1);
    EXPECT_EQ(group_at(9, [](auto& o) { o.key_interval = 1; }), 1);
    EXPECT_EQ(group_at(9, [](auto& o) { o.tracked.references = TrackedReferences::intra; }), 1);
}

TEST(TrackingEffort, IsRefusedOutOfRangeAndInOtherProfiles) {
    auto encoder = *Encoder::create(with_effort_of(5));
    EXPECT_EQ(encoder.set_effort(10).error().message, "an effort is 0 to 9, not 10");
    EXPECT_EQ(encoder.set_effort(-1).error().message, "an effort is 0 to 9, not -1");
    auto topology = *Encoder::create(default_options(Profile::topology));
    EXPECT_EQ(topology.set_effort(5).error().kind, ErrorKind::bad_input);
    EncoderOptions options;
    EXPECT_FALSE(set_option(options, "tracked.effort", "0"));
    EXPECT_FALSE(set_option(options, "tracked.effort", "10"));
    ASSERT_TRUE(set_option(options, "tracked.effort", "9"));
    EXPECT_EQ(options.tracked.effort, 9);
}

}  // namespace
}  // namespace htvm::internal
