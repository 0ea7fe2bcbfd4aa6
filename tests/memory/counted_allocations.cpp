#include "memory/counted_allocations.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>

namespace {

constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
// The size of each block is stored before it, in as many bytes as the strictest alignment of the plain operator new.
constexpr std::size_t head = alignof(std::max_align_t);
static_assert(head >= sizeof(std::size_t));

std::atomic<std::uint64_t> made = 0, fail_from = never, fail_to = never;
std::atomic<std::int64_t> bytes = 0, live = 0, most_live = 0;

void* allocate(std::size_t size) {
    const std::uint64_t number = made++;
    if (number >= fail_from && number <= fail_to) return nullptr;
    auto* block = static_cast<std::byte*>(std::malloc(head + size));
    if (!block) return nullptr;
    ::new (block) std::size_t(size);
    bytes += static_cast<std::int64_t>(size);
    const std::int64_t now = live += static_cast<std::int64_t>(size);
    std::int64_t most = most_live;
    while (now > most && !most_live.compare_exchange_weak(most, now)) {
    }
    return block + head;
}

void release(void* pointer) {
    if (!pointer) return;
    auto* block = static_cast<std::byte*>(pointer) - head;
    live -= static_cast<std::int64_t>(*std::launder(reinterpret_cast<std::size_t*>(block)));
    std::free(block);
}

}  // namespace

void* operator new(std::size_t size) {
    if (void* block = allocate(size)) return block;
    throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void operator delete(void* pointer) noexcept { release(pointer); }
void operator delete[](void* pointer) noexcept { release(pointer); }
void operator delete(void* pointer, std::size_t) noexcept { release(pointer); }
void operator delete[](void* pointer, std::size_t) noexcept { release(pointer); }
void operator delete(void* pointer, const std::nothrow_t&) noexcept { release(pointer); }
void operator delete[](void* pointer, const std::nothrow_t&) noexcept { release(pointer); }

namespace htvm::test {

Allocations allocations() { return {made, bytes, live, most_live}; }

void reset_allocations() {
    made = 0;
    bytes = 0;
    most_live = live.load();
}

namespace detail {

void begin_failing(std::uint64_t first, bool all) {
    made = 0;
    fail_to = all ? never - 1 : first;
    fail_from = first;
}

std::uint64_t end_failing() {
    fail_from = fail_to = never;
    return made;
}

}  // namespace detail
}  // namespace htvm::test
