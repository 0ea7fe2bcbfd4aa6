#include <gtest/gtest.h>

#include "htvm/audio.hpp"
#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"

namespace htvm {
namespace {

// Music of 20 ms a packet.
AudioPacket two_packets() { return {2, -256, 312, 100, {{0xf8, 1, 2, 3}, {0xf8}}}; }

TEST(AudioPacket, ComesBack) {
    const auto packet = write_audio(two_packets(), 7, -6500);
    EXPECT_EQ(packet.frame, 7u);
    EXPECT_EQ(packet.timestamp_us, -6500);
    EXPECT_EQ(packet.flags, packet_flag::flags_valid | packet_flag::droppable);
    const auto audio = read_audio(packet);
    ASSERT_TRUE(audio) << audio.error().message;
    EXPECT_EQ(*audio, two_packets());
    EXPECT_EQ(audio->samples(), 1920u);
}

TEST(AudioPacket, CutShortAnywhereIsAnError) {
    const auto whole = write_audio(two_packets(), 0, 0);
    for (std::size_t size = 0; size < whole.payload.size(); ++size) {
        auto packet = whole;
        packet.payload.resize(size);
        EXPECT_FALSE(read_audio(packet)) << size;
    }
}

TEST(AudioPacket, NoMoreIsLeftOutThanThereIs) {
    auto audio = two_packets();
    audio.skip_begin = 1900;
    EXPECT_FALSE(read_audio(write_audio(audio, 0, 0)));
    audio.skip_begin = 1820;
    EXPECT_TRUE(read_audio(write_audio(audio, 0, 0)));
}

TEST(AudioPacket, OtherCodersAreUnsupported) {
    auto packet = write_audio(two_packets(), 0, 0);
    packet.payload[0] = 2;
    const auto audio = read_audio(packet);
    ASSERT_FALSE(audio);
    EXPECT_EQ(audio.error().kind, ErrorKind::unsupported);
}

TEST(AudioPacket, NoFrameNeedsIt) {
    const auto sound = write_audio(two_packets(), 0, 0);
    Decoder decoder;
    const auto decoded = decoder.decode(sound);
    ASSERT_TRUE(decoded);
    EXPECT_FALSE(*decoded);
    PacketHeader header, intra, tracked;
    header.flags = intra.flags = tracked.flags = packet_flag::flags_valid | packet_flag::referred;
    intra.kind = PacketKind::intra;
    tracked.kind = PacketKind::tracked;
    tracked.frame = 1;
    const std::vector<PacketHeader> packets = {header, intra, sound, tracked, sound};
    EXPECT_EQ(closure(packets, 3), (std::vector<std::size_t>{0, 1, 3}));
    EXPECT_TRUE(closure(packets, 4).empty());
}

}  // namespace
}  // namespace htvm
