// Rate and error control of the whole encoder, on small synthetic captures.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using test::TestSequence;

constexpr double frames_per_second = 30;

// The synthetic person walks ten frames forwards and backwards, as often as needed.
TestSequence walking(int frames) {
    constexpr int there = 10;
    TestSequence out{"walking", synth_skeleton(), {}};
    SynthOptions options;
    options.vertices = 500;
    std::vector<test::SequenceFrame> made;
    for (int t = 0; t < std::min(frames, there + 1); ++t) {
        auto frame = synth_frame(options, 40 + 2 * t);
        made.push_back({std::move(frame.mesh), std::move(frame.pose)});
    }
    for (int t = 0; t < frames; ++t) {
        const int phase = t % (2 * there);
        out.frames.push_back(made[static_cast<std::size_t>(std::min(phase, 2 * there - phase))]);
    }
    return out;
}

struct Run {
    std::vector<FrameCost> costs;  // 0 bits if the frame was dropped
    std::vector<Packet> packets;
    std::vector<Mesh> shown;
    std::vector<LayerBytes> bytes;  // of what is shown
    std::vector<std::string> errors;
    double bits = 0;     // of all packets
    double fullest = 0;  // the buffer's highest level relative to its capacity, from the packets
    std::size_t frames_of(FrameType type) const {
        return static_cast<std::size_t>(std::count_if(
            costs.begin(), costs.end(), [&](const FrameCost& c) { return c.type == type && c.bits > 0; }));
    }
};

Run coded_by(const TestSequence& sequence, EncoderOptions options) {
    options.skeleton = sequence.skeleton;
    auto encoder = Encoder::create(options);
    Run run;
    if (!encoder) {
        ADD_FAILURE() << encoder.error().message;
        return run;
    }
    const double per_frame = options.rate.bits_per_second / frames_per_second;
    double buffer = 0;
    std::int64_t time = 0;
    for (const auto& frame : sequence.frames) {
        const auto ok = encoder->push(frame.mesh, frame.pose ? &*frame.pose : nullptr, time);
        time += 33333;
        if (!ok) {
            EXPECT_EQ(ok.error().kind, ErrorKind::limit);
            run.errors.push_back(ok.error().message);
        }
        run.costs.push_back(ok ? encoder->last_cost() : FrameCost{FrameType::predicted, 0, 0});
        if (ok) run.shown.push_back(encoder->reconstruction());
        if (ok) run.bytes.push_back(encoder->last_frame().bytes);
        double bits = 0;
        while (auto packet = encoder->pull()) {
            bits += 8.0 * static_cast<double>(packet->payload.size() + packet_overhead);
            run.packets.push_back(std::move(*packet));
        }
        EXPECT_EQ(bits, run.costs.back().bits);
        buffer += bits;
        run.bits += bits;
        if (per_frame > 0)
            run.fullest = std::max(run.fullest, buffer / (options.rate.bits_per_second * options.rate.buffer_seconds));
        buffer = std::max(0.0, buffer - per_frame);
    }
    return run;
}

EncoderOptions at_rate(double bits_per_second, double buffer_seconds = 0.5, Profile profile = Profile::topology) {
    EncoderOptions options = profile == Profile::topology ? test::enhanced_options() : default_options(profile);
    options.rate.bits_per_second = bits_per_second;
    options.rate.buffer_seconds = buffer_seconds;
    options.key_interval = 10;
    return options;
}

double off_target(const Run& run, const EncoderOptions& options) {
    return run.bits / (options.rate.bits_per_second / frames_per_second * static_cast<double>(run.costs.size())) - 1;
}

double quality_spread(const Run& run, std::size_t from) {
    double lowest = 100, highest = 0;
    for (std::size_t f = from; f < run.costs.size(); ++f)
        lowest = std::min(lowest, run.costs[f].quality), highest = std::max(highest, run.costs[f].quality);
    return highest - lowest;
}

TEST(EncoderRate, StaysWithinFivePercentAndWithinTheBuffer) {
    const auto sequence = walking(90);
    for (const double rate : {300e3, 450e3}) {
        SCOPED_TRACE(rate);
        const auto options = at_rate(rate);
        const auto run = coded_by(sequence, options);
        EXPECT_NEAR(off_target(run, options), 0, 0.05);
        EXPECT_LE(run.fullest, 1);
        EXPECT_TRUE(run.errors.empty());
        EXPECT_EQ(run.frames_of(FrameType::predicted), 0u);
    }
}

