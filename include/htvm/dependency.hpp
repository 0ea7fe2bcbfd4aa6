// What a frame needs to be decoded, determined from packet headers alone: for programs that handle loss, seek, cut,
// join late, forward or record a stream without decoding it. The rule is docs/bitstream.md, section 2.2: a frame needs
// the sequence header, the packet that `reference` in its header names, what that one needs, and, for an EP-frame, the
// codebooks in force. Pictures of textures (texture.hpp) need pictures alone, and no frame needs one.
//
//   htvm::Dependencies dependencies;
//   for each packet of a live stream:
//       store[dependencies.push(packet)] = bytes;
//       remove from the store what is not in dependencies.kept();
//   when a viewer joins: send store[place] for each place in dependencies.kept(), then each packet as it comes
//
// Threads and lifetimes. One object is used by one thread at a time. Spans that it gives are valid until the next call
// that changes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "htvm/packet.hpp"

namespace htvm {

// The packet's header with its flags. Packets of version 1 have none: there they are derived from the kind of packet
// and the payload.
PacketHeader header_with_flags(const Packet& packet);

// Takes the headers of a stream's packets one at a time, in order, and knows at any time what the newest frame needs
// and what later frames may need. Memory is bounded, since an I-frame makes all before it obsolete.
class Dependencies {
public:
    // most: packets held. If a frame would need more, no frame is known to be decodable until the next I-frame.
    explicit Dependencies(std::size_t most = std::size_t{1} << 16) : most_(most) {}

    // Returns the place of the packet: 0 for the first, and so on. Do not push packets that were lost. A header of
    // version 1 alone, without its payload, does not tell a repeated sequence header from a different one, so a new
    // sequence is recognised only by frame numbers that start again; nor does it tell codebooks apart, so all since the
    // I-frame count.
    std::uint64_t push(const PacketHeader& header);
    std::uint64_t push(const Packet& packet) { return push(header_with_flags(packet)); }

    // Number of sequences that have begun; the last packet belongs to the last of them.
    std::uint32_t sequences() const { return sequences_; }
    // The places of exactly the packets that the newest frame needs, in the order in which to decode them: the sequence
    // header first, the frame last. Empty if it cannot be decoded from what was pushed, and before any frame.
    std::vector<std::uint64_t> closure() const;
    // The same for the newest picture: the header, and the pictures from the last key picture on. Empty if there is
    // none since the sequence began, or one that it needs did not come.
    std::vector<std::uint64_t> picture_closure() const;
    // The places of the packets that later frames and pictures may need, in the same order; all others can be
    // forgotten. A viewer that joins late must be sent these.
    std::vector<std::uint64_t> kept() const;

private:
    struct Frame {
        std::uint32_t number;
        std::uint64_t place;
    };
    struct Codebooks {
        std::array<std::optional<std::uint64_t>, 2> marked;  // in force: of geometry, of colours
        std::size_t unmarked = 0;                            // how many of unmarked_codebooks_ there were
    };
    // What the newest frame needs of the packets held.
    struct Newest {
        std::uint64_t place = 0;
        std::size_t references = 0;  // of references_
        Codebooks codebooks = {};
        std::size_t chained = 0;  // frames of chain_ that it needs
        bool known = false;
    };
    void begin_sequence();
    void push_header(const PacketHeader& header, std::uint64_t place);
    void push_codebook(const PacketHeader& header, std::uint64_t place);
    void push_frame(const PacketHeader& header, std::uint64_t place);
    void push_picture(const PacketHeader& header, std::uint64_t place);
    void forget_reference();
    std::size_t chained_up_to(std::uint32_t number) const;
    std::vector<std::uint64_t> places(std::size_t references, const Codebooks& codebooks, std::size_t chained) const;

    std::size_t most_;
    std::uint64_t pushed_ = 0;
    std::uint32_t sequences_ = 0;
    struct HeaderInForce {
        std::uint64_t place;
        std::optional<std::uint32_t> crc;  // none: the header does not say
        bool session;
    };
    std::optional<HeaderInForce> header_;
    std::optional<std::uint32_t> highest_frame_;
    std::vector<Frame> references_;                  // the I-frame, and the frames that patched it, each referring to
                                                     // the one before; the last is in force
    std::vector<Frame> chain_;                       // T-frames since, each referring to the one before; the last group
                                                     // may have some that the next one does not need
    Codebooks codebooks_;                            // since the I-frame
    std::vector<std::uint64_t> unmarked_codebooks_;  // since the I-frame, whose flags do not say of what they are
    Newest newest_;
    std::vector<Frame> pictures_;  // that later ones may need: a key picture, then each referring to the one before
    struct NewestPicture {
        std::uint64_t place;
        std::size_t before;  // how many of pictures_ it needs besides itself
    };
    std::optional<NewestPicture> newest_picture_;
};

// The same for a list: the places in `packets` of exactly what packets[frame] needs, a frame or a picture, itself last.
// Empty if it cannot be decoded from these, or is neither.
std::vector<std::size_t> closure(std::span<const PacketHeader> packets, std::size_t frame);

}  // namespace htvm
