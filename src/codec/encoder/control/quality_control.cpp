#include "codec/encoder/control/quality_control.h"

#include <array>
#include <cstdio>
#include <string>

namespace htvm::internal {

tl::unexpected<Error> does_not_fit(const RateController& rate, double bits) {
    const auto& options = rate.options();
    const double room = rate.room(), capacity = options.bits_per_second * options.buffer_seconds;
    const auto number = [](double x) {
        std::array<char, 32> text{};
        std::snprintf(text.data(), text.size(), "%.3g", x);
        return std::string(text.data());
    };
    std::string message = "the frame takes " + number(bits / 8000) +
                          " kB even at the lowest quality, and the buffer has room for " + number(room / 8000) +
                          " kB of its " + number(capacity / 8000) + " kB; give ";
    // Rounded up, so that the numbers in the message suffice.
    const auto enough = [&](double x) { return number(1.01 * x); };
    if (bits > capacity)
        message += "a bitrate of at least " + enough(bits / options.buffer_seconds / 1e6) +
                   " Mbit/s or a buffer of at least " + enough(bits / options.bits_per_second) + " s";
    else
        message += "a higher bitrate or a larger buffer";
    return fail(ErrorKind::limit, message);
}

}  // namespace htvm::internal
