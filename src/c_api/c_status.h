// What both handles of the C interface (htvm/htvm.h) are made of: statuses, the last error, the caller's allocator, and
// the border that no exception crosses.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <exception>
#include <new>
#include <type_traits>
#include <utility>

#include "htvm/frame.hpp"
#include "htvm/htvm.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/threads.hpp"

namespace htvm::c_api {

htvm_status status_of(ErrorKind kind);

// A sentence, kept where no allocation is needed; longer ones are cut.
struct LastError {
    std::array<char, 512> text{};
    // Keeps the message and gives the status back.
    htvm_status set(htvm_status status, const char* message);
    htvm_status set(const Error& error) { return set(status_of(error.kind), error.message.c_str()); }
};

// Calls work(), which gives a status. Exceptions become one.
template <class Work>
htvm_status guarded(LastError& error, const Work& work) noexcept {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return error.set(HTVM_OUT_OF_MEMORY, "there is not enough memory");
    } catch (const std::exception& exception) {
        return error.set(HTVM_INTERNAL, exception.what());
    } catch (...) {
        return error.set(HTVM_INTERNAL, "an unknown exception");
    }
}

// The allocator with malloc and free in place of what is not given. False where one function is and the other is not.
bool complete(htvm_allocator& allocator);

// The caller's function as a runner; none where it is NULL.
TaskRunner task_runner(htvm_run_tasks run, void* user);

// A T made from the arguments in the caller's memory, or null where there is none. Exceptions of T's constructor pass.
template <class T, class... Arguments>
T* make_handle(const htvm_allocator& allocator, Arguments&&... arguments) {
    void* memory = allocator.allocate(allocator.user, sizeof(T));
    if (!memory) return nullptr;
    try {
        return new (memory) T(std::forward<Arguments>(arguments)...);
    } catch (...) {
        allocator.release(allocator.user, memory);
        throw;
    }
}

// allocator: a copy, since the handle may hold the original.
template <class T>
void destroy_handle(T* handle, htvm_allocator allocator) {
    handle->~T();
    allocator.release(allocator.user, handle);
}

// Versioned structs. Those of the caller, of another version perhaps, are as long as their struct_size says: what this
// version has more is left at its default, and what it does not know must be 0. The size of a struct is a multiple of
// its alignment in every version, so that no pointer is cut in half.
enum class StructSize { good, never_set, from_a_later_version };

template <class Struct>
StructSize read_struct(const Struct* given, Struct& out) {
    constexpr std::size_t least = 2 * sizeof(std::uint32_t);
    std::uint32_t size = 0;
    std::memcpy(&size, given, sizeof size);
    if (size < least || size > 65536 || size % alignof(Struct) != 0) return StructSize::never_set;
    const auto* bytes = reinterpret_cast<const unsigned char*>(given);
    for (std::size_t i = sizeof(Struct); i < size; ++i)
        if (bytes[i] != 0) return StructSize::from_a_later_version;
    std::memcpy(&out, given, size < sizeof(Struct) ? size : sizeof(Struct));
    return StructSize::good;
}

// read_struct() with a status and a message; `name` is the struct's.
htvm_status check_struct(LastError& error, StructSize size, const char* name);

// Writes what the caller has room for, and how much that is.
template <class Struct>
htvm_status write_struct(Struct value, void* out, std::size_t size) {
    static_assert(std::is_trivially_copyable_v<Struct>);
    if (!out || size < 2 * sizeof(std::uint32_t)) return HTVM_BAD_INPUT;
    const std::size_t known = size < sizeof(Struct) ? size : sizeof(Struct);
    value.struct_size = static_cast<std::uint32_t>(known);
    std::memcpy(out, &value, known);
    return HTVM_OK;
}

// The same for a struct that the caller is to fill: what this version does not know is 0, and struct_size the caller's.
template <class Struct>
htvm_status init_struct(Struct value, void* out, std::size_t size) {
    static_assert(std::is_trivially_copyable_v<Struct>);
    if (!out || size < 2 * sizeof(std::uint32_t) || size > 65536) return HTVM_BAD_INPUT;
    std::memset(out, 0, size);
    std::memcpy(out, &value, size < sizeof(Struct) ? size : sizeof(Struct));
    const auto whole = static_cast<std::uint32_t>(size);
    std::memcpy(out, &whole, sizeof whole);
    return HTVM_OK;
}

// What both sides say of a frame; joints and bones are left 0.
htvm_frame_info describe(const FrameInfo& info, std::uint32_t attributes);

// Those that the mesh has: HTVM_COLOURS | ...
std::uint32_t attributes_of(const MeshView& mesh);

}  // namespace htvm::c_api
