// Used in WebAssembly builds only. These have no exceptions, so where C++ would throw (memory has run out), they trap.
#include <cstddef>

extern "C" {

[[noreturn]] void* __cxa_allocate_exception(std::size_t) { __builtin_trap(); }
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }
}
