// The sequence header, the index and the payload of frames: what can be read is the same after writing and reading
// again.
#include "codec/format/frame_payload.h"
#include "codec/format/sequence.h"
#include "fuzz_input.h"
#include "htvm/stream_index.hpp"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

void check_header(std::span<const std::uint8_t> bytes) {
    const auto header = read_sequence_header(bytes);
    if (!header) return;
    require(!header->skeleton.bones.empty() && header->radii.size() == header->skeleton.bones.size(),
            "one radius a bone");
    for (const auto& bone : header->skeleton.bones)
        require(bone.first < header->skeleton.joint_names.size() && bone.second < header->skeleton.joint_names.size(),
                "bones join joints that are there");
    const auto written = write_sequence_header(*header);
    const auto again = read_sequence_header(written);
    require(again && write_sequence_header(*again) == written, "a sequence header comes back");
}

void check_index(std::span<const std::uint8_t> bytes) {
    const auto index = read_sequence_index(bytes);
    if (!index) return;
    require(index->size() <= bytes.size(), "no more entries than bytes");
    const auto again = read_sequence_index(write_sequence_index(*index));
    require(again && *again == *index, "an index comes back");
}

void check_front_index(std::span<const std::uint8_t> bytes) {
    Packet packet;
    packet.kind = PacketKind::front_index;
    packet.payload.assign(bytes.begin(), bytes.end());
    const auto index = read_index(packet);
    if (!index) return;
    require(index->points.size() + index->sequences.size() <= bytes.size(), "no more entries than bytes");
    const auto again = read_index(write_index(*index));
    require(again && *again == *index, "an index in front comes back");
    for (const auto& point : index->points) require(point_before(*index, point.frame), "every entry is found");
}

void check_payload(std::span<const std::uint8_t> bytes) {
    const auto payload = read_frame_payload(bytes);
    if (!payload) return;
    const auto first = copy_of(*payload);
    const auto written = write_frame_payload(first);
    const auto again = read_frame_payload(written);
    require(again && copy_of(*again).layers == first.layers && again->present == first.present &&
                write_frame_payload(copy_of(*again)) == written,
            "a frame's layers come back");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const std::uint8_t what = input.u8() % 4;
    if (what == 0) check_header(input.rest());
    if (what == 1) check_index(input.rest());
    if (what == 2) check_payload(input.rest());
    if (what == 3) check_front_index(input.rest());
    return 0;
}
