// Parallel loops: a range is cut into pieces, which the threads of a Threads take one after the other, so that a slow
// or late one takes fewer. What a loop computes must not depend on how the range is cut.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>

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
    // Throws it, if any. Call when all are done.
    void rethrow() const {
        if (exception) std::rethrow_exception(exception);
    }
};

// Calls piece(0), ..., piece(pieces - 1) on up to threads.count > 1 threads. They begin in this order, so that a piece
// may wait for what an earlier one does. Returns when all are done; the first exception is thrown then.
template <class Piece>
void run_pieces(Threads threads, std::size_t pieces, const Piece& piece) {
    FirstFailure failure;
    std::atomic<std::size_t> next = 0;
    const auto take_pieces = [&](std::size_t) {
        for (std::size_t p = next++; p < pieces; p = next++) failure.guard([&] { piece(p); });
    };
    const std::function<void(std::size_t)> task = std::ref(take_pieces);
    failure.guard([&] { (*threads.runner)(std::min<std::size_t>(threads.count, pieces), task); });
    take_pieces(0);  // what a runner that failed has left
    failure.rethrow();
}

// Calls body(begin, end) on disjoint pieces that cover [0, count), on up to threads.count threads; none is empty, and
// where there are several, each is at least half a `grain` long: to be chosen so that a grain takes some 100 us, or
// waking a thread costs more than it does. Returns when all are done; where calls threw, all the others are done too,
// and the first exception is thrown here.
template <class Body>
void parallel_for(std::size_t count, Threads threads, std::size_t grain, const Body& body) {
    if (count == 0) return;
    constexpr std::size_t pieces_per_thread = 4;  // a thread that is held up by others keeps back a part of its share
    grain = std::max<std::size_t>(grain, 1);
    const std::size_t pieces = std::min<std::size_t>(pieces_per_thread * threads.count, (count - 1) / grain + 1);
    if (threads.count <= 1 || pieces <= 1) {
        body(std::size_t{0}, count);
        return;
    }
    run_pieces(threads, pieces, [&](std::size_t p) { body(count * p / pieces, count * (p + 1) / pieces); });
}

// Runs both functions, side by side where threads.count > 1; the first begins first, so that the second may wait for
// what it does. Where one throws, the other is done too, and the exception is thrown here; with one thread, what comes
// after it is not run.
template <class First, class Second>
void parallel_invoke(Threads threads, const First& first, const Second& second) {
    if (threads.count <= 1) {
        first();
        second();
        return;
    }
    run_pieces(threads, 2, [&](std::size_t p) {
        if (p == 0)
            first();
        else
            second();
    });
}

}  // namespace htvm::internal
