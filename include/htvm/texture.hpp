// The pictures of a textured stream: packets beside the frames, each with the picture of one frame, for programs that
// make, cut, check or show streams. The decoder passes over them; players hand their bytes to a decoder of video or of
// images. docs/bitstream.md, section 14, is normative.
//
// Threads and lifetimes. Functions keep no state: any thread may call them at any time. A TexturePicture lends the
// bytes that it was read from.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm {

// What coded a picture, by the numbers of the stream.
enum class PictureCoder : std::uint8_t {
    av1 = 1,   // one temporal unit of low-overhead OBUs; key pictures begin with a sequence header OBU
    vp9 = 2,   // one frame, or a superframe that shows one
    h264 = 3,  // one access unit: NAL units, each behind its size in four bytes; key pictures begin with parameter sets
    png = 16,  // image files as they came
    jpeg = 17,
    webp = 18,
};
// "AV1", "VP9", "H.264", "PNG", "JPEG", "WebP".
const char* name_of(PictureCoder coder);
// Whether pictures may need those before them; image files never do.
constexpr bool is_video(PictureCoder coder) { return static_cast<std::uint8_t>(coder) < 16; }

// From the planes of a video to red, green, blue. The numbers are those of the stream, and of ITU-T H.273.
enum class ColourMatrix : std::uint8_t { none = 0, bt709 = 1, bt601 = 6 };

inline constexpr std::uint32_t most_picture_side = 4096;  // pixels
inline constexpr std::uint16_t picture_gain_one = 4096;

struct TexturePicture {
    PictureCoder coder = PictureCoder::av1;
    ColourMatrix matrix = ColourMatrix::bt709;  // none for image files
    bool full_range = false;                    // of the planes: 0..255, not 16..235 and 16..240
    std::uint32_t width = 0, height = 0;        // pixels, 1..most_picture_side
    // For red, green, blue: whoever shows the picture multiplies its values (sRGB, 0..255) by gain / picture_gain_one.
    std::array<std::uint16_t, 3> gains = {picture_gain_one, picture_gain_one, picture_gain_one};
    std::span<const std::uint8_t> coded;  // what the coder wrote: on loan from whoever gave it out, at least one byte
};

// Where a picture stands in the stream. Its packet comes behind that of its frame, before the next frame's.
struct PicturePlace {
    std::uint32_t frame = 0;
    std::uint32_t reference = 0;  // number of the frame of the picture that it needs, the one before; its own: it needs
                                  // none, and is a key picture
    std::int64_t timestamp_us = 0;  // of its frame
    bool referred = true;           // whether later pictures may need it
};

Packet write_texture_picture(const TexturePicture& picture, const PicturePlace& place);
// `coded` is on loan from the payload. corrupt_stream: the payload ends early, or a field is out of its range;
// unsupported: it is of a coder or colour matrix that is not known.
Result<TexturePicture> read_texture_picture(const PacketHeader& header, std::span<const std::uint8_t> payload);
inline Result<TexturePicture> read_texture_picture(const Packet& packet) {
    return read_texture_picture(packet, packet.payload);
}

// Whether a packet is a picture that needs no other.
inline bool is_key_picture(const PacketHeader& header) {
    return header.kind == PacketKind::texture && header.reference == header.frame;
}

}  // namespace htvm
