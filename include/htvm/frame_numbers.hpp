// Numbers the frames of a whole stream. Each of its sequences has its own numbers; where these start again, the frames
// are numbered on from the sequence before.
//
// Threads and lifetimes. One object is used by one thread at a time; copies are independent.
#pragma once

#include <cstddef>
#include <cstdint>

#include "htvm/dependency.hpp"
#include "htvm/packet.hpp"

namespace htvm {

class FrameNumbers {
public:
    // Every packet of the stream must be pushed, in order. A header must have its flags: header_with_flags().
    void push(const Packet& packet) { push(header_with_flags(packet)); }
    void push(const PacketHeader& header);
    // Begins in the middle of a stream: the next frame, with its own number `frame`, has the number `number`.
    void begin(std::uint32_t frame, std::uint32_t number) { offset_ = number - frame; }

    // The number in the stream of a frame, given its own number in the sequence of the last packet.
    std::uint32_t of(std::uint32_t frame) const { return offset_ + frame; }
    // Whether the last packet is the first frame of a sequence.
    bool begins_sequence() const { return begins_; }
    const Dependencies& dependencies() const { return dependencies_; }

private:
    Dependencies dependencies_;
    std::uint32_t in_force_ = 0;  // Dependencies::sequences() at the last frame
    std::uint32_t offset_ = 0, highest_ = 0;
    bool any_ = false, begins_ = false;
};

}  // namespace htvm
