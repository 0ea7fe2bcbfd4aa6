// Parallel loops over standard threads, so that the decoder needs no threading library and a build without threads
// runs the same code. What a loop computes must not depend on how the range is cut.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <vector>

#include "core/thread.h"

namespace htvm::internal {

// The exception of whichever thread failed first. A thread that an exception leaves would end the process.
struct FirstFailure {
    std::atomic_flag taken;
    std::exception_ptr exception;

    // Calls work(); an exception stays here.
    template <class Work>
    void guard(const Work& work) noexcept {
        try {
            work();
        } catch (...) {
            if (!taken.test_and_set()) exception = std::current_exception();
        }
    }
    // Throws it, if any. Call when the threads are joined.
    void rethrow() const {
        if (exception) std::rethrow_exception(exception);
    }
};

// A thread that calls work(), which must not throw; where none can be started, work() has been called here.
template <class Work>
Thread start_or_run(const Work& work) {
    try {
        return Thread(work);
    } catch (const std::exception&) {  // system_error: no thread to be had; bad_alloc: no memory for one
        work();
        return {};
    }
}

// Calls body(begin, end) on disjoint pieces that cover [0, count), on up to `threads` threads; none is empty, and where
// there are several, each is at least half a `grain` long. Returns when all are done; where calls threw, all the others
// are done too, and the first exception is thrown here.
template <class Body>
void parallel_for(std::size_t count, Threads threads, std::size_t grain, const Body& body) {
    if (count == 0) return;
    grain = std::max<std::size_t>(grain, 1);
    const std::size_t pieces = std::min<std::size_t>(threads, (count - 1) / grain + 1);
    if (pieces <= 1) {
        body(std::size_t{0}, count);
        return;
    }
    FirstFailure failure;
    auto run = [&](std::size_t p) { failure.guard([&] { body(count * p / pieces, count * (p + 1) / pieces); }); };
    std::vector<Thread> workers;
    workers.reserve(pieces - 1);
    for (std::size_t p = 1; p < pieces; ++p) workers.push_back(start_or_run([&run, p] { run(p); }));
    run(0);
    for (auto& worker : workers)
        if (worker.joinable()) worker.join();
    failure.rethrow();
}

// Runs the given functions, the last on this thread and the others beside it where threads > 1. Where one throws, the
// other is done too, and the exception is thrown here; with one thread, what comes after it is not run.
template <class First, class Second>
void parallel_invoke(Threads threads, const First& first, const Second& second) {
    if (threads <= 1) {
        first();
        second();
        return;
    }
    FirstFailure failure;
    auto worker = start_or_run([&] { failure.guard(first); });
    failure.guard(second);
    if (worker.joinable()) worker.join();
    failure.rethrow();
}

}  // namespace htvm::internal
