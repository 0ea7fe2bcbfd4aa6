// What a call of htvm compare asks for.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "io/texture_file.h"
#include "metrics/compare.h"
#include "picture_options.h"

namespace htvm::app {

struct ComparisonRequest {
    std::string first;                   // name on the command line
    std::vector<std::string> others;     // names behind it
    std::vector<std::string> originals;  // of these
    std::string decoded;                 // and the last
    std::optional<LengthUnit> unit;      // of files; not given: guessed from the first one
    std::string timestamps;
    std::vector<std::string> ignored;  // globs: files that are no frames
    std::string truth;                 // folder; empty: no drift
    bool coverage_if_open = false;     // measure coverage if the first original is open
    std::size_t frames = 0;            // 0: all
    std::vector<std::string> only;
    CompareOptions compare;
    unsigned threads = 0;
    DecoderOptions limits;   // for streams
    TextureOptions texture;  // of the originals
    ShadingOptions shading;
    bool flicker = true, follow_sequence = false, json = false;
    double peak_mm = 0;
    std::string csv, pictures;
    int picture_views = 1;
};

}  // namespace htvm::app
