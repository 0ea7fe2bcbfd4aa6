// The report of htvm-lab reproduce: figures, claims and tables as data, and the one HTML file that shows them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::lab {

// A picture among others.
struct Tile {
    std::filesystem::path png;
    std::string label;  // shown under it
};

struct Figure {
    std::string number;  // of the figure in the paper, such as 6
    std::string title;
    std::string paper;                               // what the paper found
    std::string found;                               // what this run found
    std::string how;                                 // how it was measured, if not in the paper's way
    std::vector<std::filesystem::path> charts = {};  // SVG files
    std::vector<std::vector<Tile>> tiles = {};       // rows of pictures
    std::string skipped = {};                        // why there is nothing to see; empty: there is something
};

// One sentence of the paper, and what this run says about it.
struct Claim {
    std::string what, paper, here;
    std::string verdict;  // a few words
    bool holds = false;
};

// ---- The report: one HTML file that contains everything it shows ----------------------------------------------------

using FactList = std::vector<std::pair<std::string, std::string>>;

struct Table {
    std::string title, note;
    std::vector<std::string> head;
    std::vector<std::vector<std::string>> rows;  // as long as head; the first cell is text, the others numbers
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

// Replaces & < > " and ' as in HTML.
std::string escaped(const std::string& text);
std::string base64(std::span<const std::uint8_t> bytes);

// The text of an SVG file as part of a page: without the XML header, and with `prefix` before every id, so that one
// page can contain several.
std::string inline_svg(const std::string& svg, const std::string& prefix);

// The page; reads the files that figures and tiles refer to.
Result<std::string> report_page(const Report& report);

// ---- The circumstances of a measurement -----------------------------------------------------------------------------

// The value after "key" and a colon in the first line that starts with key, as in /proc/cpuinfo and /proc/meminfo;
// empty if there is none.
std::string proc_value(const std::string& text, const std::string& key);

// Name and value: processor, cores, memory, system, compiler, libraries, program, date.
std::vector<std::pair<std::string, std::string>> machine_facts(unsigned threads);

// The command line of this process, as typed by the user.
std::string own_command();

}  // namespace htvm::lab
