// The global operator new of this test program: counts, and fails on request.
#pragma once

#include <cstdint>

namespace htvm::test {

struct Allocations {
    std::uint64_t made = 0;      // calls that succeeded or failed since the last reset()
    std::int64_t bytes = 0;      // requested since the last reset()
    std::int64_t live = 0;       // bytes requested and not released
    std::int64_t most_live = 0;  // since the last reset()
};
Allocations allocations();
// Starts counting: made = bytes = 0, most_live = live.
void reset_allocations();

// Calls work() while allocation number `first` from now on (0 is the next) throws std::bad_alloc; if `all`, later ones
// do too, in any thread. Returns the number of calls made.
template <class Work>
std::uint64_t while_failing(std::uint64_t first, bool all, const Work& work);

namespace detail {
void begin_failing(std::uint64_t first, bool all);
std::uint64_t end_failing();
}  // namespace detail

template <class Work>
std::uint64_t while_failing(std::uint64_t first, bool all, const Work& work) {
    detail::begin_failing(first, all);
    work();
    return detail::end_failing();
}

}  // namespace htvm::test
