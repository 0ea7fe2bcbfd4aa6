// The browser of whoever sits before this machine.
#pragma once

#include <string>

namespace htvm::app {

// Opens the address there, where there is a screen. It may run on when this program has ended, and says nothing.
void open_in_browser(const std::string& url);

}  // namespace htvm::app
