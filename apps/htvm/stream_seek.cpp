#include "stream_seek.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/texture.hpp"

namespace htvm::app {

std::optional<SeekableStream> SeekableStream::open(const std::string& path, std::uint64_t max_packet_bytes) {
    std::error_code error;
    if (path == "-" || !std::filesystem::is_regular_file(path, error)) return std::nullopt;
    SeekableStream out;
    out.size_ = std::filesystem::file_size(path, error);
    // Without a buffer, which would read 8 KB behind every header.
    out.file_.rdbuf()->pubsetbuf(nullptr, 0);
    out.file_.open(path, std::ios::binary);
    out.max_packet_bytes_ = max_packet_bytes;
    if (error || !out.file_) return std::nullopt;
    return out;
}

std::optional<SeekableStream::Place> SeekableStream::at(std::uint64_t offset) {
    if (offset > size_ || size_ - offset < packet_overhead) return std::nullopt;
    std::array<std::uint8_t, packet_header_bytes> bytes;
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    if (!file_.read(reinterpret_cast<char*>(bytes.data()), bytes.size())) return std::nullopt;
    std::uint32_t payload_bytes = 0;
    const auto header = read_packet_header(bytes, payload_bytes);
    if (!header || payload_bytes > max_packet_bytes_ || payload_bytes > size_ - offset - packet_overhead)
        return std::nullopt;
    Place out{*header, offset, payload_bytes + packet_overhead};
    const bool by_payload = header->kind == PacketKind::sequence || header->kind == PacketKind::codebook;
    if (!header->has(packet_flag::flags_valid) && by_payload) {
        const auto whole = read(out);
        if (!whole) return std::nullopt;
        out.header = header_with_flags(*whole);
    }
    return out;
}

std::optional<Packet> SeekableStream::read(const Place& place) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(place.bytes));
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(place.offset));
    if (!file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
        return std::nullopt;
    PacketReader reader(bytes.size());
    reader.push(bytes);
    auto packet = reader.pull();
    return reader.damaged_bytes() > 0 ? std::nullopt : packet;
}

std::optional<SeekableStream::Index> SeekableStream::index_at(std::uint64_t offset) {
    const auto place = at(offset);
    if (!place || place->header.kind != PacketKind::front_index) return std::nullopt;
    const auto packet = read(*place);
    if (!packet) return std::nullopt;
    auto index = htvm::read_index(*packet);
    if (!index || index->bytes > size_ - place->end()) return std::nullopt;
    return Index{std::move(*index), place->end()};
}

std::optional<SeekableStream::Place> SeekableStream::picture_behind(std::uint64_t offset) {
    const auto frame = at(offset);
    const auto behind = frame ? at(frame->end()) : std::nullopt;
    return behind && behind->header.kind == PacketKind::texture ? behind : std::nullopt;
}

namespace {

// Goes from packet header to packet header.
struct Walk {
    SeekableStream& stream;
    FrameNumbers numbers = {};
    std::vector<SeekableStream::Place> places = {};  // by FrameNumbers::dependencies()
    // Nothing if no packet begins there.
    std::optional<SeekableStream::Place> take(std::uint64_t offset) {
        auto place = stream.at(offset);
        if (!place) return place;
        numbers.push(place->header);
        places.push_back(*place);
        return place;
    }
};

// Where the index says that decoding can start, with the packets that come before that one.
struct FromIndex {
    std::vector<std::uint64_t> before;  // places of packets: the sequence header, frames that it refers to
    std::uint64_t offset = 0;
    std::uint64_t number = 0;    // of the frame there
    std::uint64_t frames = 0;    // of the stream up to the end of the index's part
    std::uint64_t pictures = 0;  // from here up to the offset are the pictures that one there may need
};

std::optional<FromIndex> from_index(SeekableStream& stream, std::uint64_t frame) {
    std::uint64_t numbered = 0;  // frames of the parts before, each with an index of its own
    for (std::uint64_t offset = 0;;) {
        const auto index = stream.index_at(offset);
        if (!index) return std::nullopt;
        const auto within = frame - numbered;
        if (within >= index->index.frames && index->end() < stream.size()) {
            numbered += index->index.frames;
            offset = index->end();
            continue;
        }
        const auto* point = point_before(index->index, within);
        const auto* sequence = point ? sequence_of(index->index, *point) : nullptr;
        if (!sequence) return std::nullopt;
        FromIndex out{{}, index->begin + point->offset, numbered + point->frame, numbered + index->index.frames};
        // Not every place to start has a key picture.
        out.pictures = out.offset;
        const auto* with_key = point;
        for (auto picture = stream.picture_behind(out.pictures); picture && !is_key_picture(picture->header);
             picture = stream.picture_behind(out.pictures)) {
            if (with_key == index->index.points.data() || with_key[-1].frame < sequence->first_frame) break;
            out.pictures = index->begin + (--with_key)->offset;
        }
        for (const auto* at = point; at->back > 0;) {
            at -= at->back;
            out.before.push_back(index->begin + at->offset);
        }
        out.before.push_back(index->begin + sequence->offset);
        std::reverse(out.before.begin(), out.before.end());
        return out;
    }
}

}  // namespace

