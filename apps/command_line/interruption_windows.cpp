#include <csignal>
#include <initializer_list>

#include "command_line/interruption.h"

namespace htvm::app {
namespace {

volatile std::sig_atomic_t came = 0;

void note_signal(int signal) { came = signal; }

}  // namespace

// Windows takes the handler away once it is called, as is wanted.
void watch_for_interruption() {
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, note_signal);
}

int interruption() { return came; }

}  // namespace htvm::app