TEST(EncoderRate, TwoPassesAreNearerAndMoreEven) {
    const auto sequence = walking(90);
    double first_spread = 0, second_spread = 0;
    // One rate says little: the spread of either differs by 10 between rates that differ by a hundredth.
    for (const double rate : {296e3, 298e3, 300e3, 302e3}) {
        SCOPED_TRACE(rate);
        auto options = at_rate(rate);
        const auto first = coded_by(sequence, options);
        options.rate.first_pass = first.costs;
        const auto second = coded_by(sequence, options);
        EXPECT_NEAR(off_target(second, options), 0, 0.02);
        EXPECT_LE(second.fullest, 1);
        first_spread += quality_spread(first, 0) / 4;
        second_spread += quality_spread(second, 0) / 4;
    }
    EXPECT_LE(second_spread, 0.9 * first_spread);
}

TEST(EncoderRate, TheBytesAreTheSameForAnyNumberOfThreads) {
    const auto sequence = walking(12);
    auto options = at_rate(300e3);
    options.threads = 1;
    const auto one = coded_by(sequence, options);
    options.threads = 3;
    const auto three = coded_by(sequence, options);
    ASSERT_EQ(one.packets.size(), three.packets.size());
    for (std::size_t k = 0; k < one.packets.size(); ++k)
        EXPECT_EQ(write_packet(one.packets[k]), write_packet(three.packets[k]));
}

TEST(EncoderRate, FramesBecomePredictedOnesWhereTheBufferIsNearlyFull) {
    // The I-frames fit, but the line cannot carry the EP-frames even at the lowest quality.
    const auto sequence = walking(30);
    const auto options = at_rate(80e3, 0.4);
    const auto run = coded_by(sequence, options);
    EXPECT_GT(run.frames_of(FrameType::predicted), 0u);
    EXPECT_GT(run.frames_of(FrameType::intra), 0u);
    EXPECT_LE(run.fullest, 1);
}

TEST(EncoderRate, AFirstFrameThatNeverFitsSaysWhatWouldDo) {
    const auto sequence = walking(1);
    const auto run = coded_by(sequence, at_rate(1e3, 1));
    ASSERT_EQ(run.errors.size(), 1u);
    const auto& message = run.errors[0];
    const auto seconds_at = message.find("a buffer of at least ");
    const auto bitrate_at = message.find("a bitrate of at least ");
    ASSERT_NE(seconds_at, std::string::npos) << message;
    ASSERT_NE(bitrate_at, std::string::npos) << message;
    EXPECT_TRUE(coded_by(sequence, at_rate(1e3, std::stod(message.substr(seconds_at + 21)))).errors.empty()) << message;
    EXPECT_TRUE(coded_by(sequence, at_rate(1e6 * std::stod(message.substr(bitrate_at + 22)), 1)).errors.empty())
        << message;
}

TEST(EncoderRate, ADroppedFrameLeavesTheStreamSound) {
    auto sequence = walking(6);
    SynthOptions large;
    large.vertices = 5000;
    auto other = synth_frame(large, 43);
    other.mesh.colours.clear();  // so it cannot refer to the I-frame
    sequence.frames[3] = {std::move(other.mesh), std::move(other.pose)};
    const auto run = coded_by(sequence, at_rate(150e3, 0.3));
    EXPECT_EQ(run.errors.size(), 1u);
    EXPECT_EQ(run.costs[3].bits, 0);
    EXPECT_LE(run.fullest, 1);
    Decoder decoder;
    std::size_t decoded = 0;
    for (const auto& packet : run.packets) {
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame);
        if (*frame) ++decoded;
    }
    EXPECT_EQ(decoded, 5u);
}

TEST(EncoderRate, ASceneChangeInTheMiddleIsAbsorbed) {
    // From the middle on, everything is twice as large, which the skeleton does not show.
    auto sequence = walking(90);
    const std::size_t middle = sequence.frames.size() / 2;
    for (std::size_t f = middle; f < sequence.frames.size(); ++f)
        for (auto& p : sequence.frames[f].mesh.positions) p = {2 * p[0], 2 * p[1], 2 * p[2]};
    auto options = at_rate(450e3);
    options.key_interval = 60;
    const auto run = coded_by(sequence, options);
    EXPECT_EQ(run.costs[middle].type, FrameType::intra);
    EXPECT_NEAR(off_target(run, options), 0, 0.05);
    EXPECT_LE(run.fullest, 1);
    EXPECT_TRUE(run.errors.empty());
}

