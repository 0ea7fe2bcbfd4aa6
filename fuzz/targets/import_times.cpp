// Files of times: must give times that ascend, one for each number, or an error; what is written reads back.
#include "fuzz_input.h"
#include "io/timestamps.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using fuzz::require;
    const std::string text(data, data + size);
    for (const FrameRate rate : {FrameRate{}, FrameRate{30000, 1001}}) {
        const auto times = parse_frame_times(text, rate);
        if (!times) {
            require(!times.error().message.empty(), "an error says what is wrong");
            continue;
        }
        for (std::size_t k = 1; k < times->microseconds.size(); ++k)
            require(times->microseconds[k] > times->microseconds[k - 1], "time goes on");
        for (std::size_t k = 1; k < times->numbers.size(); ++k)
            require(times->numbers[k] > times->numbers[k - 1], "numbers ascend");
        if (!times->numbers.empty() && times->numbers.size() != times->microseconds.size()) continue;
        const auto again = parse_frame_times(frame_times_csv(*times), {});
        require(again && again->microseconds == times->microseconds, "what was written reads back");
    }
    return 0;
}
