// Errors are values: every function that can fail returns Result<T>.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace htvm {

enum class ErrorKind {
    bad_input,       // the caller's input is wrong: a mesh, a pose, an option, a file of the wrong kind
    corrupt_stream,  // the stream is inconsistent or ends too early
    unsupported,     // valid, but not supported by this build or version
    limit,           // larger than a configured limit
    disk_full,       // what is written to a file finds no room; never from the encoder or the decoder
};

// One clear sentence for the user: what is wrong, where, and what to do.
struct Error {
    ErrorKind kind = ErrorKind::bad_input;
    std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(ErrorKind kind, std::string message) {
    return tl::unexpected<Error>(Error{kind, std::move(message)});
}

}  // namespace htvm