TEST(EncoderRate, AllChoicesOfFramesStayWithinTheBuffer) {
    const auto sequence = walking(20);
    const auto fixed = coded_by(sequence, at_rate(300e3));
    for (const auto choice : {FrameChoice::motion, FrameChoice::rate_distortion}) {
        auto options = at_rate(300e3);
        options.topology.frame_choice = choice;
        if (choice == FrameChoice::motion) options.topology.predicted_below = 500;
        options.topology.still_below = 60;
        options.topology.animation_error = 0;
        const auto run = coded_by(sequence, options);
        EXPECT_LE(run.fullest, 1);
        EXPECT_TRUE(run.errors.empty());
        EXPECT_NE(run.bits, fixed.bits) << "something was chosen";
    }
}

TEST(TrackedRate, StaysWithinFivePercentAndWithinTheBuffer) {
    const auto sequence = walking(90);
    for (const double rate : {150e3, 300e3}) {
        SCOPED_TRACE(rate);
        const auto options = at_rate(rate, 0.5, Profile::tracked);
        const auto run = coded_by(sequence, options);
        EXPECT_NEAR(off_target(run, options), 0, 0.05);
        EXPECT_LE(run.fullest, 1);
        EXPECT_TRUE(run.errors.empty());
        EXPECT_GE(run.frames_of(FrameType::tracked), 75u);
        EXPECT_EQ(run.frames_of(FrameType::predicted), 0u);
    }
}

TEST(TrackedRate, TwoPassesAreNearerAndMoreEven) {
    const auto sequence = walking(90);
    auto options = at_rate(200e3, 0.5, Profile::tracked);
    const auto first = coded_by(sequence, options);
    options.rate.first_pass = first.costs;
    const auto second = coded_by(sequence, options);
    EXPECT_NEAR(off_target(second, options), 0, 0.02);
    EXPECT_LE(second.fullest, 1);
    EXPECT_LE(quality_spread(second, 0), quality_spread(first, 0));
}

TEST(TrackedRate, AFirstFrameThatNeverFitsSaysWhatWouldDo) {
    const auto sequence = walking(1);
    const auto run = coded_by(sequence, at_rate(1e3, 1, Profile::tracked));
    ASSERT_EQ(run.errors.size(), 1u);
    const auto seconds_at = run.errors[0].find("a buffer of at least ");
    ASSERT_NE(seconds_at, std::string::npos) << run.errors[0];
    const auto enough = at_rate(1e3, std::stod(run.errors[0].substr(seconds_at + 21)), Profile::tracked);
    EXPECT_TRUE(coded_by(sequence, enough).errors.empty()) << run.errors[0];
}

double error_of(const Mesh& captured, const Mesh& shown) {
    return surface_errors({captured.positions, captured.triangles, captured.colours},
                          {shown.positions, shown.triangles, shown.colours}, {})
        .geometry_rms;
}

TEST(TrackedRate, AFrameThatFitsNoBufferIsTheMotionAlone) {
    auto sequence = walking(15);
    sequence.skeleton = {};  // without a skeleton a P-frame would be one rigid body
    for (auto& frame : sequence.frames) frame.pose.reset();
    auto options = at_rate(55e3, 0.4, Profile::tracked);
    options.tracked.denoise = Denoising::off;  // without their noise most frames fit
    const auto run = coded_by(sequence, options);
    EXPECT_TRUE(run.errors.empty());
    EXPECT_LE(run.fullest, 1);
    ASSERT_EQ(run.shown.size(), sequence.frames.size());
    std::size_t alone = 0, intra = 0;
    for (const auto& packet : run.packets) {
        EXPECT_NE(packet.kind, PacketKind::predicted);
        if (packet.kind == PacketKind::intra) intra = packet.frame;
        if (packet.kind != PacketKind::tracked) continue;
        const auto& bytes = run.bytes[packet.frame];
        if (bytes[Layer::geometry] + bytes[Layer::colour] > 25) continue;
        ++alone;
        EXPECT_GT(bytes[Layer::transforms], 100u);
        const auto& captured = sequence.frames[packet.frame].mesh;
        EXPECT_LT(error_of(captured, run.shown[packet.frame]), 0.5 * error_of(captured, run.shown[intra]))
            << "frame " << packet.frame << " against the I-frame held still";
    }
    EXPECT_GE(alone, 3u);
}

