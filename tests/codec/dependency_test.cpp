// The one rule of dependency: what closure() names decodes the frame, and nothing less does.
#include "htvm/dependency.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

struct NamedStream {
    std::string name;
    std::vector<Packet> packets;
};

EncoderOptions tracked_from(TrackedReferences references) {
    auto out = default_options(Profile::tracked);
    out.tracked.references = references;
    out.key_interval = 5;
    return out;
}

// A stream of every profile, with frames that have no surface among the tracked ones.
const std::vector<NamedStream>& streams() {
    static const auto made = [] {
        std::vector<NamedStream> out;
        const auto add = [&](const std::string& name, const TestSequence& sequence, const EncoderOptions& options) {
            auto coded = encode(sequence, options);
            EXPECT_TRUE(coded.errors.empty()) << name;
            out.push_back({name, std::move(coded.packets)});
        };
        const auto person = walking(8, 300);
        auto intra = test::enhanced_options();
        intra.key_interval = 1;
        add("I-frames alone", person, intra);
        auto enhanced = test::enhanced_options();
        enhanced.key_interval = 4;
        add("EP-frames", person, enhanced);
        auto moved = motion_based(40, 5);
        moved.topology.frame_choice = FrameChoice::motion;
        moved.topology.predicted_below = 800;
        add("P- and EP-frames", person, moved);
        add("paper", person, default_options(Profile::paper));
        auto cheaper = default_options(Profile::topology);
        cheaper.key_interval = 6;
        add("the cheaper", person, cheaper);
        auto gaps = person;
        for (auto& frame : gaps.frames) frame.mesh.texcoords.clear();  // another layout in each would make I-frames
        gaps.frames[3].mesh = Mesh{};
        add("T-frames of the frame before", gaps, tracked_from(TrackedReferences::previous));
        add("T-frames of the I-frame", gaps, tracked_from(TrackedReferences::intra));
        add("TP-frames", horned_ball(6), patched_options());
        return out;
    }();
    return made;
}

std::vector<PacketHeader> headers_of(const std::vector<Packet>& packets) {
    std::vector<PacketHeader> out;
    for (const auto& packet : packets) out.push_back(header_with_flags(packet));
    return out;
}

// What the last of these packets decodes to; nothing where it is refused.
std::optional<DecodedFrame> last_of(const std::vector<Packet>& packets, const std::vector<std::size_t>& places) {
    Decoder decoder;
    std::optional<DecodedFrame> out;
    for (const auto place : places) {
        auto frame = decoder.decode_copy(packets[place]);
        out = frame ? std::move(*frame) : std::nullopt;
    }
    return out;
}

bool same_mesh(const Mesh& a, const Mesh& b) {
    return a.positions == b.positions && a.triangles == b.triangles && a.colours == b.colours &&
           a.normals == b.normals && a.texcoords == b.texcoords;
}

// The frames of the whole stream, by the places of their packets.
std::map<std::size_t, Mesh> frames_of(const std::vector<Packet>& packets) {
    Decoder decoder;
    std::map<std::size_t, Mesh> out;
    for (std::size_t place = 0; place < packets.size(); ++place) {
        auto frame = decoder.decode_copy(packets[place]);
        EXPECT_TRUE(frame.has_value()) << frame.error().message;
        if (frame && *frame) out[place] = std::move((*frame)->mesh);
    }
    return out;
}

TEST(Closure, TheStreamsOfTheseTestsHaveEveryKindOfFrame) {
    std::set<std::pair<PacketKind, bool>> seen;
    for (const auto& [name, packets] : streams())
        for (const auto& packet : packets)
            if (frame_type(packet.kind)) seen.insert({packet.kind, packet.has(packet_flag::referred)});
    using enum PacketKind;
    EXPECT_EQ(seen, (std::set<std::pair<PacketKind, bool>>{{intra, false},
                                                           {intra, true},
                                                           {enhanced, false},
                                                           {predicted, false},
                                                           {tracked, false},
                                                           {tracked, true},
                                                           {patched, true}}));
}

