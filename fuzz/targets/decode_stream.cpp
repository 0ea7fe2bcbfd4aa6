// The whole decoder on a stream whose packets are lost, doubled, reordered, damaged or mixed up, all with correct CRCs.
// The input: a number of changes, four bytes each, then a stream.
#include "codec/format/frame_payload.h"
#include "whole_decoder.h"

namespace {

using namespace htvm;
using namespace htvm::internal;

// Damages one layer of a frame, or a number in its header, and leaves the rest unchanged.
void change_layer(Packet& packet, std::uint8_t choice, std::uint8_t where, std::uint8_t value) {
    const auto read = read_frame_payload(packet.payload);
    if (!read) return;
    auto payload = copy_of(*read);
    auto& h = payload.header;
    const std::array<std::uint32_t*, 8> numbers = {&h.source_vertices,   &h.source_triangles, &h.vertices,
                                                   &h.triangles,         &h.geometry_step,    &h.colour_step,
                                                   &h.geometry_codebook, &h.colour_codebook};
    if (choice % 32 < layer_count) {
        const std::size_t layer = choice % 32;
        auto& bytes = payload.layers[layer];
        if (value == 0) {
            payload.present[layer] = !payload.present[layer];
        } else if (!bytes.empty()) {
            auto& byte = bytes[where % bytes.size()];
            byte = static_cast<std::uint8_t>(byte ^ value);
            if (where == 255) bytes.resize(value % bytes.size());
        }
    } else if (choice % 32 < layer_count + numbers.size()) {
        auto& number = *numbers[choice % 32 - layer_count];
        number = value < 128 ? number + where - 128u : std::uint32_t{where} << (value % 23);
    }
    packet.payload = write_frame_payload(payload);
}

void change(std::vector<Packet>& packets, std::uint8_t kind, std::uint8_t a, std::uint8_t b, std::uint8_t c) {
    if (packets.empty()) return;
    const std::size_t i = a % packets.size(), j = b % packets.size();
    const auto place = [&](std::size_t k) { return packets.begin() + static_cast<std::ptrdiff_t>(k); };
    auto& packet = packets[i];
    switch (kind % 8) {
        case 0:
            packets.erase(place(i));
            break;
        case 1:
            if (packets.size() < 64) packets.insert(place(j), Packet(packet));
            break;
        case 2:
            std::swap(packet, packets[j]);
            break;
        case 3:
            packet.reference = c < 128 ? packets[j].frame : packets[j].reference;
            break;
        case 4:
            packet.kind = c < 64 ? packets[j].kind : packet.kind;
            packet.frame = c < 128 ? packets[j].frame : packet.frame + c;
            if (c >= 192) packet.payload = packets[j].payload;
            break;
        case 5:
            if (!packet.payload.empty()) {
                auto& byte = packet.payload[std::size_t{b} * 7 % packet.payload.size()];
                byte = static_cast<std::uint8_t>(byte ^ c);
            }
            break;
        case 6:
            packet.payload.resize(packet.payload.size() * b / 255);
            break;
        case 7:
            change_layer(packet, b, c, static_cast<std::uint8_t>(kind / 8 * 8));
            break;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto changes = input.take(std::size_t{input.below(16)} * 4);
    const auto rest = input.rest();
    std::vector<std::uint8_t> stream(rest.begin(), rest.end());
    fuzz::repair_checksums(stream);
    auto packets = fuzz::read_packets(stream, stream.size() + 1);
    for (std::size_t i = 0; i + 4 <= changes.size(); i += 4)
        change(packets, changes[i], changes[i + 1], changes[i + 2], changes[i + 3]);
    DecoderOptions options;
    options.threads = 1;
    options.max_vertices = 1 << 16;
    options.max_triangles = 1 << 17;
    fuzz::decode_all(packets, options);
    return 0;
}
