// A figure of the reproduction, as the report and the JSON hold it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace htvm::lab {

// A picture beside others.
struct Tile {
    std::filesystem::path png;
    std::string label;  // under it
};

struct Figure {
    std::string number;  // of the paper's figure, such as 6
    std::string title;
    std::string paper;                               // what the paper found
    std::string found;                               // what this run found
    std::string how;                                 // how it was measured, where it differs from the paper's way
    std::vector<std::filesystem::path> charts = {};  // SVG files
    std::vector<std::vector<Tile>> tiles = {};       // rows of pictures
    std::string skipped = {};                        // why there is nothing to see; empty: there is
};

// One sentence of the paper beside what this run says to it.
struct Claim {
    std::string what, paper, here;
    std::string verdict;  // a few words
    bool holds = false;
};

}  // namespace htvm::lab
