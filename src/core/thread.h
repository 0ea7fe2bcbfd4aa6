// Who runs the pieces of a loop (core/parallel.h): Threads, the handle that every function with loops takes, and
// ThreadPool, the owner of what it points to.
#pragma once

#include <algorithm>
#include <memory>

#include "htvm/threads.hpp"

namespace htvm::internal {

// How many threads a call may use, its own among them, and who runs their tasks. The default is the caller's alone.
struct Threads {
    const TaskRunner* runner = nullptr;  // set where count > 1; outlives the handle
    unsigned count = 1;

    // The same, but no more than `most`.
    Threads at_most(unsigned most) const { return {runner, std::min(count, most)}; }
};

// Threads to use for a requested count; 0 asks for one per core. 1 in a build without threads (WebAssembly).
unsigned thread_count(unsigned requested);

// Of an encoder, a decoder or a command: the caller's runner, or one whose threads stay as long as this and its copies.
class ThreadPool {
public:
    ThreadPool() = default;  // the caller's thread alone
    explicit ThreadPool(unsigned requested, TaskRunner runner = {});

    Threads threads() const { return {runner_.get(), count_}; }
    operator Threads() const { return threads(); }  // valid as long as this and its copies

private:
    std::shared_ptr<const TaskRunner> runner_;
    unsigned count_ = 1;
};

}  // namespace htvm::internal
