// An .mp4 as the packets of its stream, byte for byte those that it was made of (docs/mp4.md).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/mp4_tables.h"

namespace htvm {

class Mp4Packets {
public:
    // goes_on: the samples follow those of another file, so nothing of what its record of the configuration has, which
    // is for who begins here, is given out. max_packet_bytes: larger packets are left out.
    static Result<Mp4Packets> open(FileBytes file, std::uint64_t max_packet_bytes, bool goes_on = false);
    // The packets of the next frame, or some bytes of them, for a PacketReader; nothing at the end.
    std::optional<std::vector<std::uint8_t>> next();
    // Bytes that could not be read, and packets whose other part, in a track that is there, was not found.
    std::uint64_t damaged_bytes() const { return damaged_; }
    // Among these, those of packets whose other part lies behind the end of a file that is cut short.
    std::uint64_t cut_off_bytes() const { return cut_off_; }
    // Bytes behind the end of a file that is cut short.
    std::uint64_t missing_bytes() const { return missing_; }

private:
    struct Other {
        std::size_t track = 0;
        std::size_t next = 0;                   // of its samples
        std::vector<std::uint64_t> ends = {0};  // bytes of the samples up to each
        bool has_ended = false;                 // a packet was looked for behind its last sample
    };
    struct Rebuilt {
        std::vector<std::uint8_t> bytes;
        bool has_header = false;
    };
    Rebuilt rebuilt(std::span<const std::uint8_t> sample);
    bool rebuild_parted(std::span<const std::uint8_t> parted, std::size_t prefix, std::vector<std::uint8_t>& out);
    std::optional<std::vector<std::uint8_t>> find_payload(Other& other, std::span<const std::uint8_t> beginning,
                                                          std::size_t bytes, std::size_t samples, std::uint32_t crc);
    std::vector<std::uint8_t> configuration(const Mp4Sample& first, bool has_header) const;

    FileBytes file_;
    std::uint64_t max_packet_bytes_ = 0, damaged_ = 0, cut_off_ = 0, missing_ = 0;
    std::uint64_t in_vain_ = 0;  // bytes read for packets that they are not of
    std::vector<Mp4Track> tracks_;
    std::size_t meshes_ = 0;  // which of the tracks
    std::vector<Other> others_;
    std::size_t next_ = 0;  // of the samples of meshes
    bool goes_on_ = false;
};

}  // namespace htvm
