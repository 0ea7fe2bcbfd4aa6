// How far a task has come, for another one that follows behind it, as both functions of parallel_invoke() may.
#pragma once

#include <atomic>
#include <cstddef>
#include <limits>

#ifdef __STDCPP_THREADS__
#include <thread>
#endif

namespace htvm::internal {

class Progress {
public:
    // So many steps are done, and what they wrote may be read.
    void reach(std::size_t steps) { done_.store(steps, std::memory_order_release); }
    // There will be no more: nobody has to wait.
    void end() { reach(std::numeric_limits<std::size_t>::max()); }
    // Returns once more than `step` steps are done, and how many that are.
    std::size_t wait_beyond(std::size_t step) const {
        for (;;) {
            const auto done = done_.load(std::memory_order_acquire);
            if (done > step) return done;
#ifdef __STDCPP_THREADS__
            std::this_thread::yield();
#endif
        }
    }

private:
    std::atomic<std::size_t> done_ = 0;
};

// Ends a progress wherever its task ends, by an exception, too.
struct EndOfProgress {
    Progress& progress;
    ~EndOfProgress() { progress.end(); }
};

}  // namespace htvm::internal
