#include "command_line/interruption.h"

#include <csignal>
#include <initializer_list>

namespace htvm::app {
namespace {

volatile std::sig_atomic_t came = 0;

void note_signal(int signal) { came = signal; }

}  // namespace

void watch_for_interruption() {
    struct sigaction action = {};
    action.sa_handler = note_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND);  // and no SA_RESTART: a read that waits returns
    sigemptyset(&action.sa_mask);
    for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

int interruption() { return came; }

}  // namespace htvm::app
