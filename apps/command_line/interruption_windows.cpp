#include <windows.h>

#include <atomic>
#include <csignal>

#include "command_line/interruption.h"

namespace htvm::app {
namespace {

std::atomic<int> came = 0;

// On a thread of its own. Ctrl-C is SIGINT; Ctrl-Break, and a console that is closed, are what SIGTERM is elsewhere.
BOOL WINAPI note_event(DWORD event) {
    const bool is_key = event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT;
    if (came.exchange(event == CTRL_C_EVENT ? SIGINT : SIGTERM) != 0 && is_key) return FALSE;  // a second one: at once
    // Windows ends the program when this returns, or after some seconds: the program is to end by itself before.
    if (!is_key) ::Sleep(INFINITE);
    return TRUE;
}

}  // namespace

void watch_for_interruption() { ::SetConsoleCtrlHandler(note_event, TRUE); }

int interruption() { return came; }

}  // namespace htvm::app
