// The report: one HTML file that holds all it shows.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "htvm/result.hpp"
#include "reproduce_figure.h"

namespace htvm::lab {

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

}  // namespace htvm::lab
