#include <windows.h>
// After windows.h, which it needs.
#include <shellapi.h>

#include "browser.h"

namespace htvm::app {

// The address has ASCII alone.
void open_in_browser(const std::string& url) {
    ::ShellExecuteA(nullptr, "open", url.c_str(), nullptr, nullptr, SW_SHOWNORMAL);
}

}  // namespace htvm::app
