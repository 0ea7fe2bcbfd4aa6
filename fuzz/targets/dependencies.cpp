// What frames need, told from any packet headers in any order: places that are there, in the stream's order behind the
// sequence header, bounded in number, and the same by the plain function.
#include <algorithm>

#include "fuzz_input.h"
#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"

namespace {

using namespace htvm;
using fuzz::require;

void check_places(const std::vector<std::uint64_t>& places, std::uint64_t pushed) {
    for (const auto place : places) require(place < pushed, "places are of packets that were pushed");
    if (places.size() > 1)
        require(std::is_sorted(places.begin() + 1, places.end()), "behind the header the order is the stream's");
}

Packet any_packet(fuzz::FuzzInput& input) {
    Packet packet;
    packet.kind = static_cast<PacketKind>(input.below(13));
    packet.flags = input.u8();
    packet.frame = input.below(16);
    packet.reference = input.below(16);
    if (!packet.has(packet_flag::flags_valid)) packet.payload.assign(input.below(2), input.u8());
    return packet;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    constexpr std::size_t most = 20;
    Dependencies bounded(most), all;
    std::vector<PacketHeader> headers;
    while (input.left() > 0 && headers.size() < 200) {
        const auto packet = any_packet(input);
        const bool whole = input.flag();
        headers.push_back(whole ? header_with_flags(packet) : PacketHeader(packet));
        require(bounded.push(headers.back()) + 1 == headers.size(), "places count the packets");
        all.push(headers.back());
        check_places(bounded.kept(), headers.size());
        check_places(bounded.closure(), headers.size());
        require(bounded.kept().size() <= 2 * most + 5, "what is held is bounded");
        if (!frame_type(packet.kind)) continue;
        const auto needed = all.closure();
        const auto by_list = closure(headers, headers.size() - 1);
        require(std::equal(needed.begin(), needed.end(), by_list.begin(), by_list.end()), "the list gives the same");
        require(needed.empty() || needed.back() + 1 == headers.size(), "the frame is the last");
    }
    return 0;
}
