// The encoder's options on the command line: those of the library's list (htvm/option_list.hpp), and a quality.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "command_line/capture.h"
#include "htvm/encoder.hpp"
#include "htvm/option_list.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

// About 0.6 mm off the surface (M2).
constexpr double default_quality = 42;

struct EncodingOptions {
    double quality = default_quality;
    std::string profile = "tracked";
    std::string intra = "tfan";
    std::string radii_file;
    int passes = 1;                                       // of rate control: the caller runs the first of two
    std::vector<std::pair<const Option*, double>> given;  // of the library's list, in its units
};

void add_encoding_options(CLI::App& command, EncodingOptions& options);

// Ends with a usage error (CLI::ValidationError) where options contradict each other or do nothing in the profile.
void check_together(const EncodingOptions& options);

// The library's options for a capture; reads the radii's file where one is named.
Result<EncoderOptions> encoder_options(const EncodingOptions& options, const Capture& capture);

// All options of the library as docs/options.md has them.
std::string options_in_markdown();

}  // namespace htvm::app
