// std::thread; in a build without threads (WebAssembly) a stand-in, so that the same code serves both.
#pragma once

#include <algorithm>

#ifdef __STDCPP_THREADS__
#include <thread>
#endif

namespace htvm::internal {

// How many threads a call may use: 0 and 1 are both the caller alone.
using Threads = unsigned;

#ifdef __STDCPP_THREADS__

using Thread = std::thread;

// Threads to use for a requested count; 0 asks for one per core.
inline unsigned thread_count(unsigned requested) {
    return requested > 0 ? requested : std::max(1u, std::thread::hardware_concurrency());
}

#else

// Has done its work before the next statement.
class Thread {
public:
    Thread() = default;
    template <class Work>
    explicit Thread(const Work& work) {
        work();
    }
    bool joinable() const { return false; }
    void join() {}
};

inline unsigned thread_count(unsigned) { return 1; }

#endif

}  // namespace htvm::internal
