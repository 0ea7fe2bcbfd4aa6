// The files that say who may: tokens, keys. The operator names them, and may name anything.
#pragma once

#include <string>

#include "htvm/result.hpp"

namespace htvm::live {

// All of a file's text. bad_input, with its name, if it is a folder, cannot be read, or is larger than 4 MiB.
Result<std::string> read_access_file(const std::string& path);

}  // namespace htvm::live
