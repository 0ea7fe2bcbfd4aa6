// Packet headers, pictures, and what frames need in the C interface, over htvm::FrameNumbers.
#include <algorithm>
#include <optional>
#include <vector>

#include "c_api/c_status.h"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/texture.hpp"

using htvm::c_api::guarded;
using htvm::c_api::LastError;

struct htvm_dependencies {
    htvm_allocator allocator;
    htvm::FrameNumbers numbers;
    std::uint64_t pushed = 0;
    std::optional<std::uint32_t> frame;  // own number of the packet pushed last, if it is a frame
    explicit htvm_dependencies(const htvm_allocator& memory) : allocator(memory) {}
};

static_assert(HTVM_PACKET_REFERRED == htvm::packet_flag::referred && HTVM_PACKET_ACCESS == htvm::packet_flag::access &&
              HTVM_PACKET_DROPPABLE == htvm::packet_flag::droppable &&
              HTVM_PACKET_COLOUR == htvm::packet_flag::colour && HTVM_PACKET_SESSION == htvm::packet_flag::session &&
              HTVM_PACKET_FLAGS_VALID == htvm::packet_flag::flags_valid);
static_assert(HTVM_PACKET_HEADER == htvm::packet_header_bytes);
static_assert(HTVM_PACKET_AUDIO == static_cast<int>(htvm::PacketKind::audio) &&
              HTVM_PACKET_PICTURE == static_cast<int>(htvm::PacketKind::texture));
static_assert(HTVM_PICTURE_AV1 == static_cast<int>(htvm::PictureCoder::av1) &&
              HTVM_PICTURE_VP9 == static_cast<int>(htvm::PictureCoder::vp9) &&
              HTVM_PICTURE_H264 == static_cast<int>(htvm::PictureCoder::h264) &&
              HTVM_PICTURE_PNG == static_cast<int>(htvm::PictureCoder::png) &&
              HTVM_PICTURE_JPEG == static_cast<int>(htvm::PictureCoder::jpeg) &&
              HTVM_PICTURE_WEBP == static_cast<int>(htvm::PictureCoder::webp));

namespace {

htvm_status give(const std::vector<std::uint64_t>& all, std::uint64_t* places, std::size_t capacity,
                 std::size_t* count) {
    if (!count) return HTVM_BAD_INPUT;
    *count = all.size();
    if (capacity < all.size()) return HTVM_BUFFER_TOO_SMALL;
    if (!places && !all.empty()) return HTVM_BAD_INPUT;
    std::copy(all.begin(), all.end(), places);
    return HTVM_OK;
}

htvm_status describe(const htvm::PacketHeader& header, std::uint64_t bytes, htvm_packet_info* info,
                     std::size_t info_size) {
    htvm_packet_info out{};
    out.kind = static_cast<std::uint32_t>(header.kind);
    out.flags = header.flags;
    out.frame = header.frame;
    out.reference = header.reference;
    out.reference_version = header.reference_version;
    out.timestamp_us = header.timestamp_us;
    out.bytes = bytes;
    return htvm::c_api::write_struct(out, info, info_size);
}

}  // namespace

htvm_status htvm_packet_read(const uint8_t* packet, size_t size, htvm_packet_info* info, size_t info_size) {
    if (!packet) return HTVM_BAD_INPUT;
    LastError unused;  // there is no handle to keep it in
    return guarded(unused, [&] {
        htvm::PacketReader one(size);
        one.push({packet, size});
        const auto whole = one.pull();
        if (!whole || one.damaged_bytes() > 0 || one.pending_bytes() > 0) return htvm_status{HTVM_CORRUPT_STREAM};
        return describe(htvm::header_with_flags(*whole), size, info, info_size);
    });
}

htvm_status htvm_packet_header_read(const uint8_t* bytes, size_t size, htvm_packet_info* info, size_t info_size) {
    if (!bytes && size > 0) return HTVM_BAD_INPUT;
    if (size < htvm::packet_header_bytes) return HTVM_AGAIN;
    std::uint32_t payload_bytes = 0;
    const auto header = htvm::read_packet_header({bytes, size}, payload_bytes);
    if (!header) return HTVM_CORRUPT_STREAM;
    return describe(*header, std::uint64_t{payload_bytes} + htvm::packet_overhead, info, info_size);
}

