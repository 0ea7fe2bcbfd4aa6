// Encoders of one capture in several qualities: Encoder::share_with() and Encoder::request_access().
#include "codec/encoder/tracked/shared_tracking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

constexpr int frames = 8;
constexpr std::int64_t frame_us = 33333;

Encoder encoder_of(double quality) {
    auto options = default_options(Profile::tracked);
    options.quality = quality;
    options.lattice_bits = 4;
    options.threads = 1;
    options.tracked.group = 1;
    options.tracked.access_interval = 1000;
    return *Encoder::create(options);
}

Mesh frame_at(int t) {
    SynthOptions options;
    options.vertices = 900;
    return synth_frame(options, 2 * t).mesh;
}

std::vector<Packet> taken(Encoder& encoder) {
    std::vector<Packet> out;
    while (auto packet = encoder.pull()) out.push_back(std::move(*packet));
    return out;
}

bool took(const Encoder& encoder, const std::string& stage) {
    return std::any_of(encoder.stage_times().begin(), encoder.stage_times().end(),
                       [&](const StageTime& time) { return time.stage == stage; });
}

TEST(Encoders_that_share, find_search_structures_once_and_each_makes_a_whole_stream) {
    auto first = encoder_of(60), second = encoder_of(30);
    ASSERT_TRUE(second.share_with(first));
    Decoder decoder;
    int shown = 0;
    for (int t = 0; t < frames; ++t) {
        const auto mesh = frame_at(t);
        ASSERT_TRUE(first.push(mesh, nullptr, t * frame_us));
        EXPECT_TRUE(took(first, "search structures"));
        ASSERT_TRUE(second.push(mesh, nullptr, t * frame_us));
        EXPECT_FALSE(took(second, "search structures"));
        taken(first);
        for (const auto& packet : taken(second)) {
            const auto frame = decoder.decode(packet);
            ASSERT_TRUE(frame) << frame.error().message;
            shown += frame->has_value() ? 1 : 0;
        }
    }
    EXPECT_EQ(shown, frames);
}

TEST(Encoders_that_share, do_so_from_the_first_frame_on_and_with_one_that_shares_with_no_other) {
    auto first = encoder_of(60), second = encoder_of(30), third = encoder_of(20);
    ASSERT_TRUE(second.share_with(first));
    EXPECT_FALSE(third.share_with(second));
    EXPECT_FALSE(first.share_with(first));
    ASSERT_TRUE(first.push(frame_at(0), nullptr, 0));
    EXPECT_FALSE(third.share_with(first));
}

TEST(A_requested_access, is_a_frame_where_decoding_can_start_whatever_the_interval) {
    auto encoder = encoder_of(42);
    std::vector<bool> starts;
    for (int t = 0; t < frames; ++t) {
        if (t == 5) encoder.request_access();
        ASSERT_TRUE(encoder.push(frame_at(t), nullptr, t * frame_us));
        for (const auto& packet : taken(encoder))
            if (packet.kind == PacketKind::tracked) starts.push_back(packet.reference == 0);
    }
    // The first T-frame refers to the I-frame in any case.
    EXPECT_EQ(starts, (std::vector<bool>{true, false, false, false, true, false, false}));
}

TEST(A_shared_step, takes_the_nodes_of_another_mesh_along_with_the_nearest_of_its_own) {
    DeformableMesh first, second;
    first.handles = {{0, 0, 0}, {100, 0, 0}};
    second.handles = {{1, 0, 0}, {90, 0, 0}};
    std::vector<RigidMotion> before(2), now(2);
    before[1].shift = now[1].shift = {0, 50, 0};
    now[1].shift.z() = 7;
    SharedTracking shared;
    Lattice lattice;
    shared.add(1000, shared_step(lattice, first, before, now));
    std::vector<RigidMotion> last(2);
    last[1].shift = {0, 49, 0};
    const auto start = shared.start(1000, lattice, second, last);
    ASSERT_EQ(start.size(), 2u);
    EXPECT_EQ(start[0](second.handles[0]), Eigen::Vector3d(1, 0, 0));
    EXPECT_EQ(start[1](second.handles[1]), Eigen::Vector3d(90, 49, 7));
    EXPECT_TRUE(shared.start(2000, lattice, second, last).empty());
    lattice.bits = 5;
    EXPECT_TRUE(shared.start(1000, lattice, second, last).empty());
}

}  // namespace
}  // namespace htvm::internal
