// The encoder's options on the command line: those of the library's list (htvm/option_list.hpp), and a quality.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "command_line/capture.h"
#include "htvm/encoder.hpp"
#include "htvm/option_list.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

struct EncodingOptions {
    double quality = default_quality;
    std::string profile = "tracked";
    std::string intra = "tfan";
    std::string radii_file;
    std::string floor;                    // metres, or "lowest": of the first frame's vertices; empty: not known
    std::vector<MetadataEntry> metadata;  // in the order given
    int passes = 0;                       // for rate control: 2 means that the caller runs a first pass
                                          // before
    std::vector<std::pair<const Option*, double>> given;  // options of the library's list that were given, in the
                                                          // library's units
};

void add_encoding_options(CLI::App& command, EncodingOptions& options);

// A different number each time, for streams that may be live.
std::uint64_t random_session();

// Ends with a usage error (CLI::ValidationError) if options contradict each other or have no effect in the profile.
void check_together(const EncodingOptions& options);

// Whether the user set this option of the library's list.
bool is_given(const EncodingOptions& options, std::string_view name);
// The value it was given, in the library's unit, or nothing.
std::optional<double> given_value(const EncodingOptions& options, std::string_view name);

// The library's options for a capture; reads the file of radii if one is given.
Result<EncoderOptions> encoder_options(const EncodingOptions& options, const Capture& capture);

// All options of the library, as in docs/options.md.
std::string options_in_markdown();

}  // namespace htvm::app
