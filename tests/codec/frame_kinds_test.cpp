// The table of frame kinds agrees with what the streams do.
#include "codec/format/frame_kinds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "codec/format/sequence.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

std::vector<Packet> packets_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
    PacketReader reader;
    reader.push(bytes);
    std::vector<Packet> out;
    while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    return out;
}

std::vector<std::filesystem::path> conformance_streams() {
    std::vector<std::filesystem::path> out;
    for (const auto& entry : std::filesystem::directory_iterator(HTVM_TEST_DATA "/conformance"))
        if (entry.path().extension() == ".htvm") out.push_back(entry.path());
    return out;
}

TEST(FrameKinds, AreFoundByTypeLetterAndPacket) {
    std::set<std::string> letters;
    for (const auto& kind : frame_kinds) {
        EXPECT_EQ(kind_of(kind.type).name, kind.name);
        EXPECT_EQ(kind_of_letter(kind.letter), &kind);
        EXPECT_EQ(frame_type(rules_of(kind.type).packet), kind.type);
        letters.insert(kind.letter);
    }
    EXPECT_EQ(letters, (std::set<std::string>{"I", "EP", "P", "T", "TP"}));
    EXPECT_EQ(kind_of_letter("E"), nullptr);
    EXPECT_EQ(frame_type(PacketKind::codebook), std::nullopt);
}

TEST(FrameKinds, HaveNoLayersButTheirRows) {
    std::set<FrameType> seen;
    for (const auto& stream : conformance_streams()) {
        int version = 0;
        for (const auto& packet : packets_of(stream)) {
            if (packet.kind == PacketKind::sequence) version = read_sequence_header(packet.payload)->version;
            const auto type = frame_type(packet.kind);
            if (!type) continue;
            seen.insert(*type);
            if (*type == FrameType::tracked && version >= tracked_run_version) continue;  // it has no table
            const auto payload = *read_frame_payload(packet.payload);
            for (std::size_t i = 0; i < layer_count; ++i)
                EXPECT_TRUE(!payload.has(static_cast<Layer>(i)) || rules_of(*type).layers.has(static_cast<Layer>(i)))
                    << stream << ": layer " << i << " in a frame of kind " << kind_of(*type).letter;
        }
    }
    EXPECT_EQ(seen.size(), frame_type_count);
}

TEST(FrameKinds, ReferToFramesOfWhichTheirRowsSpeak) {
    for (const auto& stream : conformance_streams()) {
        std::uint32_t reference = 0;
        std::vector<std::uint32_t> before;  // since the reference, of those that may be referred to
        int version = 0;
        for (const auto& packet : packets_of(stream)) {
            if (packet.kind == PacketKind::sequence) version = read_sequence_header(packet.payload)->version;
            const auto type = frame_type(packet.kind);
            if (!type) continue;
            switch (rules_of(*type).refers_to) {
                case RefersTo::nothing:
                    EXPECT_EQ(packet.reference, packet.frame) << stream;
                    break;
                case RefersTo::reference:
                    EXPECT_EQ(packet.reference, reference) << stream;
                    break;
                case RefersTo::reference_or_before:
                    // The last one alone, but in groups.
                    if (version < grouped_version && before.size() > 1) before.erase(before.begin(), before.end() - 1);
                    EXPECT_TRUE(packet.reference == reference ||
                                std::find(before.begin(), before.end(), packet.reference) != before.end())
                        << stream;
                    break;
            }
            if (!is_referred(packet, rules_of(*type))) continue;
            if (rules_of(*type).renews) {
                reference = packet.frame;
                before.clear();
            } else {
                before.push_back(packet.frame);
            }
        }
    }
}

}  // namespace
}  // namespace htvm::internal
