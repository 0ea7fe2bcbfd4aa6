// The report's words and tables, and its JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "reproduce_figures.h"
#include "reproduce_page.h"

namespace htvm::lab {

// Paragraphs for the top of the page. `what`: the capture in words, such as "20 frames of samba".
std::vector<std::string> summary_paragraphs(const std::string& what, const Findings& findings,
                                            const std::vector<Claim>& claims);

// Rates, errors and speeds; layers of EP-frames; rate differences and crossings; colours and pictures.
std::vector<Table> result_tables(const Findings& findings);

nlohmann::json report_json(const Report& report, const Findings& findings);

}  // namespace htvm::lab
