// Everything that htvm compare measured, as it is printed and written.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "comparison_measuring.h"
#include "comparison_request.h"
#include "htvm/result.hpp"

namespace htvm::app {

// One line per frame, to options.csv or standard output. The PSNR of each frame uses the peak of the sequence, so that
// frames can be compared with each other.
Result<void> write_csv(const ComparisonRequest& options, const Measured& measured, double peak_mm);
nlohmann::json as_json(const ComparisonRequest& options, const Measured& measured, double peak_mm);
std::string as_table(const ComparisonRequest& options, const Measured& measured);

}  // namespace htvm::app
