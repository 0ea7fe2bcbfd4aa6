// Where memory runs out, an exception of the standard library becomes an error of ours.
#pragma once

#include <new>
#include <stdexcept>

#include "htvm/result.hpp"

namespace htvm::internal {

// Short enough to need no memory itself.
inline tl::unexpected<Error> out_of_memory() { return fail(ErrorKind::limit, "out of memory"); }

// What work() gives; or what otherwise() gives, where there is not enough memory for it.
template <class Work, class Otherwise>
auto within_memory(const Work& work, const Otherwise& otherwise) -> decltype(work()) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return otherwise();
    } catch (const std::length_error&) {
        return otherwise();
    }
}
template <class Work>
auto within_memory(const Work& work) -> decltype(work()) {
    return within_memory(work, out_of_memory);
}

}  // namespace htvm::internal
