#include "codec/stream/sequence.h"

#include <algorithm>
#include <array>

#include "core/bytes.h"

namespace htvm::internal {
namespace {

constexpr std::array<std::uint8_t, 4> magic = {'h', 't', 'v', 'm'};
constexpr std::size_t max_name = 255;
constexpr std::size_t max_joints = 1024;

}  // namespace

std::vector<std::uint8_t> write_sequence_header(const SequenceHeader& header) {
    ByteWriter out;
    out.bytes(magic);
    out.u16(stream_version);
    out.u8(static_cast<std::uint8_t>(header.lattice.bits));
    for (const auto c : header.lattice.origin) out.u32(static_cast<std::uint32_t>(c));
    out.u32(header.fps_numerator);
    out.u32(header.fps_denominator);
    out.u32(header.unit_micrometres);
    out.u8(header.nearest_vertices);
    out.u32(static_cast<std::uint32_t>(header.weight_width));
    out.u8(header.skeleton_tracked);
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
    if (header.node_spacing > 0) out.u32(static_cast<std::uint32_t>(header.node_spacing));
    return out.take();
}

Result<SequenceHeader> read_sequence_header(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    const auto bytes = in.bytes(magic.size());
    if (!in.ok() || !std::equal(bytes.begin(), bytes.end(), magic.begin()))
        return fail(ErrorKind::corrupt_stream, "sequence header: this is not an htvm stream");
    const auto version = in.u16();
    if (version != stream_version)
        return fail(ErrorKind::unsupported, "the stream has version " + std::to_string(version) +
                                                ", this decoder reads version " + std::to_string(stream_version));
    SequenceHeader out;
    out.lattice.bits = in.u8();
    for (auto& c : out.lattice.origin) c = static_cast<std::int32_t>(in.u32());
    out.fps_numerator = in.u32();
    out.fps_denominator = in.u32();
    out.unit_micrometres = in.u32();
    out.nearest_vertices = in.u8();
    const std::uint32_t weight_width = in.u32();
    out.skeleton_tracked = in.u8() != 0;
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
    if (in.remaining() >= 4) {
        const std::uint32_t spacing = in.u32();
        if (spacing > static_cast<std::uint32_t>(lattice_limit))
            return fail(ErrorKind::corrupt_stream, "sequence header: the nodes' spacing is out of range");
        out.node_spacing = static_cast<std::int32_t>(spacing);
    }
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
