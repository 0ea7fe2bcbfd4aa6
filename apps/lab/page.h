// The report of htvm-lab reproduce: figures, claims and tables as data, and the one HTML file that shows them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "htvm/result.hpp"

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

// ---- The report: one HTML file that holds all it shows --------------------------------------------------------------

using FactList = std::vector<std::pair<std::string, std::string>>;

struct Table {
    std::string title, note;
    std::vector<std::string> head;
    std::vector<std::vector<std::string>> rows;  // as long as head; the first cell is words, the others numbers
};

struct Report {
    std::string title, subtitle;
    std::vector<std::string> summary;  // paragraphs
    std::vector<Tile> opening;         // pictures under the summary
    std::string opening_caption;
    std::vector<Claim> claims;
    std::vector<Figure> figures;
    std::vector<Table> tables;
    FactList capture, machine;
    std::vector<std::string> commands;
};

// & < > " and ' as HTML writes them.
std::string escaped(const std::string& text);
std::string base64(std::span<const std::uint8_t> bytes);

// An SVG file's text as a part of a page: without the XML head, and every id with `prefix` before it, so that several
// can stand in one page.
std::string inline_svg(const std::string& svg, const std::string& prefix);

// The page; reads the files that figures and tiles name.
Result<std::string> report_page(const Report& report);

// ---- What a measurement was made with -------------------------------------------------------------------------------

// The value after "key" and a colon in the first line that starts with key, as /proc/cpuinfo and /proc/meminfo write
// it; empty where there is none.
std::string proc_value(const std::string& text, const std::string& key);

// Name and value: processor, cores, memory, system, compiler, libraries, program, date.
std::vector<std::pair<std::string, std::string>> machine_facts(unsigned threads);

// The command that runs, as a person would type it.
std::string own_command();

}  // namespace htvm::lab
