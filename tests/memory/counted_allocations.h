// Global operator new of this test program: counted, and failing on request.
#pragma once

#include <cstdint>

namespace htvm::test {

struct Allocations {
    std::uint64_t made = 0;      // calls that succeeded or failed since the last reset()
    std::int64_t bytes = 0;      // asked for since the last reset()
    std::int64_t live = 0;       // bytes asked for and not given back
    std::int64_t most_live = 0;  // since the last reset()
};
Allocations allocations();
// Counts from here: made = bytes = 0, most_live = live.
void reset_allocations();

// Calls work() while allocation number `first` from now on (0 is the next) throws std::bad_alloc, and where `all`,
// those after it do too, in any thread. Gives how many calls were made.
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
