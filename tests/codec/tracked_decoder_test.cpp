// T-frames in the decoder: what they may refer to, and meshes that are hard cases for the nodes.
#include <gtest/gtest.h>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/tracked_sequences.h"

namespace htvm::internal {
namespace {

using namespace test;

std::vector<Packet> tracked_person() {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    const auto intra = encode(synthetic(false, 1, 150), options).packets;
    return with_tracked_frames(intra, 1500, {}, 0, 1);
}

TEST(TrackedDecoder, DecodesFramesFromTheIntraFrameAndFromTheFrameBefore) {
    const auto decoded = decode_packets(tracked_person());
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(decoded.frames.size(), 5u);
}

TEST(TrackedDecoder, ALostFrameCostsThoseThatReferToIt) {
    auto packets = tracked_person();  // header, I, T from I, T from the previous one, T from the previous one, T from I
    packets.erase(packets.begin() + 3);
    const auto decoded = decode_packets(packets);
    EXPECT_EQ(decoded.errors.size(), 1u);
    EXPECT_EQ(decoded.frames.size(), 3u);
}

TEST(TrackedDecoder, AnotherHeaderForgetsTheFrameBefore) {
    auto packets = tracked_person();
    auto header = *read_sequence_header(packets[0].payload);
    header.fps_numerator += 1;
    Packet other = packets[0];
    other.payload = write_sequence_header(header);
    packets.insert(packets.begin() + 3, other);
    const auto decoded = decode_packets(packets);
    EXPECT_EQ(decoded.errors.size(), 3u);
    EXPECT_EQ(decoded.frames.size(), 2u);
}

TEST(TrackedDecoder, AHeaderWithoutNodesAllowsNoTrackedFrames) {
    auto packets = tracked_person();
    auto header = *read_sequence_header(packets[0].payload);
    header.node_spacing = 0;
    packets[0].payload = write_sequence_header(header);
    EXPECT_EQ(decode_packets(packets).errors.size(), 4u);
}

// Rays that end nearer and nearer to a hub, all of them nodes; behind the hub, as far from it as the rays are, a crowd.
LatticeMesh star(std::uint32_t rays, std::uint32_t crowd) {
    LatticeMesh mesh;
    for (std::uint32_t i = 0; i < rays; ++i) mesh.positions.push_back({static_cast<std::int32_t>(4 * rays - i), 0, 0});
    for (std::uint32_t i = 0; i < crowd; ++i) mesh.positions.push_back({0, 0, 0});
    for (std::uint32_t i = 0; i < rays; ++i) mesh.triangles.push_back({i, rays, rays});
    return mesh;
}

TEST(TrackedDecoder, AStarDoesNotMakeEveryNodeSearchTheCrowdBehindItsHub) {
    // Each ray may reach the hub and the crowd, but not the next ray: at most 4 * 900 against twice 3 * 900.
    const auto mesh = star(900, 100000);
    DeformationNodeOptions options;
    options.spacing = 3600;
    options.link_reach = 0;
    const auto nodes = choose_deformation_nodes(mesh.positions, mesh.triangles, options);
    EXPECT_EQ(nodes.vertex.size(), 900u);           // every ray
    EXPECT_EQ(nodes.searched, 16u * 100000 + 900);  // the crowd sixteen times, each ray once
}

}  // namespace
}  // namespace htvm::internal
