// Streams in files, read from any frame on: only what that frame and those behind it need is read.
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "htvm/packet.hpp"
#include "htvm/result.hpp"
#include "htvm/stream_index.hpp"
#include "stream_file.h"

namespace htvm::app {

// A file whose packets are found by their headers; payloads are read when asked for.
class SeekableStream {
public:
    // Nothing if the name is that of a pipe or device, or of nothing that can be read.
    static std::optional<SeekableStream> open(const std::string& path, std::uint64_t max_packet_bytes);

    struct Place {
        PacketHeader header;  // as header_with_flags() tells it
        std::uint64_t offset = 0, bytes = 0;
        std::uint64_t end() const { return offset + bytes; }
    };
    // The packet that begins there; nothing at the end of the file, or if none begins there.
    std::optional<Place> at(std::uint64_t offset);
    // The picture behind the frame that lies there; nothing if it has none.
    std::optional<Place> picture_behind(std::uint64_t offset);
    // The whole packet; nothing if it is damaged.
    std::optional<Packet> read(const Place& place);
    // The index at this place of the file, and where what it is about begins.
    struct Index {
        StreamIndex index;
        std::uint64_t begin = 0;
        std::uint64_t end() const { return begin + index.bytes; }
    };
    std::optional<Index> index_at(std::uint64_t offset);
    std::uint64_t size() const { return size_; }

private:
    std::ifstream file_;
    std::uint64_t size_ = 0, max_packet_bytes_ = 0;
};

// Where to begin for a frame: the packets before it that it and later frames need, and where it lies itself.
struct StreamStart {
    std::vector<std::uint64_t> needed;  // places of packets, in the order to decode them, the sequence header first
    std::uint64_t go_on = 0;            // from here on packet by packet
    // The own number of the first frame at or behind the one asked for, and its number in the whole stream; the same of
    // the first of all frames that are needed for it.
    std::uint32_t frame = 0, number = 0;
    std::uint32_t first_needed_frame = 0, first_needed_number = 0;
    std::uint64_t promised = 0;  // frames of the whole stream, by its indices; 0: not known
};
// frame: numbered through the whole file. Nothing if there is no such frame, or damage lies between.
std::optional<StreamStart> find_start(SeekableStream& stream, std::uint64_t frame);

// Makes the input of this file go on with that frame: first come the packets that it needs, then the file from there
// on. Nothing if that cannot be done, as for pipes and damaged streams: then the input is as it was.
std::optional<StreamStart> go_to_frame(StreamInput& input, const std::string& path, std::uint64_t frame,
                                       std::uint64_t max_packet_bytes);

}  // namespace htvm::app
