// The payload of packets of pictures. docs/bitstream.md, section 14.
#include "core/bytes.h"
#include "htvm/texture.hpp"

namespace htvm {

using namespace internal;
namespace {

constexpr std::uint8_t matrix_bits = 15, full_range_bit = 16;

tl::unexpected<Error> corrupt(const char* what) {
    return fail(ErrorKind::corrupt_stream, std::string("picture: ") + what);
}

bool is_known(PictureCoder coder) {
    using enum PictureCoder;
    return coder == av1 || coder == vp9 || coder == h264 || coder == png || coder == jpeg || coder == webp;
}

}  // namespace

const char* name_of(PictureCoder coder) {
    switch (coder) {
        case PictureCoder::av1:
            return "AV1";
        case PictureCoder::vp9:
            return "VP9";
        case PictureCoder::h264:
            return "H.264";
        case PictureCoder::png:
            return "PNG";
        case PictureCoder::jpeg:
            return "JPEG";
        case PictureCoder::webp:
            return "WebP";
    }
    return "unknown";
}

Packet write_texture_picture(const TexturePicture& picture, const PicturePlace& place) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>(picture.coder));
    out.u8(is_video(picture.coder) ? static_cast<std::uint8_t>(static_cast<unsigned>(picture.matrix) |
                                                               (picture.full_range ? unsigned{full_range_bit} : 0u))
                                   : std::uint8_t{0});
    out.varint(picture.width);
    out.varint(picture.height);
    for (const auto gain : picture.gains) out.u16(gain);
    out.bytes(picture.coded);
    Packet packet;
    packet.kind = PacketKind::texture;
    packet.flags = packet_flag::flags_valid | (place.referred ? packet_flag::referred : packet_flag::droppable);
    if (place.reference == place.frame) packet.flags |= packet_flag::access;
    packet.frame = place.frame;
    packet.reference = place.reference;
    packet.timestamp_us = place.timestamp_us;
    packet.payload = out.take();
    return packet;
}

Result<TexturePicture> read_texture_picture(const PacketHeader& header, std::span<const std::uint8_t> payload) {
    if (header.kind != PacketKind::texture) return corrupt("the packet is another");
    ByteReader in(payload);
    TexturePicture out;
    out.coder = static_cast<PictureCoder>(in.u8());
    const auto colours = in.u8();
    if (in.ok() && !is_known(out.coder))
        return fail(ErrorKind::unsupported,
                    "picture: coder " + std::to_string(static_cast<unsigned>(out.coder)) + " is not known");
    const auto width = in.varint(), height = in.varint();
    for (auto& gain : out.gains) gain = in.u16();
    if (!in.ok()) return corrupt("it ends too early");
    if (width < 1 || height < 1 || width > most_picture_side || height > most_picture_side)
        return corrupt("its width or height is out of range");
    out.width = static_cast<std::uint32_t>(width);
    out.height = static_cast<std::uint32_t>(height);
    out.matrix = ColourMatrix::none;
    if (is_video(out.coder)) {
        out.matrix = static_cast<ColourMatrix>(colours & matrix_bits);
        out.full_range = (colours & full_range_bit) != 0;
        if (out.matrix != ColourMatrix::bt709 && out.matrix != ColourMatrix::bt601)
            return fail(ErrorKind::unsupported,
                        "picture: colour matrix " + std::to_string(colours & matrix_bits) + " is not known");
    }
    if (!is_video(out.coder) && !is_key_picture(header)) return corrupt("an image file that needs another");
    out.coded = in.bytes(in.remaining());
    if (out.coded.empty()) return corrupt("there is nothing in it");
    return out;
}

}  // namespace htvm
