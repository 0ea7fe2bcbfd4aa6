// Lets the caller choose the threads. By default an encoder or decoder makes a pool of its own, whose threads live as
// long as it does. A program that has threads already passes a TaskRunner instead, and one with many encoders or
// decoders may share a pool among them:
//
//   htvm::DecoderOptions options;
//   options.runner = htvm::thread_pool();  // copies of the options, and so their decoders, share the threads
#pragma once

#include <cstddef>
#include <functional>

namespace htvm {

// Must call task(0), ..., task(tasks - 1), each once, on any threads and in any order, and return when all have
// returned. Tasks never throw, and none needs another to run at the same time, so they may also run one after another.
// It may be called from several threads at once, when the tasks of a loop have loops of their own or when encoders
// share it.
using TaskRunner = std::function<void(std::size_t tasks, const std::function<void(std::size_t)>& task)>;

// A runner with `threads` threads, including the caller's (0: one per core), which all its copies share. The other
// threads are started when there is first work for them (as many as the system provides; without any, the caller does
// all the work), sleep in between, and end with the last copy. The caller does every task that no other thread has
// begun, so it never waits for a thread to wake.
TaskRunner thread_pool(unsigned threads = 0);

}  // namespace htvm
