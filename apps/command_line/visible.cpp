#include "command_line/visible.h"

#include <fmt/core.h>

namespace htvm::app {
namespace {

std::string spelled(std::string_view text, bool lines) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const bool second = i > 0 && static_cast<unsigned char>(text[i - 1]) == 0xc2 && byte >= 0x80 && byte < 0xa0;
        const bool control = byte < 0x20 || byte == 0x7f || second;
        if (control && !(lines && byte == '\n'))
            out += fmt::format("\\x{:02x}", byte);
        else
            out += text[i];
    }
    return out;
}

}  // namespace

std::string visible(std::string_view text) { return spelled(text, false); }
std::string visible_lines(std::string_view text) { return spelled(text, true); }

}  // namespace htvm::app
