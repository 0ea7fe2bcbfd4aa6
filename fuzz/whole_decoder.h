// Sends streams of bytes through the packet reader and the whole decoder, and checks what must hold for every frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/crc32.h"
#include "fuzz_input.h"
#include "htvm/decoder.hpp"

namespace htvm::fuzz {

using namespace internal;

inline std::vector<Packet> read_packets(std::span<const std::uint8_t> bytes, std::size_t piece) {
    PacketReader reader;
    std::vector<Packet> out;
    std::size_t of_packets = 0;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
        reader.push(bytes.subspan(at, std::min(piece, bytes.size() - at)));
        while (auto packet = reader.pull()) {
            of_packets += packet_overhead + packet->payload.size();
            out.push_back(std::move(*packet));
        }
    }
    require(of_packets + reader.damaged_bytes() + reader.pending_bytes() == bytes.size(),
            "every byte is part of a packet, damage, or pending");
    return out;
}

// A mesh as promised by include/htvm/mesh.hpp.
inline void require_sound(const Mesh& mesh, const DecoderOptions& limits) {
    const std::size_t vertices = mesh.positions.size();
    require(vertices <= limits.max_vertices && mesh.triangles.size() <= limits.max_triangles, "no more than allowed");
    for (const std::size_t size : {mesh.colours.size(), mesh.normals.size(), mesh.texcoords.size()})
        require(size == 0 || size == vertices, "attributes of every vertex or of none");
    for (const auto& p : mesh.positions)
        for (const float c : p) require(std::isfinite(c), "positions are finite");
    for (const auto& n : mesh.normals)
        for (const float c : n) require(std::isfinite(c), "normals are finite");
    for (const auto& t : mesh.triangles)
        for (const auto v : t) require(v < vertices, "triangles name vertices that are there");
}

inline void decode_all(const std::vector<Packet>& packets, const DecoderOptions& options) {
    Decoder decoder(options);
    std::uint32_t topology = 0;
    std::vector<Triangle> triangles;  // of the last frame
    for (const auto& packet : packets) {
        const auto frame = decoder.decode(packet);
        if (!frame) {
            require(!frame.error().message.empty(), "an error says what is wrong");
            if (const auto stand_in = decoder.conceal_copy(packet.frame, packet.timestamp_us)) {
                require_sound(stand_in->mesh, options);
                require(stand_in->concealed, "a stand-in says that it is one");
            }
            continue;
        }
        require(frame->has_value() == frame_type(packet.kind).has_value(), "frames and nothing else give frames");
        if (!*frame) continue;
        const auto& mesh = (*frame)->mesh;
        require_sound(copy_of(mesh), options);
        require((*frame)->topology != 0, "a frame has a topology number");
        require((*frame)->topology != topology ||
                    std::equal(mesh.triangles.begin(), mesh.triangles.end(), triangles.begin(), triangles.end()),
                "frames of one topology number have the same triangles");
        topology = (*frame)->topology;
        triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
        const auto& skeleton = decoder.sequence()->skeleton;
        require((*frame)->pose->joints.size() == skeleton.joint_names.size(), "one position a joint");
        require(inspect(packet).has_value(), "a frame that was decoded can be inspected");
    }
}

// Corrects the CRCs of everything that begins like a packet, so that the damage they would have caught reaches the
// decoder.
inline void repair_checksums(std::vector<std::uint8_t>& bytes) {
    const std::string sync = "HTVP";
    const auto put = [&](std::size_t at, std::uint32_t value) {
        for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
    };
    for (std::size_t at = 0; at + packet_overhead <= bytes.size();) {
        const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
        const auto found = std::search(begin, bytes.end(), sync.begin(), sync.end());
        at += static_cast<std::size_t>(found - begin);
        if (at + packet_overhead > bytes.size()) return;
        std::uint32_t size = 0;
        for (std::size_t i = 0; i < 4; ++i) size |= std::uint32_t{bytes[at + 24 + i]} << (8 * i);
        // A size beyond the end is reduced to what there is: otherwise most inputs would contain no packet.
        const auto most = static_cast<std::uint32_t>(bytes.size() - at - packet_overhead);
        if (size > most) put(at + 24, size = most);
        put(at + 28, crc32(std::span(bytes).subspan(at + 4, 24)));
        put(at + 32 + size, crc32(std::span(bytes).subspan(at + 32, size)));
        at += packet_overhead + size;
    }
}

}  // namespace htvm::fuzz
