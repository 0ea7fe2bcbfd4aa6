// What the decoder lends equals the copies, and the topology number tells what need not be sent again.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/tracked_sequences.h"
#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"

namespace htvm {
namespace {

using namespace test;

std::vector<std::pair<std::string, std::vector<Packet>>> conformance_streams() {
    std::vector<std::pair<std::string, std::vector<Packet>>> out;
    for (const auto& entry : std::filesystem::directory_iterator(HTVM_TEST_DATA "/conformance")) {
        if (entry.path().extension() != ".htvm") continue;
        std::ifstream in(entry.path(), std::ios::binary);
        const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
        PacketReader reader;
        reader.push(bytes);
        auto& packets = out.emplace_back(entry.path().stem().string(), std::vector<Packet>{}).second;
        while (auto packet = reader.pull()) packets.push_back(std::move(*packet));
    }
    return out;
}

DecoderOptions with_draco() {
    DecoderOptions options;
    options.intra_coder = draco_intra_coder();
    return options;
}

template <class Element>
bool same(std::span<const Element> a, std::span<const Element> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

TEST(DecoderView, LendsTheArraysThatDecodeCopyCopies) {
    for (const auto& [name, packets] : conformance_streams()) {
        SCOPED_TRACE(name);
        Decoder lending(with_draco()), copying(with_draco());
        for (const auto& packet : packets) {
            const auto lent = lending.decode(packet);
            const auto copied = copying.decode_copy(packet);
            ASSERT_EQ(lent.has_value(), copied.has_value());
            if (!lent) continue;
            ASSERT_EQ(lent->has_value(), copied->has_value());
            if (!*lent) continue;
            expect_same_mesh(copy_of((*lent)->mesh), (*copied)->mesh);
            EXPECT_EQ((*lent)->topology, (*copied)->topology);
            EXPECT_EQ((*lent)->reference_topology, (*copied)->reference_topology);
            EXPECT_TRUE(same((*lent)->presence, std::span<const std::uint8_t>((*copied)->presence)));
            EXPECT_EQ((*lent)->pose->joints, (*copied)->pose.joints);
            EXPECT_EQ((*lent)->pose->orientations, (*copied)->pose.orientations);
            EXPECT_EQ((*lent)->info.vertices, (*lent)->mesh.positions.size());
            EXPECT_EQ((*lent)->info.triangles, (*lent)->mesh.triangles.size());
            EXPECT_FALSE((*lent)->concealed);
        }
    }
}

TEST(ReferenceTopology, EqualNumbersMeanEqualTexcoordsAndAsManyVertices) {
    std::size_t parts = 0;
    for (const auto& [name, packets] : conformance_streams()) {
        SCOPED_TRACE(name);
        Decoder decoder(with_draco());
        std::map<std::uint32_t, Mesh> seen;
        for (const auto& packet : packets) {
            const auto frame = decoder.decode(packet);
            if (!frame || !*frame) continue;
            const auto& [mesh, presence] = std::pair((*frame)->mesh, (*frame)->presence);
            const auto [place, is_new] = seen.try_emplace((*frame)->reference_topology, copy_of(mesh));
            EXPECT_EQ(mesh.positions.size(), place->second.positions.size());
            if (decoder.sequence()->texture.layout != TextureLayout::projection) {
                EXPECT_TRUE(same(mesh.texcoords, std::span<const Vector2f>(place->second.texcoords)));
            }
            EXPECT_EQ((*frame)->topology == (*frame)->reference_topology, presence.empty());
            if (presence.empty()) continue;
            ++parts;
            ASSERT_EQ(presence.size(), mesh.positions.size());
            for (const auto& triangle : mesh.triangles)
                for (const auto v : triangle) EXPECT_EQ(presence[v], 1);
        }
    }
    EXPECT_GT(parts, 0u);
}

TEST(TopologyNumber, EqualNumbersMeanEqualTrianglesAndTexcoords) {
    for (const auto& [name, packets] : conformance_streams()) {
        SCOPED_TRACE(name);
        Decoder decoder(with_draco());
        std::map<std::uint32_t, Mesh> seen;
        for (const auto& packet : packets) {
            const auto frame = decoder.decode(packet);
            if (!frame || !*frame) continue;
            const auto& mesh = (*frame)->mesh;
            EXPECT_NE((*frame)->topology, 0u);
            const auto [place, is_new] = seen.try_emplace((*frame)->topology, copy_of(mesh));
            EXPECT_TRUE(same(mesh.triangles, std::span<const Triangle>(place->second.triangles)));
            if (decoder.sequence()->texture.layout == TextureLayout::projection) continue;
            EXPECT_TRUE(same(mesh.texcoords, std::span<const Vector2f>(place->second.texcoords)));
        }
    }
}

TEST(ReferenceTopology, ChangesAtFramesThatCodeAMeshAlone) {
    for (const auto& [name, packets] : conformance_streams()) {
        SCOPED_TRACE(name);
        Decoder decoder(with_draco());
        std::uint32_t of_intra = 0, most = 0;
        for (const auto& packet : packets) {
            const auto frame = decoder.decode(packet);
            if (!frame || !*frame) continue;
            if (decoder.sequence()->version >= presence_version) break;  // there it changes with what is there, too
            const auto type = (*frame)->info.type;
            if (type == FrameType::tracked || type == FrameType::predicted) {
                EXPECT_EQ((*frame)->reference_topology, of_intra) << packet.frame;
                continue;
            }
            EXPECT_GT((*frame)->reference_topology, most) << packet.frame;
            most = (*frame)->reference_topology;
            if (header_with_flags(packet).has(packet_flag::referred)) of_intra = most;
        }
    }
}

std::vector<Packet> tracked_packets() {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    return with_tracked_frames(encode(synthetic(true, 2, 300), options).packets, 1500, {}, 0, 1);
}

TEST(DecoderView, TrackedFramesLendTheSameTrianglesFromTheSamePlace) {
    Decoder decoder;
    const Triangle* of_intra = nullptr;
    std::size_t tracked = 0;
    for (const auto& packet : tracked_packets()) {
        const auto frame = decoder.decode(packet);
        ASSERT_TRUE(frame.has_value()) << frame.error().message;
        if (!*frame) continue;
        const auto* triangles = (*frame)->mesh.triangles.data();
        if (packet.kind == PacketKind::intra) of_intra = triangles;
        EXPECT_EQ(triangles, of_intra);
        tracked += packet.kind == PacketKind::tracked;
    }
    EXPECT_EQ(tracked, 8u);
}

TEST(DecoderView, AStandInHasItsReferencesTopology) {
    Decoder decoder;
    EXPECT_FALSE(decoder.conceal(0, 0).has_value());
    std::uint32_t topology = 0;
    for (const auto& packet : tracked_packets()) {
        const auto frame = decoder.decode(packet);
        ASSERT_TRUE(frame.has_value()) << frame.error().message;
        if (!*frame) continue;
        topology = (*frame)->topology;
        const auto shown = copy_of(**frame);
        const auto stand_in = decoder.conceal(99, 5);
        ASSERT_TRUE(stand_in.has_value());
        EXPECT_TRUE(stand_in->concealed);
        EXPECT_EQ(stand_in->info.frame, 99u);
        EXPECT_EQ(stand_in->topology, topology);
        if (packet.kind == PacketKind::tracked) expect_same_mesh(copy_of(stand_in->mesh), shown.mesh);
    }
    EXPECT_GT(topology, 0u);
}

}  // namespace
}  // namespace htvm
