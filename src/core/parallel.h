// Parallel loops. A range is cut into pieces, which the threads of a Threads take one after another, so that a slow or
// late thread takes fewer. What a loop computes must not depend on how the range is cut.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>

#include "core/thread.h"

namespace htvm::internal {

// Keeps the exception of the thread that failed first: an exception that leaves a thread would end the process.
struct FirstFailure {
    std::atomic_flag taken;
    std::exception_ptr exception;

    // Calls work() and catches any exception it throws.
    template <class Work>
    void guard(const Work& work) noexcept {
        try {
            work();
        } catch (...) {
            if (!taken.test_and_set()) exception = std::current_exception();
        }
    }
    // Throws the exception, if any. Call it when all threads are done.
    void rethrow() const {
        if (exception) std::rethrow_exception(exception);
    }
};

// Calls piece(0), ..., piece(pieces - 1) on up to threads.count > 1 threads. Pieces begin in this order, so a piece may
// wait for an earlier one. Returns when all are done, and then throws the first exception, if any.
template <class Piece>
void run_pieces(Threads threads, std::size_t pieces, const Piece& piece) {
    FirstFailure failure;
    std::atomic<std::size_t> next = 0;
    const auto run_those_left = [&](std::size_t) {
        for (std::size_t p = next++; p < pieces; p = next++) failure.guard([&] { piece(p); });
    };
    const std::function<void(std::size_t)> task = std::ref(run_those_left);
    failure.guard([&] { (*threads.runner)(std::min<std::size_t>(threads.count, pieces), task); });
    run_those_left(0);  // what a failed runner has left
    failure.rethrow();
}

// Calls body(begin, end) on disjoint pieces that cover [0, count), on up to threads.count threads. No piece is empty,
// and if there are several, each is at least half a `grain` long: choose a grain that takes about 100 us, or waking a
// thread costs more than it saves. Returns when all are done; if calls threw, the first exception is thrown then.
template <class Body>
void parallel_for(std::size_t count, Threads threads, std::size_t grain, const Body& body) {
    if (count == 0) return;
    constexpr std::size_t pieces_per_thread = 4;  // several, so that a thread that is delayed holds up only a part of
                                                  // its share
    grain = std::max<std::size_t>(grain, 1);
    const std::size_t pieces = std::min<std::size_t>(pieces_per_thread * threads.count, (count - 1) / grain + 1);
    if (threads.count <= 1 || pieces <= 1) {
        body(std::size_t{0}, count);
        return;
    }
    run_pieces(threads, pieces, [&](std::size_t p) { body(count * p / pieces, count * (p + 1) / pieces); });
}

// Runs all functions, side by side if threads.count > 1. They begin in their order, so each may wait for those before
// it. If one throws, the others are still finished before the first exception is thrown here; with one thread, those
// behind it are not run.
template <class... Work>
void parallel_invoke(Threads threads, const Work&... work) {
    if (threads.count <= 1) {
        (work(), ...);
        return;
    }
    run_pieces(threads, sizeof...(Work), [&](std::size_t piece) {
        std::size_t at = 0;
        ((at++ == piece ? static_cast<void>(work()) : void()), ...);
    });
}

}  // namespace htvm::internal
