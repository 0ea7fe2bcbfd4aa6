// Figures 8, 9, 14 and 15: frames of the paper's coder and of TFAN at the same rates, beside the original.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <vector>

#include "reproduce_figures.h"
#include "reproduce_pictures.h"

namespace htvm::lab {

struct GalleryOptions {
    std::filesystem::path folder;   // for the PNG files
    std::optional<double> azimuth;  // degrees; none: from the front, as far as that can be told
    int key_interval = 30;
    double colour_step = 6;
    unsigned threads = 1;
};

struct Gallery {
    std::vector<Figure> figures;
    std::vector<Tile> opening;  // original, the paper's coder, TFAN; may be empty
    std::string opening_caption;
};

// The wanted ones of figures 8, 9, 14 and 15. Rates are read off the findings' points. Beside the tiles of the
// opening, first_results.png holds them side by side.
Result<Gallery> picture_figures(const SourceFrames& source, const Findings& findings, const std::set<int>& wanted,
                                const GalleryOptions& options);

}  // namespace htvm::lab
