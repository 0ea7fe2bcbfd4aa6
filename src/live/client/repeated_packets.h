// Tells packets that came before: whoever connects again is sent what the newest frame needs, most of which it has.
#pragma once

#include <cstdint>
#include <optional>

#include "htvm/packet.hpp"

namespace htvm::live {

// Takes the headers of all packets of a stream that come, as header_with_flags() has them. In a sequence with a
// session, packets of frames up to the last one that came are repeats; without a session such frames begin another
// sequence (docs/bitstream.md, section 2, Order).
class RepeatedPackets {
public:
    // Whether the packet came before. Else it counts as having come.
    bool is_repeat(const PacketHeader& header);

private:
    std::optional<std::uint32_t> header_;   // the CRC of the one in force, if it has a session
    std::optional<std::uint32_t> frame_;    // the last one's number
    std::optional<std::int64_t> audio_us_;  // of the last sound
    std::optional<std::uint32_t> picture_;  // the last picture's frame
};

}  // namespace htvm::live
