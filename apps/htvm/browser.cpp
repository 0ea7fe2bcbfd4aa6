#include "browser.h"

#include <cstdlib>

#include "io/child_program.h"

namespace htvm::app {

void open_in_browser(const std::string& url) {
    const bool screen = std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY") || std::getenv("BROWSER");
    if (screen) start_program({"xdg-open", url}, {our_stream, no_stream, no_stream});
}

}  // namespace htvm::app
