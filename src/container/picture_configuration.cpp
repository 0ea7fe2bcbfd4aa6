#include "container/picture_configuration.h"

#include "container/box.h"

namespace htvm {
namespace {

constexpr unsigned obu_sequence_header = 1, obu_temporal_delimiter = 2;

// ---- AV1: open bitstream units --------------------------------------------------------------------------------------

struct Unit {
    unsigned type = 0;
    std::span<const std::uint8_t> whole, payload;
};

// The unit that the bytes begin with, if it says its size; nothing if not, or if it is cut short.
std::optional<Unit> first_unit(std::span<const std::uint8_t> bytes) {
    if (bytes.empty() || (bytes[0] & 0x80) != 0 || (bytes[0] & 2) == 0) return std::nullopt;
    std::size_t at = (bytes[0] & 4) != 0 ? 2 : 1;
    std::uint64_t size = 0;
    for (int shift = 0;; shift += 7) {
        if (at >= bytes.size() || shift > 28) return std::nullopt;
        const auto byte = bytes[at++];
        size |= std::uint64_t{byte & 0x7fu} << shift;
        if ((byte & 0x80) == 0) break;
    }
    if (size > bytes.size() - at) return std::nullopt;
    const auto end = at + static_cast<std::size_t>(size);
    return Unit{(bytes[0] >> 3) & 15u, bytes.first(end), bytes.subspan(at, end - at)};
}

// Bits, the most significant first. Zero past the end.
struct Bits {
    std::span<const std::uint8_t> bytes;
    std::size_t at = 0;
    unsigned take(unsigned n) {
        unsigned out = 0;
        for (; n > 0; --n, ++at) out = out << 1 | (at / 8 < bytes.size() ? (bytes[at / 8] >> (7 - at % 8)) & 1u : 0u);
        return out;
    }
    void skip_variable_length() {  // uvlc()
        unsigned zeros = 0;
        while (zeros < 32 && take(1) == 0) ++zeros;
        at += zeros;
    }
};

struct Level {
    unsigned profile = 0, level = 0, tier = 0;
};

// The AV1 specification, 5.5.1, up to the level of the first operating point.
Level level_of(std::span<const std::uint8_t> sequence_header) {
    Bits in{sequence_header};
    Level out;
    out.profile = in.take(3);
    in.take(1);             // still_picture
    if (in.take(1) != 0) {  // reduced_still_picture_header
        out.level = in.take(5);
        return out;
    }
    unsigned delay_bits = 0;
    const bool timing = in.take(1) != 0;
    bool decoder_model = false;
    if (timing) {
        in.take(32);
        in.take(32);
        if (in.take(1) != 0) in.skip_variable_length();
        decoder_model = in.take(1) != 0;
        if (decoder_model) {
            delay_bits = in.take(5) + 1;
            in.take(32);
            in.take(5);
            in.take(5);
        }
    }
    (void)delay_bits;
    in.take(1);   // initial_display_delay_present_flag
    in.take(5);   // operating_points_cnt_minus_1
    in.take(12);  // operating_point_idc
    out.level = in.take(5);
    if (out.level > 7) out.tier = in.take(1);
    return out;
}

std::optional<std::vector<std::uint8_t>> av1_configuration(std::span<const std::uint8_t> coded) {
    while (const auto unit = first_unit(coded)) {
        coded = coded.subspan(unit->whole.size());
        if (unit->type != obu_sequence_header) continue;
        const auto level = level_of(unit->payload);
        if (level.profile != 0) return std::nullopt;
        BoxWriter out;
        out.u8(0x81);  // marker, version 1
        out.u8(level.profile << 5 | level.level);
        out.u8(level.tier << 7 | 0x0c);  // 8 bits, 4:2:0: the stream has no others
        out.u8(0);
        out.bytes(unit->whole);
        return out.take();
    }
    return std::nullopt;
}

// ---- VP9 ------------------------------------------------------------------------------------------------------------

// The smallest level whose pictures may be as large, at 30 a second.
unsigned vp9_level(std::uint32_t width, std::uint32_t height) {
    struct Row {
        unsigned level;
        std::uint32_t pixels;
    };
    constexpr Row rows[] = {{10, 36864},  {11, 73728},   {20, 122880},  {21, 245760},  {30, 552960},
                            {31, 983040}, {40, 2228224}, {50, 8912896}, {60, 35651584}};
    for (const auto& row : rows)
        if (width * height <= row.pixels) return row.level;
    return 62;
}

std::vector<std::uint8_t> vp9_configuration(const TexturePicture& key) {
    constexpr unsigned bits = 8, chroma_420 = 1, bt709 = 1, srgb = 13;
    BoxWriter out;
    out.u8(1);  // version
    out.u24(0);
    out.u8(0);  // profile
    out.u8(vp9_level(key.width, key.height));
    out.u8(bits << 4 | chroma_420 << 1 | (key.full_range ? 1u : 0u));
    out.u8(bt709);
    out.u8(srgb);
    out.u8(static_cast<std::uint8_t>(key.matrix));
    out.u16(0);
    return out.take();
}

// ---- H.264: NAL units, each behind its size in four bytes -----------------------------------------------------------

constexpr unsigned nal_sequence_parameters = 7, nal_picture_parameters = 8;

// The record of ISO/IEC 14496-15, 5.3.3.1, of the first parameter sets.
std::optional<std::vector<std::uint8_t>> h264_configuration(std::span<const std::uint8_t> coded) {
    constexpr std::size_t size_bytes = 4, longest = 0xffff, shortest = 4;
    std::span<const std::uint8_t> sequence, picture;
    while (!coded.empty()) {
        if (coded.size() < size_bytes) return std::nullopt;
        const auto size =
            std::size_t{coded[0]} << 24 | std::size_t{coded[1]} << 16 | std::size_t{coded[2]} << 8 | coded[3];
        coded = coded.subspan(size_bytes);
        if (size < 1 || size > coded.size()) return std::nullopt;
        const auto unit = coded.first(size);
        coded = coded.subspan(size);
        const auto type = unit[0] & 31u;
        if (type == nal_sequence_parameters && sequence.empty()) sequence = unit;
        if (type == nal_picture_parameters && picture.empty()) picture = unit;
    }
    if (sequence.size() < shortest || picture.empty() || sequence.size() > longest || picture.size() > longest)
        return std::nullopt;
    constexpr unsigned baseline = 66, main = 77, high = 100;
    const unsigned profile = sequence[1];
    if (profile != baseline && profile != main && profile != high) return std::nullopt;
    BoxWriter out;
    out.u8(1);  // version
    out.bytes(sequence.subspan(1, 3));
    out.u8(0xfc | (size_bytes - 1));
    out.u8(0xe0 | 1);
    out.u16(static_cast<std::uint16_t>(sequence.size()));
    out.bytes(sequence);
    out.u8(1);
    out.u16(static_cast<std::uint16_t>(picture.size()));
    out.bytes(picture);
    if (profile == high) {
        out.u8(0xfc | 1);  // 4:2:0
        out.u8(0xf8);      // 8 bits, of luma and of chroma
        out.u8(0xf8);
        out.u8(0);
    }
    return out.take();
}

}  // namespace

std::optional<std::vector<std::uint8_t>> picture_configuration(const TexturePicture& key) {
    if (key.coder == PictureCoder::av1) return av1_configuration(key.coded);
    if (key.coder == PictureCoder::vp9) return vp9_configuration(key);
    if (key.coder == PictureCoder::h264) return h264_configuration(key.coded);
    return std::nullopt;
}

VideoEntry video_entry_of(PictureCoder coder) {
    switch (coder) {
        case PictureCoder::vp9:
            return {four("vp09"), four("vpcC"), "VP9"};
        case PictureCoder::h264:
            return {four("avc3"), four("avcC"), "H.264"};
        default:
            return {four("av01"), four("av1C"), "AV1"};
    }
}

bool is_picture_entry(std::uint32_t sample_entry) {
    return sample_entry == four("av01") || sample_entry == four("vp09") || sample_entry == four("avc3");
}

std::size_t delimiter_bytes(const TexturePicture& picture) {
    if (picture.coder != PictureCoder::av1) return 0;
    const auto unit = first_unit(picture.coded);
    return unit && unit->type == obu_temporal_delimiter ? unit->whole.size() : 0;
}

}  // namespace htvm
