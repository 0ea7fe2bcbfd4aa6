// What the command encode does, for others.
#pragma once

#include <string>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::app {

// Encodes a capture (CaptureOptions::inputs) by the default options, and tells of it as the command does. Nothing is
// left where it fails or is interrupted.
Result<void> encode_by_default(const std::vector<std::string>& inputs, const std::string& output);

}  // namespace htvm::app
