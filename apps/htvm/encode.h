// What the command encode does, for others too.
#pragma once

#include "encode_plan.h"
#include "htvm/result.hpp"

namespace htvm::app {

// Tells of it as the command does.
Result<void> encode(const EncodePlan& plan);

}  // namespace htvm::app