std::optional<StreamStart> find_start(SeekableStream& stream, std::uint64_t frame) {
    Walk walk{stream};
    std::uint64_t offset = 0;
    bool numbered = true;
    std::uint64_t begin_number = 0;
    StreamStart out;
    if (const auto start = from_index(stream, frame)) {
        for (const auto before : start->before)
            if (!walk.take(before)) return std::nullopt;
        for (offset = start->pictures; offset < start->offset;) {
            const auto place = stream.at(offset);
            if (!place) return std::nullopt;
            if (place->header.kind == PacketKind::texture) (void)walk.take(offset);
            offset = place->end();
        }
        offset = start->offset;
        begin_number = start->number;
        out.promised = start->frames;
        numbered = false;
    }
    for (;;) {
        const auto place = walk.take(offset);
        if (!place) return std::nullopt;
        offset = place->end();
        if (!frame_type(place->header.kind)) continue;
        if (!numbered) walk.numbers.begin(place->header.frame, static_cast<std::uint32_t>(begin_number));
        numbered = true;
        const auto number = walk.numbers.of(place->header.frame);
        if (number < frame) continue;
        const auto& dependencies = walk.numbers.dependencies();
        out.go_on = place->offset;
        out.frame = place->header.frame;
        out.number = number;
        // What the frame needs, and what those behind it need of what comes before it.
        auto needed = dependencies.closure();
        const auto kept = dependencies.kept();
        needed.insert(needed.end(), kept.begin(), kept.end());
        std::erase_if(needed, [&](std::uint64_t n) { return walk.places[n].offset >= out.go_on; });
        const auto is_header = [&](std::uint64_t n) { return walk.places[n].header.kind == PacketKind::sequence; };
        std::sort(needed.begin(), needed.end(), [&](std::uint64_t a, std::uint64_t b) {
            return is_header(a) != is_header(b) ? is_header(a) : a < b;
        });
        needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
        out.first_needed_frame = out.frame;
        out.first_needed_number = out.number;
        for (auto n = needed.rbegin(); n != needed.rend(); ++n) {
            const auto& header = walk.places[*n].header;
            out.needed.insert(out.needed.begin(), walk.places[*n].offset);
            if (!frame_type(header.kind)) continue;
            out.first_needed_frame = header.frame;
            out.first_needed_number = walk.numbers.of(header.frame);
        }
        return out;
    }
}

std::optional<StreamStart> go_to_frame(StreamInput& input, const std::string& path, std::uint64_t frame,
                                       std::uint64_t max_packet_bytes) {
    auto stream = SeekableStream::open(path, max_packet_bytes);
    auto start = stream ? find_start(*stream, frame) : std::nullopt;
    if (!start) return std::nullopt;
    std::vector<Packet> needed;
    for (const auto offset : start->needed) {
        const auto place = stream->at(offset);
        auto packet = place ? stream->read(*place) : std::nullopt;
        if (!packet) return std::nullopt;
        needed.push_back(std::move(*packet));
    }
    input.go_on_with(std::move(needed), start->go_on);
    return start;
}

}  // namespace htvm::app
