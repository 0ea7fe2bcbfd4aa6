// Threads of the caller's choosing. An encoder or decoder makes a pool of its own, whose threads stay as long as it
// does; a program that has threads already gives it a TaskRunner instead, and one that has many encoders or decoders
// may share a pool among them:
//
//   htvm::DecoderOptions options;
//   options.runner = htvm::thread_pool();  // copies of the options, and so their decoders, share the threads
#pragma once

#include <cstddef>
#include <functional>

namespace htvm {

// Must call task(0), ..., task(tasks - 1), each once, on any threads and in any order, and return when all have
// returned. Tasks never throw, and none needs another to run beside it: they may as well run one after the other. It is
// called from several threads at once where those of a loop have loops of their own, or where encoders share it.
using TaskRunner = std::function<void(std::size_t tasks, const std::function<void(std::size_t)>& task)>;

// A runner with `threads` threads, the caller's own among them (0: one per core), which all copies of it share. The
// others are started when there is first something for them to do (as many as are to be had: without any, the caller
// does it all), sleep between, and end with the last copy. The caller does every task that no other thread has begun,
// so that it never waits for one to wake.
TaskRunner thread_pool(unsigned threads = 0);

}  // namespace htvm