TEST(EncoderError, EveryFrameComesNearTheTarget) {
    const auto sequence = walking(8);
    for (const double target : {0.4, 1.0}) {
        EncoderOptions options = test::enhanced_options();
        options.rate.target_error = target;
        options.key_interval = 4;
        const auto run = coded_by(sequence, options);
        ASSERT_EQ(run.shown.size(), sequence.frames.size());
        for (std::size_t f = 0; f < run.shown.size(); ++f)
            EXPECT_NEAR(error_of(sequence.frames[f].mesh, run.shown[f]) / target, 1, 0.06) << target << " mm, " << f;
    }
}

// Large enough that the capture's own sampling, which T-frames do not follow, is finer than the errors asked for.
TestSequence finely_sampled() {
    TestSequence out{"finely sampled", synth_skeleton(), {}};
    SynthOptions options;
    options.vertices = 4000;
    for (int t = 0; t < 6; ++t) {
        auto frame = synth_frame(options, 40 + t);
        out.frames.push_back({std::move(frame.mesh), std::move(frame.pose)});
    }
    return out;
}

TEST(TrackedError, EveryFrameComesNearTheTarget) {
    const auto sequence = finely_sampled();
    for (const double target : {1.5, 2.0}) {
        EncoderOptions options;
        options.rate.target_error = target;
        options.key_interval = 4;
        const auto run = coded_by(sequence, options);
        ASSERT_EQ(run.shown.size(), sequence.frames.size());
        EXPECT_EQ(run.frames_of(FrameType::tracked), 4u);
        for (std::size_t f = 0; f < run.shown.size(); ++f)
            EXPECT_NEAR(error_of(sequence.frames[f].mesh, run.shown[f]) / target, 1, 0.1) << target << " mm, " << f;
    }
}

TEST(TrackedError, ATargetThatNoQualityIsBadEnoughForIsNotExceeded) {
    const auto sequence = finely_sampled();
    EncoderOptions options;
    options.rate.target_error = 5;
    const auto run = coded_by(sequence, options);
    for (std::size_t f = 0; f < run.shown.size(); ++f) {
        EXPECT_LT(error_of(sequence.frames[f].mesh, run.shown[f]), 5);
        EXPECT_EQ(run.costs[f].quality, 0) << f;
    }
}

TEST(EncoderRate, FollowsABitrateThatIsChangedBetweenFrames) {
    const auto sequence = walking(90);
    EncoderOptions options;
    options.skeleton = sequence.skeleton;
    options.rate.bits_per_second = 300e3;
    auto encoder = Encoder::create(options);
    ASSERT_TRUE(encoder);
    std::array<double, 2> bits{};  // of the 30 frames before the change, and of 30 from half a second behind it
    for (int f = 0; f < 90; ++f) {
        if (f == 45) {
            ASSERT_TRUE(encoder->set_bitrate(100e3));
        }
        const auto& frame = sequence.frames[static_cast<std::size_t>(f)];
        ASSERT_TRUE(encoder->push(frame.mesh, frame.pose ? &*frame.pose : nullptr, 33333 * f));
        while (encoder->pull()) {
        }
        if (f >= 15 && f < 45) bits[0] += encoder->last_cost().bits;
        if (f >= 60) bits[1] += encoder->last_cost().bits;
    }
    EXPECT_NEAR(bits[0], 300e3, 0.2 * 300e3);
    EXPECT_NEAR(bits[1], 100e3, 0.2 * 100e3);
}

TEST(EncoderRate, IsChangedOnlyWhereThereIsOneAndToWhatOptionsCouldHaveSaid) {
    auto free = Encoder::create({});
    ASSERT_TRUE(free);
    EXPECT_EQ(free->set_bitrate(1e6).error().message,
              "this encoder keeps to no bitrate: give it rate.bits_per_second when it is made");
    EncoderOptions options;
    options.rate.bits_per_second = 1e6;
    auto encoder = Encoder::create(options);
    ASSERT_TRUE(encoder);
    EXPECT_TRUE(encoder->set_bitrate(2e6));
    for (const double wrong : {0.0, -1.0, 999.0, 1e13, std::nan("")})
        EXPECT_EQ(encoder->set_bitrate(wrong).error().kind, ErrorKind::bad_input) << wrong;
}

}  // namespace
}  // namespace htvm::internal
