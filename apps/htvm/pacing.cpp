#include "pacing.h"

#include <thread>

#include "command_line/interruption.h"

namespace htvm::app {

void wait_until(Pacing::Clock::time_point time) {
    constexpr std::chrono::milliseconds look_up_after{100};
    for (auto now = Pacing::Clock::now(); now < time && interruption() == 0; now = Pacing::Clock::now())
        std::this_thread::sleep_for(std::min<Pacing::Clock::duration>(time - now, look_up_after));
}

}  // namespace htvm::app
