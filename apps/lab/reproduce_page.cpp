#include "reproduce_page.h"

#include <fmt/core.h>

#include "io/mesh_file.h"
#include "reproduce_style.h"

namespace htvm::lab {
namespace {

constexpr std::uint64_t largest_file = std::uint64_t{1} << 26;

std::string replaced(const std::string& text, const std::string& from, const std::string& to) {
    std::string out;
    std::size_t begin = 0;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, begin)) {
        out += text.substr(begin, at - begin) + to;
        begin = at + from.size();
    }
    return out + text.substr(begin);
}

Result<std::string> chart_html(const Figure& figure, std::size_t index) {
    const auto bytes = read_file(figure.charts[index], largest_file);
    if (!bytes) return tl::unexpected(bytes.error());
    std::string number = figure.number;
    for (auto& c : number)
        if (c < '0' || c > '9') c = '_';
    return "<div class=\"plate chart\">" +
           inline_svg(std::string(bytes->begin(), bytes->end()), fmt::format("f{}_{}_", number, index)) + "</div>\n";
}

Result<std::string> tile_html(const Tile& tile) {
    const auto bytes = read_file(tile.png, largest_file);
    if (!bytes) return tl::unexpected(bytes.error());
    const auto label = escaped(tile.label);
    return fmt::format("<div class=\"tile\"><img alt=\"{}\" src=\"data:image/png;base64,{}\"><span>{}</span></div>\n",
                       label, base64(*bytes), label);
}

Result<std::string> tile_row(const std::vector<Tile>& tiles) {
    std::string out = "<div class=\"plate tiles\">";
    for (const auto& tile : tiles) {
        const auto html = tile_html(tile);
        if (!html) return html;
        out += *html;
    }
    return out + "</div>\n";
}

std::string caption_line(const char* name, const std::string& text) {
    return text.empty() ? std::string() : fmt::format("<p><b>{}</b> {}</p>\n", name, escaped(text));
}

Result<std::string> figure_html(const Figure& figure) {
    std::string out = fmt::format("<figure id=\"figure-{}\">\n<h3>Figure {}: {}</h3>\n", escaped(figure.number),
                                  escaped(figure.number), escaped(figure.title));
    if (!figure.charts.empty()) out += figure.charts.size() > 1 ? "<div class=\"charts\">\n" : "<div>\n";
    for (std::size_t i = 0; i < figure.charts.size(); ++i) {
        const auto chart = chart_html(figure, i);
        if (!chart) return chart;
        out += *chart;
    }
    if (!figure.charts.empty()) out += "</div>\n";
    for (const auto& row : figure.tiles) {
        const auto html = tile_row(row);
        if (!html) return html;
        out += *html;
    }
    out += "<figcaption>\n" + caption_line("The paper:", figure.paper);
    out += figure.skipped.empty() ? caption_line("Here:", figure.found) : caption_line("Left out:", figure.skipped);
    return out + caption_line("How:", figure.how) + "</figcaption>\n</figure>\n";
}

std::string table_html(const Table& table) {
    std::string out = "<h3>" + escaped(table.title) + "</h3>\n<div class=\"scroll\"><table>\n<tr>";
    for (const auto& cell : table.head) out += "<th>" + escaped(cell) + "</th>";
    out += "</tr>\n";
    for (const auto& row : table.rows) {
        out += "<tr>";
        for (const auto& cell : row) out += "<td>" + escaped(cell) + "</td>";
        out += "</tr>\n";
    }
    out += "</table></div>\n";
    return table.note.empty() ? out : out + "<p class=\"note\">" + escaped(table.note) + "</p>\n";
}

std::string facts_html(const std::string& title, const FactList& facts) {
    std::string out = "<h3>" + escaped(title) + "</h3>\n<dl>\n";
    for (const auto& [name, value] : facts) out += "<dt>" + escaped(name) + "</dt><dd>" + escaped(value) + "</dd>\n";
    return out + "</dl>\n";
}

std::string claims_html(const std::vector<Claim>& claims) {
    if (claims.empty()) return {};
    std::string out =
        "<h2 id=\"claims\">The paper's findings, checked</h2>\n<div class=\"scroll\"><table class=\"claims\">\n"
        "<tr><th>Finding</th><th>The paper</th><th>Here</th><th></th></tr>\n";
    for (const auto& claim : claims)
        out +=
            fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"{}\">{}</td></tr>\n", escaped(claim.what),
                        escaped(claim.paper), escaped(claim.here), claim.holds ? "yes" : "no", escaped(claim.verdict));
    return out + "</table></div>\n";
}

}  // namespace

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) out += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

std::string inline_svg(const std::string& svg, const std::string& prefix) {
    const auto begin = svg.find("<svg");
    if (begin == std::string::npos) return {};
    std::string out = svg.substr(begin);
    for (const char* quote : {"'", "\""}) {
        out = replaced(out, fmt::format(" id={}", quote), fmt::format(" id={}{}", quote, prefix));
        out = replaced(out, fmt::format("href={}#", quote), fmt::format("href={}#{}", quote, prefix));
    }
    return replaced(out, "url(#", "url(#" + prefix);
}

Result<std::string> report_page(const Report& report) {
    std::string out = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
    out += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    out += "<meta name=\"color-scheme\" content=\"light dark\">\n";
    out += fmt::format("<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<header>\n<h1>{}</h1>\n<p>{}</p>\n",
                       escaped(report.title), report_style, escaped(report.title), escaped(report.subtitle));
    out += "</header>\n<main>\n<section class=\"summary\">\n";
    for (const auto& paragraph : report.summary) out += "<p>" + escaped(paragraph) + "</p>\n";
    out += "</section>\n";
    if (!report.opening.empty()) {
        const auto row = tile_row(report.opening);
        if (!row) return row;
        out += "<figure class=\"opening\">\n" + *row + "<figcaption><p>" + escaped(report.opening_caption) +
               "</p></figcaption></figure>\n";
    }
    out += claims_html(report.claims);
    out += "<h2>Figures</h2>\n<nav>";
    for (const auto& figure : report.figures)
        out += fmt::format("<a href=\"#figure-{}\">{}</a> ", escaped(figure.number), escaped(figure.number));
    out += "</nav>\n";
    for (const auto& figure : report.figures) {
        const auto html = figure_html(figure);
        if (!html) return html;
        out += *html;
    }
    out += "<h2>Numbers</h2>\n";
    for (const auto& table : report.tables) out += table_html(table);
    out += "<h2>How it was made</h2>\n" + facts_html("Capture", report.capture);
    out += facts_html("Machine and programs", report.machine) + "<h3>Commands</h3>\n<pre>";
    for (const auto& command : report.commands) out += escaped(command) + "\n";
    return out + "</pre>\n</main>\n</body>\n</html>\n";
}

}  // namespace htvm::lab
