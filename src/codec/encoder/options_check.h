// Checks that the encoder's options make sense.
#pragma once

#include "htvm/encoder.hpp"

namespace htvm::internal {

// bad_input, naming the option and its range, if an option is out of range or contradicts another.
Result<void> check(const EncoderOptions& options);

}  // namespace htvm::internal
