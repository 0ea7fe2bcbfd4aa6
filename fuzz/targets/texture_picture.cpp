// Packets of pictures: what is read is within the ranges that the format names, lies within the packet, and is the same
// after writing and reading again.
#include <algorithm>

#include "fuzz_input.h"
#include "htvm/texture.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    Packet packet;
    packet.kind = PacketKind::texture;
    packet.frame = input.below(4);
    packet.reference = input.below(4);
    const auto rest = input.rest();
    packet.payload.assign(rest.begin(), rest.end());
    const auto picture = read_texture_picture(packet);
    if (!picture) return 0;
    require(picture->width >= 1 && picture->width <= most_picture_side && picture->height >= 1 &&
                picture->height <= most_picture_side,
            "sides are within their range");
    require(!picture->coded.empty() &&
                picture->coded.data() + picture->coded.size() == packet.payload.data() + packet.payload.size(),
            "the coder's bytes are the packet's last");
    require(is_video(picture->coder) == (picture->matrix != ColourMatrix::none), "video has a matrix, images none");
    const auto written = write_texture_picture(*picture, {packet.frame, packet.reference, 0, true});
    const auto again = read_texture_picture(written);
    require(again && again->coder == picture->coder && again->matrix == picture->matrix &&
                again->full_range == picture->full_range && again->width == picture->width &&
                again->height == picture->height && again->gains == picture->gains &&
                std::equal(again->coded.begin(), again->coded.end(), picture->coded.begin(), picture->coded.end()),
            "a picture comes back");
    require(is_key_picture(written) == written.has(packet_flag::access), "key pictures can be started from");
    return 0;
}
