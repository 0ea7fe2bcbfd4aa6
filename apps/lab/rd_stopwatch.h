// Time that coding takes, while other cores of the machine are busy with other things.
#pragma once

#include <ctime>

namespace htvm::lab {

// On one thread, the processor time of the calling thread: what the wall clock would say on a core of its own. With
// several threads, the wall clock.
class Stopwatch {
public:
    explicit Stopwatch(unsigned threads) : clock_(threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC) {
        start_ = now();
    }
    double milliseconds() const { return now() - start_; }  // since the construction, by the same thread

private:
    double now() const {
        std::timespec t{};
        clock_gettime(clock_, &t);
        return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
    }
    clockid_t clock_;
    double start_ = 0;
};

}  // namespace htvm::lab
