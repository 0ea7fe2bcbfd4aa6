// A whole stream as an .mp4 (docs/mp4.md).
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct Mp4Options {
    bool fragmented = false;      // in fragments, each with the tables of its own samples
    double fragment_seconds = 2;  // that a fragment lasts at least
};

// The packets of a stream, one after another; nothing at the end.
using PacketSource = std::function<std::optional<Packet>()>;
using ByteSink = std::function<Result<void>(std::span<const std::uint8_t>)>;

// Reads the stream twice: open() begins anew. index: the index in front, if there is one; those in the stream are left
// out at its beginning alone. bad_input if there is no frame.
Result<void> write_mp4(const std::function<Result<PacketSource>()>& open, const std::optional<Packet>& index,
                       const Mp4Options& options, const ByteSink& sink);

}  // namespace htvm
