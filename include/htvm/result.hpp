// Errors are values: every function that can fail returns Result<T>.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace htvm {

enum class ErrorKind {
    bad_input,       // what the caller gave is wrong: a mesh, a pose, an option, a file that is not what it should be
    corrupt_stream,  // the stream's bytes contradict themselves or end too early
    unsupported,     // valid, but this build or version cannot do it
    limit,           // larger than a configured limit
};

// One clear sentence for a person: what, where, what to do.
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
