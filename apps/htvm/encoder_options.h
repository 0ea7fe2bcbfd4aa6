// The encoder's options on the command line, shared by every command that encodes.
#pragma once

#include <string>

#include "command_line/capture.h"
#include "htvm/encoder.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

// About 0.6 mm off the surface (M2).
constexpr double default_quality = 42;

struct EncodingOptions {
    double quality = default_quality;
    double geometry_step = 0;  // mm; 0: by quality
    double colour_step = 0;    // levels; 0: by quality
    double lambda = -1;        // below 0: the library's default
    int key_interval = 30, least_key_interval = 1;
    std::string decide;                                                                     // empty: by profile
    double predicted_below = -1, intra_above = -1, still_below = -1, animation_error = -1;  // mm; below 0: by profile
    bool no_scene_changes = false;
    double megabits = 0, buffer_seconds = 1;  // Mbit/s, s: rate control; 0: none
    int passes = 1;                           // of rate control: the caller runs the first of two
    double target_error = 0;                  // mm; 0: none
    std::string intra = "tfan";
    std::string profile = "tracked";
    std::string tracked_references;       // empty: the library's default
    double simplify = -1;                 // below 0: the library's default
    double node_spacing = 0;              // mm; 0: the library's default
    double weight_width = -1;             // mm; below 0: by profile
    std::string reference, registration;  // empty: by profile
    std::string radii_file;
    bool keep_duplicates = false;
    int nearest_vertices = 16;
    unsigned threads = 0;
};

void add_encoding_options(CLI::App& command, EncodingOptions& options);

// Ends with a usage error (CLI::ValidationError) where an option of another profile than the chosen one was given.
void check_profile(const CLI::App& command, const EncodingOptions& options);

// The library's options for a capture; reads the radii's file where one is named.
Result<EncoderOptions> encoder_options(const EncodingOptions& options, const Capture& capture);

}  // namespace htvm::app
