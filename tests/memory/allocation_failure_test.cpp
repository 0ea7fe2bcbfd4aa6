// If memory runs out, only the packet or frame being processed fails.
#include <gtest/gtest.h>

#include <optional>

#include "memory/counted_allocations.h"
#include "memory/memory_streams.h"

namespace htvm {
namespace {

using namespace test;

// Number of failures tried, spread over all allocations: 400, and fewer under sanitizers, which are slow.
constexpr std::uint64_t most_failures = HTVM_MOST_FAILURES;

struct Pushed {
    std::size_t frames = 0, errors = 0, other_errors = 0;
};

// Pushes all packets, and asks for a stand-in after each. Errors of other kinds come from frames that refer to lost
// ones.
Pushed push_all(Decoder& decoder, const std::vector<Packet>& packets) {
    Pushed out;
    for (const auto& packet : packets) {
        const auto frame = decoder.decode_copy(packet);
        if (!frame)
            ++(frame.error().kind == ErrorKind::limit ? out.errors : out.other_errors);
        else if (*frame)
            ++out.frames;
        (void)decoder.conceal_copy(packet.frame, packet.timestamp_us);
    }
    return out;
}

std::size_t frames_in(const std::vector<Packet>& packets) {
    return static_cast<std::size_t>(std::count_if(packets.begin(), packets.end(), is_frame));
}

// Lets every allocation made while decoding the stream fail once, or about `most` of them. Each time an error or a
// frame must come, no memory may leak, and the decoder must decode the stream when it is sent again.
void expect_survival(const std::vector<Packet>& packets, unsigned threads, bool all, std::uint64_t most) {
    DecoderOptions options;
    options.threads = threads;
    reset_allocations();
    {
        Decoder decoder(options);
        ASSERT_EQ(push_all(decoder, packets).frames, frames_in(packets));
    }
    const std::uint64_t total = allocations().made;
    std::size_t errors = 0;
    for (std::uint64_t n = 0; n < total; n += 1 + total / most) {
        const auto live = allocations().live;
        {
            std::optional<Decoder> decoder(std::in_place, options);
            Pushed failing, after;
            while_failing(n, all, [&] { failing = push_all(*decoder, packets); });
            errors += failing.errors;
            EXPECT_LE(failing.frames + failing.errors + failing.other_errors, packets.size());
            after = push_all(*decoder, packets);
            EXPECT_EQ(after.frames, frames_in(packets)) << "behind failure " << n;
            EXPECT_EQ(after.errors + after.other_errors, 0u);
        }
        EXPECT_EQ(allocations().live, live) << "behind failure " << n;
    }
    EXPECT_GT(errors, 0u);
}

TEST(DecoderOutOfMemory, AnyAllocationMayFailOnce) {
    for (const unsigned threads : {1u, 2u}) {
        expect_survival(animated_stream(150), threads, false, most_failures);
        expect_survival(tracked_stream(150), threads, false, most_failures);
    }
}

TEST(DecoderOutOfMemory, AllAllocationsMayFailFromAnyOn) {
    expect_survival(animated_stream(150), 2, true, most_failures / 2);
    expect_survival(tracked_stream(150), 2, true, most_failures / 2);
}

TEST(PacketReaderOutOfMemory, WhatWasPushedIsStillThere) {
    const auto packets = animated_stream(100);
    std::vector<std::uint8_t> bytes;
    for (const auto& packet : packets) {
        const auto written = write_packet(packet);
        bytes.insert(bytes.end(), written.begin(), written.end());
    }
    for (std::uint64_t n = 0; n < packets.size(); ++n) {
        PacketReader reader;
        reader.push(bytes);
        std::size_t pulled = 0, failed = 0;
        while_failing(n, false, [&] {
            for (bool more = true; more;) try {
                    more = reader.pull().has_value();
                    pulled += more;
                } catch (const std::bad_alloc&) {
                    ++failed;
                }
        });
        EXPECT_EQ(failed, 1u);
        EXPECT_EQ(pulled, packets.size());
    }
}

struct Encoded {
    std::size_t frames = 0, errors = 0;
    std::vector<Packet> packets;
};

// Pushes the frames; those in [from, to) while allocation n fails.
void push_frames(Encoder& encoder, const TestSequence& sequence, std::int64_t& time, Encoded& out) {
    for (const auto& frame : sequence.frames) {
        const auto ok = encoder.push(frame.mesh, frame.pose ? &*frame.pose : nullptr, time += 33333);
        EXPECT_TRUE(ok || ok.error().kind == ErrorKind::limit);
        ++(ok ? out.frames : out.errors);
    }
}

void expect_encoder_survival(const TestSequence& sequence, EncoderOptions options, std::uint64_t most) {
    options.skeleton = sequence.skeleton;
    options.threads = 2;
    std::int64_t time = 0;
    reset_allocations();
    {
        auto encoder = *Encoder::create(options);
        Encoded out;
        push_frames(encoder, sequence, time, out);
        ASSERT_EQ(out.frames, sequence.frames.size());
    }
    const std::uint64_t total = allocations().made;
    for (std::uint64_t n = 0; n < total; n += 1 + total / most) {
        const auto live = allocations().live;
        {
            time = 0;
            Encoded out;
            std::optional<Result<Encoder>> encoder;
            while_failing(n, false, [&] {
                encoder.emplace(Encoder::create(options));
                if (*encoder) push_frames(**encoder, sequence, time, out);
            });
            if (!*encoder) {
                EXPECT_EQ(encoder->error().kind, ErrorKind::limit);
                continue;
            }
            EXPECT_LE(out.errors, 1u);
            push_frames(**encoder, sequence, time, out);
            (*encoder)->finish();
            while (auto packet = (*encoder)->pull()) out.packets.push_back(std::move(*packet));
            const auto decoded = decode_packets(out.packets);
            EXPECT_EQ(decoded.frames.size(), out.frames) << "behind failure " << n;
            EXPECT_TRUE(decoded.errors.empty()) << decoded.errors[0].message;
        }
        EXPECT_EQ(allocations().live, live) << "behind failure " << n;
    }
}

TEST(EncoderOutOfMemory, AFrameIsLeftOutAndTheStreamGoesOn) {
    auto options = motion_based(40, 3);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 800;
    expect_encoder_survival(walking(3, 120), options, most_failures / 6);
    options = {};
    options.profile = Profile::tracked;
    expect_encoder_survival(walking(3, 120), options, 40);
}

}  // namespace
}  // namespace htvm
