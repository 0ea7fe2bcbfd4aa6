// The small payloads of the stream: the index of I-frames at its end, and codebooks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/paper/codebook.h"
#include "htvm/result.hpp"

namespace htvm::internal {

// Where an I-frame's packet begins: bytes from the start of the stream. Seek there, once the sequence header is known.
struct IndexEntry {
    std::uint32_t frame = 0;
    std::int64_t timestamp_us = 0;
    std::uint64_t offset = 0;
    bool operator==(const IndexEntry&) const = default;
};
std::vector<std::uint8_t> write_sequence_index(std::span<const IndexEntry> entries);
Result<std::vector<IndexEntry>> read_sequence_index(std::span<const std::uint8_t> payload);

inline constexpr std::uint8_t codebook_for_geometry = 0;
inline constexpr std::uint8_t codebook_for_colour = 1;
struct NumberedCodebook {
    std::uint8_t purpose = codebook_for_geometry;
    std::uint32_t number = 0;  // EP-frames name it by this
    Codebook codebook;
};
std::vector<std::uint8_t> write_codebook_payload(std::uint8_t purpose, std::uint32_t number, const Codebook& codebook);
Result<NumberedCodebook> read_codebook_payload(std::span<const std::uint8_t> payload);

}  // namespace htvm::internal
