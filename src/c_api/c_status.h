// What both handles of the C interface (htvm/htvm.h) share: statuses, the last error, the caller's allocator, and the
// boundary that no exception crosses.
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

// A message in a fixed buffer, so that no allocation is needed; longer ones are truncated.
struct LastError {
    std::array<char, 512> text{};
    // Keeps the message and returns the status.
    htvm_status set(htvm_status status, const char* message);
    htvm_status set(const Error& error) { return set(status_of(error.kind), error.message.c_str()); }
};

// Calls work() and returns its status; exceptions are turned into one.
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

// Replaces functions that are not given by malloc and free. False if only one of the two is given.
bool complete(htvm_allocator& allocator);

// The caller's function as a runner; empty if it is NULL.
TaskRunner task_runner(htvm_run_tasks run, void* user);

// A T made from the arguments in memory from the caller's allocator; null if there is no memory. Exceptions of T's
// constructor are passed on.
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

// allocator: by value, since the handle may hold the original.
template <class T>
void destroy_handle(T* handle, htvm_allocator allocator) {
    handle->~T();
    allocator.release(allocator.user, handle);
}

// Versioned structs. A struct from the caller may be of another version, and is as long as its struct_size says.
// Members that only this version has keep their defaults; members that it does not know must be 0. In every version the
// size of a struct is a multiple of its alignment, so that no pointer is cut in half.
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

// read_struct() with a status and a message; `name`: of the struct.
htvm_status check_struct(LastError& error, StructSize size, const char* name);

// Writes as much as the caller has room for, and the size written.
template <class Struct>
htvm_status write_struct(Struct value, void* out, std::size_t size) {
    static_assert(std::is_trivially_copyable_v<Struct>);
    if (!out || size < 2 * sizeof(std::uint32_t)) return HTVM_BAD_INPUT;
    const std::size_t known = size < sizeof(Struct) ? size : sizeof(Struct);
    value.struct_size = static_cast<std::uint32_t>(known);
    std::memcpy(out, &value, known);
    return HTVM_OK;
}

// The same for a struct that the caller is to fill: members that this version does not know are set to 0, struct_size
// to the caller's.
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

// The frame information that encoder and decoder share; joints and bones are left 0.
htvm_frame_info describe(const FrameInfo& info, std::uint32_t attributes);

// The attributes that the mesh has: HTVM_COLOURS | ...
std::uint32_t attributes_of(const MeshView& mesh);

}  // namespace htvm::c_api
