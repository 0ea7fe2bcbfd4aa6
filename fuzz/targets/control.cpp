// Text messages from anybody, in every direction: what is read is in range, and is written so that it is read as the
// same.
#include "live/client/control.h"

#include "fuzz_input.h"

namespace {

using namespace htvm;

// Writes what was read, reads that, and writes it again.
template <class Message>
void check(Result<Message> (*read)(std::string_view), std::string_view text) {
    const auto message = read(text);
    if (!message) return;
    std::visit(
        [&](const auto& value) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(value)>, std::monostate>) {
                const auto written = live::write_text(value);
                fuzz::require(written.size() <= live::most_text_bytes, "messages are short");
                const auto again = read(written);
                fuzz::require(again && again->index() == message->index(), "what is written can be read");
                std::visit(
                    [&](const auto& same) {
                        if constexpr (!std::is_same_v<std::decay_t<decltype(same)>, std::monostate>)
                            fuzz::require(live::write_text(same) == written, "and is the same");
                    },
                    *again);
            }
        },
        *message);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    check(live::read_from_publisher, text);
    check(live::read_from_viewer, text);
    check(live::read_to_publisher, text);
    check(live::read_to_viewer, text);
    return 0;
}