TEST(Closure, DecodesTheFrameAndNoPacketOfItCanBeLeftOut) {
    for (const auto& [name, packets] : streams()) {
        SCOPED_TRACE(name);
        const auto headers = headers_of(packets);
        for (const auto& [place, mesh] : frames_of(packets)) {
            SCOPED_TRACE("frame " + std::to_string(packets[place].frame));
            const auto needed = closure(headers, place);
            ASSERT_FALSE(needed.empty());
            EXPECT_EQ(needed.back(), place);
            const auto decoded = last_of(packets, needed);
            ASSERT_TRUE(decoded.has_value());
            EXPECT_TRUE(same_mesh(decoded->mesh, mesh));
            for (std::size_t gone = 0; gone < needed.size(); ++gone) {
                auto rest = needed;
                rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(gone));
                const auto without = last_of(packets, rest);
                EXPECT_FALSE(without && without->info.frame == packets[place].frame && same_mesh(without->mesh, mesh))
                    << "packet " << needed[gone] << " is not needed";
            }
        }
    }
}

TEST(Closure, OfWhatCannotBeDecodedIsEmpty) {
    const auto& packets = streams().back().packets;
    auto headers = headers_of(packets);
    EXPECT_TRUE(closure(headers, 0).empty()) << "a header is no frame";
    EXPECT_TRUE(closure(headers, headers.size()).empty());
    headers.erase(headers.begin());
    EXPECT_TRUE(closure(headers, 0).empty()) << "there is no sequence header";
    headers = headers_of(packets);
    headers.erase(headers.begin() + 1);
    EXPECT_TRUE(closure(headers, 1).empty()) << "the I-frame is not there";
}

TEST(Closure, OfStreamsOfVersion1DecodesTheFrame) {
    int streams_of_version_1 = 0;
    for (const auto& entry : std::filesystem::directory_iterator(HTVM_TEST_DATA "/conformance")) {
        if (entry.path().extension() != ".htvm") continue;
        SCOPED_TRACE(entry.path().filename().string());
        std::ifstream in(entry.path(), std::ios::binary);
        const auto packets = read_packets({std::istreambuf_iterator<char>(in), {}}, 100000);
        if (packets[0].has(packet_flag::flags_valid)) continue;
        ++streams_of_version_1;
        const auto headers = headers_of(packets);
        for (const auto& [place, mesh] : frames_of(packets)) {
            const auto decoded = last_of(packets, closure(headers, place));
            ASSERT_TRUE(decoded.has_value()) << packets[place].frame;
            EXPECT_TRUE(same_mesh(decoded->mesh, mesh)) << packets[place].frame;
        }
    }
    EXPECT_GE(streams_of_version_1, 12);
}

// As a live publisher's packets come: whoever joins is sent what is kept, and then what comes.
TEST(Dependencies, WhatIsKeptIsEnoughForAllThatComes) {
    for (const auto& [name, packets] : streams()) {
        SCOPED_TRACE(name);
        const auto all = frames_of(packets);
        Dependencies dependencies;
        for (std::size_t joined = 0; joined < packets.size(); ++joined) {
            EXPECT_EQ(dependencies.push(packets[joined]), joined);
            Decoder decoder;
            for (const auto place : dependencies.kept()) EXPECT_TRUE(decoder.decode_copy(packets[place]).has_value());
            for (std::size_t place = joined + 1; place < std::min(joined + 4, packets.size()); ++place) {
                const auto frame = decoder.decode_copy(packets[place]);
                ASSERT_TRUE(frame.has_value()) << frame.error().message;
                if (*frame) {
                    EXPECT_TRUE(same_mesh((*frame)->mesh, all.at(place)));
                }
            }
        }
    }
}

TEST(Dependencies, ForgetWhatCanNeverBeNeededAgain) {
    for (const auto& [name, packets] : streams()) {
        SCOPED_TRACE(name);
        Dependencies dependencies;
        std::size_t most = 0;
        for (const auto& packet : packets) {
            dependencies.push(packet);
            most = std::max(most, dependencies.kept().size());
        }
        // A header, an I-frame, and two codebooks or the T-frames of one key interval.
        EXPECT_LE(most, 6u);
    }
}

