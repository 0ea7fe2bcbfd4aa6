// How far a task has come, for others that follow behind it, as the functions of parallel_invoke() may.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <limits>

#ifdef __STDCPP_THREADS__
#include <thread>
#endif

namespace htvm::internal {

class Progress {
public:
    // Where steps are as short as coding a vertex, telling of each would cost more than it saves.
    static constexpr std::size_t told_every = 64;
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

// How far one may follow behind others, each null where there is nobody to wait for; asks them only where it has to.
class Followed {
public:
    explicit Followed(const Progress* first, const Progress* second = nullptr) : first_(first), second_(second) {}
    // Returns once all have done more than `step` steps.
    void wait_beyond(std::size_t step) {
        if (step < ready_) return;
        ready_ = std::numeric_limits<std::size_t>::max();
        for (const Progress* progress : {first_, second_})
            if (progress) ready_ = std::min(ready_, progress->wait_beyond(step));
    }

private:
    const Progress *first_, *second_;
    std::size_t ready_ = 0;
};

// Ends a progress wherever its task ends, by an exception, too.
struct EndOfProgress {
    Progress& progress;
    ~EndOfProgress() { progress.end(); }
};

}  // namespace htvm::internal
