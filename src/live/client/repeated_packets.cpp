#include "live/client/repeated_packets.h"

#include "htvm/decoder.hpp"

namespace htvm::live {

bool RepeatedPackets::is_repeat(const PacketHeader& header) {
    if (header.kind == PacketKind::sequence) {
        if (header_ && header.reference == *header_ && header.has(packet_flag::session)) return true;
        header_ = header.has(packet_flag::session) ? std::optional(header.reference) : std::nullopt;
        frame_.reset();
        audio_us_.reset();
        picture_.reset();
        return false;
    }
    if (!header_) return false;
    if (header.kind == PacketKind::audio) {
        if (audio_us_ && header.timestamp_us <= *audio_us_) return true;
        audio_us_ = header.timestamp_us;
        return false;
    }
    if (header.kind == PacketKind::texture) {
        if (picture_ && header.frame <= *picture_) return true;
        picture_ = header.frame;
        return false;
    }
    if (frame_ && header.frame <= *frame_) return true;
    if (frame_type(header.kind)) frame_ = header.frame;
    return false;
}

}  // namespace htvm::live
