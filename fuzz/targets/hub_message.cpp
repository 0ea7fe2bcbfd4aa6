// What hubs on other machines say, as one message and in parts: whatever is claimed, memory is bounded, and what is
// understood can be written again. A stream watched from afar gives on nothing twice.
#include "live/hub/hub_message.h"

#include "fuzz_input.h"
#include "live/hub/far_stream.h"

namespace {

using namespace htvm;
using fuzz::require;

void follow(live::FarStream& stream, std::uint64_t& given, live::HubMessage message) {
    std::vector<live::Bytes> packets;
    if (auto* packet = std::get_if<live::PublishedPacket>(&message)) packets = stream.receive(std::move(*packet));
    if (auto* closure = std::get_if<live::ClosureAnswer>(&message)) packets = stream.receive(std::move(*closure));
    given += packets.size();
    require(given == stream.counters().packets, "what goes on is counted");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    constexpr std::size_t most_bytes = 1000;
    live::PartReader parts(most_bytes);
    live::FarStream stream({1, 1}, {.held_bytes = most_bytes});
    live::FarStream::Clock::time_point now{};
    std::uint64_t given = 0;
    while (input.left() > 0) {
        const bool in_parts = input.flag();
        const auto bytes = input.take(input.u16());
        if (in_parts) {
            parts.add(bytes);
            require(parts.waiting_bytes() <= most_bytes, "what waits for its other parts is bounded");
        }
        auto message = live::read_hub_message(bytes);
        if (!message) continue;
        const auto again = live::write_hub_message(*message);
        const auto read = live::read_hub_message(again);
        require(read && live::write_hub_message(*read) == again, "what is written is read");
        follow(stream, given, std::move(*message));
        if (input.flag()) stream.announced(input.u64(), now);
        stream.asks(now += std::chrono::milliseconds(input.u8()));
    }
    return 0;
}