PacketHeader header_packet(std::uint32_t frame, std::uint32_t crc, std::uint8_t flags = 0) {
    PacketHeader out;
    out.kind = PacketKind::sequence;
    out.flags = packet_flag::flags_valid | flags;
    out.frame = frame;
    out.reference = crc;
    return out;
}

PacketHeader frame_packet(PacketKind kind, std::uint32_t frame, std::uint32_t reference, bool referred = true) {
    PacketHeader out;
    out.kind = kind;
    out.flags = packet_flag::flags_valid | (referred ? packet_flag::referred : packet_flag::droppable);
    out.frame = frame;
    out.reference = reference;
    return out;
}

using Places = std::vector<std::uint64_t>;

TEST(Dependencies, AreBoundedWhateverTheStreamClaims) {
    Dependencies dependencies(100);
    dependencies.push(header_packet(0, 1));
    dependencies.push(frame_packet(PacketKind::intra, 0, 0));
    for (std::uint32_t frame = 1; frame < 1000; ++frame) {
        dependencies.push(frame_packet(PacketKind::tracked, frame, frame - 1));
        EXPECT_LE(dependencies.kept().size(), 102u);
        EXPECT_EQ(dependencies.closure().empty(), frame > 100);
    }
    PacketHeader untold;
    untold.kind = PacketKind::codebook;
    dependencies.push(frame_packet(PacketKind::intra, 1000, 1000));
    untold.reference = 1000;
    for (int i = 0; i < 1000; ++i) dependencies.push(untold);
    EXPECT_LE(dependencies.kept().size(), 102u);
}

TEST(Dependencies, AFrameThatNothingRefersToIsNotKept) {
    Dependencies dependencies;
    dependencies.push(header_packet(0, 1));                           // 0
    dependencies.push(frame_packet(PacketKind::intra, 0, 0));         // 1
    dependencies.push(frame_packet(PacketKind::tracked, 1, 0));       // 2
    dependencies.push(frame_packet(PacketKind::intra, 2, 2, false));  // 3
    EXPECT_EQ(dependencies.closure(), (Places{0, 3}));
    EXPECT_EQ(dependencies.kept(), (Places{0, 1, 2}));
    dependencies.push(frame_packet(PacketKind::tracked, 3, 1, false));  // 4
    EXPECT_EQ(dependencies.closure(), (Places{0, 1, 2, 4}));
    dependencies.push(frame_packet(PacketKind::tracked, 4, 1));  // 5
    EXPECT_EQ(dependencies.closure(), (Places{0, 1, 2, 5}));
    dependencies.push(frame_packet(PacketKind::tracked, 5, 0));  // 6
    EXPECT_EQ(dependencies.closure(), (Places{0, 1, 6}));
    EXPECT_EQ(dependencies.kept(), (Places{0, 1, 6}));
}

TEST(Dependencies, TellSequencesApart) {
    Dependencies dependencies;
    const auto in_force = [&](const PacketHeader& header) {
        dependencies.push(header);
        return dependencies.sequences();
    };
    EXPECT_EQ(in_force(header_packet(0, 1)), 1u);
    EXPECT_EQ(in_force(frame_packet(PacketKind::intra, 0, 0)), 1u);
    EXPECT_EQ(in_force(header_packet(1, 1)), 1u) << "repeated before the next frame";
    EXPECT_EQ(in_force(header_packet(0, 1)), 2u) << "the numbers begin again";
    EXPECT_TRUE(dependencies.closure().empty());
    EXPECT_EQ(in_force(frame_packet(PacketKind::intra, 0, 0)), 2u);
    EXPECT_EQ(in_force(header_packet(1, 2)), 3u) << "another header";
    EXPECT_EQ(in_force(header_packet(1, 3, packet_flag::session)), 4u);
    EXPECT_EQ(in_force(frame_packet(PacketKind::intra, 7, 7)), 4u);
    EXPECT_EQ(in_force(header_packet(1, 3, packet_flag::session)), 4u) << "sent again to newcomers";
    EXPECT_EQ(dependencies.kept().size(), 2u);
}

}  // namespace
}  // namespace htvm::internal
