#include "codec/stream/sequence_index.h"

#include "core/bytes.h"

namespace htvm::internal {

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

Result<NumberedCodebook> read_codebook_payload(std::span<const std::uint8_t> payload) {
    ByteReader in(payload);
    NumberedCodebook out;
    out.purpose = in.u8();
    const std::uint64_t number = in.varint();
    if (!in.ok() || out.purpose > codebook_for_colour || number > 0x7FFFFFFF)
        return fail(ErrorKind::corrupt_stream, "codebook: its purpose or number is out of range");
    out.number = static_cast<std::uint32_t>(number);
    auto codebook = decode_codebook(in.bytes(in.remaining()));
    if (!codebook) return tl::unexpected(codebook.error());
    out.codebook = std::move(*codebook);
    return out;
}

}  // namespace htvm::internal
