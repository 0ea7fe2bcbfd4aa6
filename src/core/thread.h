// Who runs the pieces of a loop (core/parallel.h): Threads, the handle that every function with loops takes, and
// ThreadPool, which owns what the handle points to.
#pragma once

#include <algorithm>
#include <memory>

#include "htvm/threads.hpp"

namespace htvm::internal {

// How many threads a call may use, including its own, and who runs their tasks. The default: the caller's thread alone.
struct Threads {
    const TaskRunner* runner = nullptr;  // set where count > 1; outlives the handle
    unsigned count = 1;

    // The same runner with at most `most` threads.
    Threads at_most(unsigned most) const { return {runner, std::min(count, most)}; }
};

// The number of threads for a requested count: 0 means one per core; always 1 in a build without threads (WebAssembly).
unsigned thread_count(unsigned requested);

// The threads of an encoder, a decoder or a command: the caller's runner, or threads of its own, which live as long as
// this object and its copies.
class ThreadPool {
public:
    ThreadPool() = default;  // uses the caller's thread alone
    explicit ThreadPool(unsigned requested, TaskRunner runner = {});

    Threads threads() const { return {runner_.get(), count_}; }
    operator Threads() const { return threads(); }  // valid as long as this object or a copy of it

private:
    std::shared_ptr<const TaskRunner> runner_;
    unsigned count_ = 1;
};

}  // namespace htvm::internal