htvm_status htvm_texture_picture_read(const uint8_t* packet, size_t size, htvm_texture_picture* picture,
                                      size_t picture_size) {
    if (!packet || !picture || picture_size != sizeof *picture) return HTVM_BAD_INPUT;
    LastError unused;
    return guarded(unused, [&] {
        htvm::PacketReader one(size);
        one.push({packet, size});
        const auto whole = one.pull();
        if (!whole || one.damaged_bytes() > 0 || one.pending_bytes() > 0) return htvm_status{HTVM_CORRUPT_STREAM};
        // On loan from the caller's bytes, not from the copy that was checked.
        const auto read =
            htvm::read_texture_picture(*whole, {packet + htvm::packet_header_bytes, whole->payload.size()});
        if (!read) return htvm::c_api::status_of(read.error().kind);
        htvm_texture_picture out{};
        out.coder = static_cast<std::uint32_t>(read->coder);
        out.matrix = static_cast<std::uint32_t>(read->matrix);
        out.full_range = read->full_range ? 1 : 0;
        out.width = read->width;
        out.height = read->height;
        out.frame = whole->frame;
        out.reference = whole->reference;
        out.timestamp_us = whole->timestamp_us;
        out.gain_red = read->gains[0];
        out.gain_green = read->gains[1];
        out.gain_blue = read->gains[2];
        out.coded = read->coded.data();
        out.coded_bytes = read->coded.size();
        return htvm::c_api::write_struct(out, picture, picture_size);
    });
}

htvm_status htvm_dependencies_create(const htvm_allocator* allocator, htvm_dependencies** dependencies) {
    if (!dependencies) return HTVM_BAD_INPUT;
    *dependencies = nullptr;
    htvm_allocator memory = allocator ? *allocator : htvm_allocator{};
    if (!htvm::c_api::complete(memory)) return HTVM_BAD_INPUT;
    *dependencies = htvm::c_api::make_handle<htvm_dependencies>(memory, memory);
    return *dependencies ? HTVM_OK : HTVM_OUT_OF_MEMORY;
}

void htvm_dependencies_destroy(htvm_dependencies* dependencies) {
    if (dependencies) htvm::c_api::destroy_handle(dependencies, dependencies->allocator);
}

htvm_status htvm_dependencies_push(htvm_dependencies* dependencies, const htvm_packet_info* info, uint64_t* place) {
    if (!dependencies || !info) return HTVM_BAD_INPUT;
    LastError unused;
    return guarded(unused, [&] {
        htvm_packet_info given{};
        const auto read = htvm::c_api::check_struct(unused, htvm::c_api::read_struct(info, given), "htvm_packet_info");
        if (read != HTVM_OK) return read;
        htvm::PacketHeader header;
        header.kind = static_cast<htvm::PacketKind>(given.kind);
        header.flags = static_cast<std::uint8_t>(given.flags);
        header.reference_version = static_cast<std::uint16_t>(given.reference_version);
        header.frame = given.frame;
        header.reference = given.reference;
        header.timestamp_us = given.timestamp_us;
        dependencies->numbers.push(header);
        dependencies->frame.reset();
        if (htvm::frame_type(header.kind)) dependencies->frame = header.frame;
        if (place) *place = dependencies->pushed;
        ++dependencies->pushed;
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_dependencies_closure(htvm_dependencies* dependencies, uint64_t* places, size_t capacity,
                                      size_t* count) {
    if (!dependencies) return HTVM_BAD_INPUT;
    LastError unused;
    return guarded(unused,
                   [&] { return give(dependencies->numbers.dependencies().closure(), places, capacity, count); });
}

htvm_status htvm_dependencies_kept(htvm_dependencies* dependencies, uint64_t* places, size_t capacity, size_t* count) {
    if (!dependencies) return HTVM_BAD_INPUT;
    LastError unused;
    return guarded(unused, [&] { return give(dependencies->numbers.dependencies().kept(), places, capacity, count); });
}

htvm_status htvm_dependencies_frame(htvm_dependencies* dependencies, uint32_t* frame) {
    if (!dependencies || !frame) return HTVM_BAD_INPUT;
    if (!dependencies->frame) return HTVM_AGAIN;
    *frame = dependencies->numbers.of(*dependencies->frame);
    return HTVM_OK;
}
