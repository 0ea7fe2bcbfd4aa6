// Parallel loops over standard threads, so that the decoder needs no threading library and a build without threads
// runs the same code. What a loop computes must not depend on how the range is cut.
#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

namespace htvm {

// Threads to use for a requested count; 0 asks for one per core.
inline unsigned thread_count(unsigned requested) {
    return requested > 0 ? requested : std::max(1u, std::thread::hardware_concurrency());
}

// Calls body(begin, end) on disjoint pieces that cover [0, count), on up to `threads` threads; none is empty, and where
// there are several, each is at least half a `grain` long. Returns when all are done. body must not throw.
template <class Body>
void parallel_for(std::size_t count, unsigned threads, std::size_t grain, const Body& body) {
    if (count == 0) return;
    grain = std::max<std::size_t>(grain, 1);
    const std::size_t pieces = std::min<std::size_t>(threads, (count - 1) / grain + 1);
    if (pieces <= 1) {
        body(std::size_t{0}, count);
        return;
    }
    std::vector<std::thread> workers;
    workers.reserve(pieces - 1);
    for (std::size_t p = 1; p < pieces; ++p)
        workers.emplace_back([&, p] { body(count * p / pieces, count * (p + 1) / pieces); });
    body(std::size_t{0}, count / pieces);  // piece 0: [0, count * 1 / pieces)
    for (auto& worker : workers) worker.join();
}

// Runs the given functions, the last on this thread and the others beside it where threads > 1.
template <class First, class Second>
void parallel_invoke(unsigned threads, const First& first, const Second& second) {
    if (threads <= 1) {
        first();
        second();
        return;
    }
    std::thread worker([&] { first(); });
    second();
    worker.join();
}

}  // namespace htvm
