#include "codec/format/sequence.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#include "core/bytes.h"
#include "core/crc32.h"
#include "htvm/texture.hpp"

namespace htvm::internal {
namespace {

constexpr std::array<std::uint8_t, 4> magic = {'h', 't', 'v', 'm'};
constexpr std::size_t max_name = 255;
constexpr std::size_t max_joints = 1024;

// Bits that say which optional fields follow.
constexpr std::uint8_t has_floor = 1, has_metadata = 2, has_global_shift = 4;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string text_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

// The shortest form of each code point, none of the surrogates, none beyond U+10FFFF, and no zero.
bool is_utf8(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const auto byte = [&](std::size_t i) -> std::uint32_t {
            return at + i < text.size() ? static_cast<std::uint8_t>(text[at + i]) : 0;
        };
        const std::uint32_t first = byte(0);
        const std::size_t length = first < 0x80       ? 1
                                   : first >> 5 == 6  ? 2
                                   : first >> 4 == 14 ? 3
                                   : first >> 3 == 30 ? 4
                                                      : 0;
        if (length == 0 || first == 0) return false;
        std::uint32_t point = length == 1 ? first : first & (0x7Fu >> length);
        for (std::size_t i = 1; i < length; ++i) {
            if (byte(i) >> 6 != 2) return false;
            point = point << 6 | (byte(i) & 0x3F);
        }
        constexpr std::array<std::uint32_t, 5> least = {0, 0, 0x80, 0x800, 0x10000};
        if (point < least[length] || point > 0x10FFFF || (point >= 0xD800 && point < 0xE000)) return false;
        at += length;
    }
    return true;
}

void write_metadata(ByteWriter& out, std::span<const MetadataEntry> metadata) {
    out.u8(static_cast<std::uint8_t>(metadata.size()));
    for (const auto& entry : metadata) {
        out.u8(static_cast<std::uint8_t>(entry.key.size()));
        out.bytes(bytes_of(entry.key));
        out.u16(static_cast<std::uint16_t>(entry.value.size()));
        out.bytes(bytes_of(entry.value));
    }
}

Result<std::vector<MetadataEntry>> read_metadata(ByteReader& in) {
    std::vector<MetadataEntry> out;
    for (std::size_t left = in.u8(); left > 0 && in.ok(); --left) {
        MetadataEntry entry;
        entry.key = text_of(in.bytes(in.u8()));
        entry.value = text_of(in.bytes(in.u16()));
        out.push_back(std::move(entry));
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "sequence header: it ends too early");
    if (auto fine = check_metadata(out); !fine)
        return fail(ErrorKind::corrupt_stream, "sequence header: " + fine.error().message);
    return out;
}

// What version 2 has behind the spacing of the nodes. Returns the bits of the optional fields.
Result<std::uint8_t> read_what_version_2_added(ByteReader& in, SequenceHeader& out) {
    out.session = in.u64();
    const auto up = in.u8(), has = in.u8();
    if (up > static_cast<std::uint8_t>(UpAxis::minus_z))
        return fail(ErrorKind::corrupt_stream, "sequence header: there is no such axis");
    out.up = static_cast<UpAxis>(up);
    if (has & has_floor) {
        out.floor = static_cast<std::int32_t>(in.u32());
        if (std::abs(std::int64_t{*out.floor}) > lattice_limit || out.up == UpAxis::unknown)
            return fail(ErrorKind::corrupt_stream, "sequence header: the floor is out of range");
    }
    if (has & has_metadata) {
        auto metadata = read_metadata(in);
        if (!metadata) return tl::unexpected(metadata.error());
        out.metadata = std::move(*metadata);
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "sequence header: it ends too early");
    return has;
}

// At the end, where decoders that do not know it leave it.
Result<void> read_global_shift(ByteReader& in, GlobalShift& out) {
    for (auto& c : out) c = static_cast<std::int64_t>(in.u64());
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "sequence header: it ends too early");
    if (std::any_of(out.begin(), out.end(), [](auto c) { return c < -most_global_shift || c > most_global_shift; }))
        return fail(ErrorKind::corrupt_stream, "sequence header: the global shift is out of range");
    return {};
}

