// What was let out and is taken back before it expires: links and tokens by their ids. A file of the operator's has
// them, an id a line; empty lines, and what stands behind a #, say nothing.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "htvm/result.hpp"

namespace htvm::live {

using Revocations = std::set<std::string, std::less<>>;

// bad_input if the file cannot be read, or has a line that is longer than an id can be (128 bytes).
Result<Revocations> read_revocations(const std::string& path);

}  // namespace htvm::live
