// The encoder's options on the command line: those of the library's list (htvm/option_list.hpp), and some beside it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "htvm/encoder.hpp"
#include "htvm/option_list.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

enum class IntraCoder : std::uint8_t { tfan, draco };

// Places on the one scale of quality, by what a stream is for.
enum class Preset : std::uint8_t { web, studio, master };
double quality_of(Preset preset);

struct EncodingOptions {
    double quality = default_quality;
    std::optional<Preset> preset;  // gives the quality
    Profile profile = Profile::tracked;
    IntraCoder intra = IntraCoder::tfan;
    std::string radii_file;               // empty: none
    std::string floor;                    // metres, or "lowest": of the first frame's vertices; empty: not known
    std::optional<double> front;          // degrees around the body, as an azimuth; none: not known
    std::vector<MetadataEntry> metadata;  // in the order given
    int passes = 0;                       // over the capture, for a bitrate; 0: as many as it needs
    bool draws_session = false;           // the session's number is a random one
    std::vector<std::pair<const Option*, double>> given;  // options of the library's list that were given, in the
                                                          // library's units
};

void add_encoding_options(CLI::App& command, EncodingOptions& options);

// The library's options: the profile's defaults, the quality, and what was given.
EncoderOptions encoder_options(const EncodingOptions& options);

// All options of the library, as in docs/options.md.
std::string options_in_markdown();

}  // namespace htvm::app