Result<StreamTexture> read_texture(ByteReader& in, std::uint16_t version) {
    const auto layout = in.varint(), width = in.varint(), height = in.varint();
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "sequence header: it ends too early");
    const auto newest = version >= projected_version ? TextureLayout::projection : TextureLayout::charts;
    if (layout > static_cast<std::uint64_t>(newest))
        return fail(ErrorKind::unsupported,
                    "sequence header: this decoder does not know texture layout " + std::to_string(layout));
    const bool textured = layout != static_cast<std::uint64_t>(TextureLayout::none);
    const std::uint64_t least = textured ? 1 : 0, most = textured ? most_picture_side : 0u;
    if (std::min(width, height) < least || std::max(width, height) > most)
        return fail(ErrorKind::corrupt_stream, "sequence header: the size of the texture's pictures is out of range");
    return StreamTexture{static_cast<TextureLayout>(layout), static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace

Result<void> check_metadata(std::span<const MetadataEntry> metadata) {
    const auto refuse = [](const std::string& what) { return fail(ErrorKind::bad_input, "metadata: " + what); };
    if (metadata.size() > most_metadata)
        return refuse("there are more than " + std::to_string(most_metadata) + " entries");
    std::size_t all = 0;
    for (const auto& [key, value] : metadata) {
        if (key.empty() || key.size() > most_key_bytes)
            return refuse("a key has 1 to " + std::to_string(most_key_bytes) + " bytes");
        if (!is_utf8(key)) return refuse("a key is not UTF-8");
        if (value.size() > most_value_bytes)
            return refuse("'" + key + "' has more than " + std::to_string(most_value_bytes) + " bytes");
        if (!is_utf8(value)) return refuse("'" + key + "' is not UTF-8");
        all += key.size() + value.size();
    }
    if (all > most_metadata_bytes) return refuse("it has more than " + std::to_string(most_metadata_bytes) + " bytes");
    return {};
}

std::vector<std::uint8_t> write_sequence_header(const SequenceHeader& header) {
    ByteWriter out;
    out.bytes(magic);
    out.u16(std::max(header.version, session_version));
    out.u8(static_cast<std::uint8_t>(header.lattice.bits));
    for (const auto c : header.lattice.origin) out.u32(static_cast<std::uint32_t>(c));
    out.u32(header.fps_numerator);
    out.u32(header.fps_denominator);
    out.u32(header.unit_micrometres);
    out.u8(header.nearest_vertices);
    out.u32(static_cast<std::uint32_t>(header.weight_width));
    out.u8(header.has_skeleton);
    out.u16(static_cast<std::uint16_t>(header.skeleton.joint_names.size()));
    for (const auto& name : header.skeleton.joint_names) {
        const auto length = std::min(name.size(), max_name);
        out.u8(static_cast<std::uint8_t>(length));
        out.bytes({reinterpret_cast<const std::uint8_t*>(name.data()), length});
    }
    out.u16(static_cast<std::uint16_t>(header.skeleton.bones.size()));
    for (std::size_t i = 0; i < header.skeleton.bones.size(); ++i) {
        out.u16(header.skeleton.bones[i].first);
        out.u16(header.skeleton.bones[i].second);
        out.u32(static_cast<std::uint32_t>(header.radii[i]));
    }
    out.u32(static_cast<std::uint32_t>(header.node_spacing));
    out.u64(header.session);
    out.u8(static_cast<std::uint8_t>(header.up));
    const bool is_shifted = header.global_shift != GlobalShift{};
    out.u8(static_cast<std::uint8_t>((header.floor ? has_floor : 0) | (header.metadata.empty() ? 0 : has_metadata) |
                                     (is_shifted ? has_global_shift : 0)));
    if (header.floor) out.u32(static_cast<std::uint32_t>(*header.floor));
    if (!header.metadata.empty()) write_metadata(out, header.metadata);
    if (header.version >= textured_version) {
        out.varint(static_cast<std::uint64_t>(header.texture.layout));
        out.varint(static_cast<std::uint64_t>(header.texture.width));
        out.varint(static_cast<std::uint64_t>(header.texture.height));
    }
    if (is_shifted)
        for (const auto c : header.global_shift) out.u64(static_cast<std::uint64_t>(c));
    return out.take();
}

Packet sequence_packet(const SequenceHeader& header) {
    Packet out;
    out.payload = write_sequence_header(header);
    out.reference = crc32(out.payload);
    out.flags = packet_flag::flags_valid;
    if (header.session != 0) out.flags |= packet_flag::session;
    return out;
}

Result<SequenceHeader> read_sequence_header(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    const auto bytes = in.bytes(magic.size());
    if (!in.ok() || !std::equal(bytes.begin(), bytes.end(), magic.begin()))
        return fail(ErrorKind::corrupt_stream, "sequence header: this is not an htvm stream");
    const auto version = in.u16();
    if (version < oldest_version || version > newest_version)
        return fail(ErrorKind::unsupported, "the stream has version " + std::to_string(version) +
                                                ", this decoder reads versions " + std::to_string(oldest_version) +
                                                " to " + std::to_string(newest_version) +
                                                (version > newest_version ? "; a newer htvm is needed" : ""));
    SequenceHeader out;
    out.version = version;
    out.lattice.bits = in.u8();
    for (auto& c : out.lattice.origin) c = static_cast<std::int32_t>(in.u32());
    out.fps_numerator = in.u32();
    out.fps_denominator = in.u32();
    out.unit_micrometres = in.u32();
    out.nearest_vertices = in.u8();
    const std::uint32_t weight_width = in.u32();
    out.has_skeleton = in.u8() != 0;
    const std::size_t joints = in.u16();
    if (!in.ok() || out.lattice.bits > 16 || out.fps_numerator == 0 || out.fps_denominator == 0 ||
        out.unit_micrometres == 0 || out.nearest_vertices < 1 || out.nearest_vertices > mtfan_max_nearest ||
        weight_width > static_cast<std::uint32_t>(lattice_limit) || joints > max_joints)
        return fail(ErrorKind::corrupt_stream, "sequence header: a field is out of range");
    out.weight_width = static_cast<std::int32_t>(weight_width);
    for (std::size_t k = 0; k < joints && in.ok(); ++k) {
        const auto name = in.bytes(in.u8());
        out.skeleton.joint_names.emplace_back(name.begin(), name.end());
    }
    const std::size_t bones = in.u16();
    if (bones == 0 || bones > max_joints)
        return fail(ErrorKind::corrupt_stream, "sequence header: no bones, or too many");
    for (std::size_t i = 0; i < bones && in.ok(); ++i) {
        Bone bone;
        bone.first = in.u16();
        bone.second = in.u16();
        const std::uint32_t radius = in.u32();
        if (bone.first >= joints || bone.second >= joints || radius > static_cast<std::uint32_t>(lattice_limit))
            return fail(ErrorKind::corrupt_stream, "sequence header: a bone is out of range");
        out.skeleton.bones.push_back(bone);
        out.radii.push_back(static_cast<std::int32_t>(radius));
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "sequence header: it ends too early");
    if (version > 1 || in.remaining() >= 4) {
        const std::uint32_t spacing = in.u32();
        if (spacing > static_cast<std::uint32_t>(lattice_limit))
            return fail(ErrorKind::corrupt_stream, "sequence header: the nodes' spacing is out of range");
        out.node_spacing = static_cast<std::int32_t>(spacing);
    }
    std::uint8_t has = 0;
    if (version > 1) {
        const auto read = read_what_version_2_added(in, out);
        if (!read) return tl::unexpected(read.error());
        has = *read;
    }
    if (version >= textured_version) {
        const auto texture = read_texture(in, version);
        if (!texture) return tl::unexpected(texture.error());
        out.texture = *texture;
    }
    if (has & has_global_shift)
        if (auto read = read_global_shift(in, out.global_shift); !read) return tl::unexpected(read.error());
    return out;
}

std::vector<std::uint8_t> write_sequence_index(std::span<const IndexEntry> entries) {
    ByteWriter out;
    out.varint(entries.size());
    IndexEntry last;
    for (const auto& entry : entries) {
        out.varint(entry.frame - last.frame);
        // Unsigned: any two timestamps have a difference that wraps, and stays defined.
        out.signed_varint(static_cast<std::int64_t>(static_cast<std::uint64_t>(entry.timestamp_us) -
                                                    static_cast<std::uint64_t>(last.timestamp_us)));
        out.varint(entry.offset - last.offset);
        last = entry;
    }
    return out.take();
}

Result<std::vector<IndexEntry>> read_sequence_index(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    std::vector<IndexEntry> out;
    IndexEntry entry;
    // Sums of what may be an attacker's numbers: unsigned, so that they wrap and stay defined.
    for (std::uint64_t left = in.varint(); left > 0 && in.ok(); --left) {
        entry.frame += static_cast<std::uint32_t>(in.varint());
        entry.timestamp_us = static_cast<std::int64_t>(static_cast<std::uint64_t>(entry.timestamp_us) +
                                                       static_cast<std::uint64_t>(in.signed_varint()));
        entry.offset += in.varint();
        if (in.ok()) out.push_back(entry);
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "index: it ends too early");
    return out;
}

}  // namespace htvm::internal
