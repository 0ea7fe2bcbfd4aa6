#include "command_line/console.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

namespace htvm::app {

void prepare_console() {}

std::vector<std::string> given_words(int argc, char** argv) { return {argv + std::min(argc, 1), argv + argc}; }

bool errors_go_to_terminal() { return isatty(STDERR_FILENO) != 0; }

std::size_t columns_of_output() {
    winsize size{};
    return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

InputPiece read_input(std::span<char> out) {
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    constexpr int look_up_after = 100;  // milliseconds
    if (poll(&input, 1, look_up_after) <= 0) return {};
    const auto got = read(STDIN_FILENO, out.data(), out.size());
    if (got <= 0) return {.bytes = 0, .is_end = true};
    return {.bytes = static_cast<std::size_t>(got)};
}

}  // namespace htvm::app
