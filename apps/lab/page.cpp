#include "page.h"

#include <draco/core/draco_version.h>
#include <embree3/rtcore_config.h>
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "coders.h"
#include "io/mesh_file.h"

namespace htvm::lab {

// ---- The report: one HTML file that contains everything it shows ----------------------------------------------------

namespace {

constexpr const char* report_style = R"css(
:root{--page:#fbfaf8;--ink:#1f2328;--soft:#5b636d;--line:#dcdad5;--card:#fff;--accent:#0072b2;--yes:#00704f;--no:#a04000}
@media (prefers-color-scheme:dark){:root{--page:#16181c;--ink:#e6e6e3;--soft:#a3a9b2;--line:#373b42;--card:#1e2126;
--accent:#6cb8e6;--yes:#5fcf9f;--no:#f0a467}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--page);color:var(--ink);font:17px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
header,main{max-width:60rem;margin:0 auto;padding:0 1.1rem}
header{padding-top:2.2rem}
header p{color:var(--soft);margin:.2rem 0 0}
h1{font-size:1.9rem;line-height:1.2;margin:0}
h2{font-size:1.4rem;margin:3rem 0 .8rem;padding-top:1rem;border-top:1px solid var(--line)}
h3{font-size:1.08rem;margin:0 0 .7rem}
.summary{font-size:1.12rem;max-width:46rem;margin-top:1.4rem}
.summary p{margin:.7rem 0}
figure{margin:0 0 1.8rem;padding:1.1rem;background:var(--card);border:1px solid var(--line);border-radius:10px}
figure:target{border-color:var(--accent)}
figcaption p{margin:.55rem 0 0;font-size:.95rem;max-width:48rem}
figcaption b{color:var(--accent);font-weight:600}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,23rem),1fr));gap:.8rem}
.plate{background:#fff;color:#222;border-radius:6px;overflow-x:auto}
.chart svg{display:block;width:100%;min-width:24rem;max-width:46rem;height:auto;margin:0 auto}
.tiles{display:flex;gap:.5rem;padding:.5rem;margin-bottom:.5rem}
.tile{flex:1 0 8rem;min-width:0;max-width:24rem;text-align:center;margin:0 auto}
.tile img{max-width:100%;max-height:30rem;display:block;margin:0 auto;object-fit:contain}
.tile span{display:block;font-size:.82rem;line-height:1.35;color:#333;padding:.3rem}
nav{margin:0 0 1.2rem}
nav a{display:inline-block;min-width:2rem;text-align:center;padding:.15rem .4rem;margin:.1rem;border:1px solid var(--line);
border-radius:6px;color:var(--accent);text-decoration:none}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums;min-width:100%}
th,td{padding:.32rem .6rem;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}
th{color:var(--soft);font-weight:600}
th:first-child,td:first-child{text-align:left}
.claims td,.claims th{text-align:left;white-space:normal;min-width:7rem;vertical-align:top}
.yes{color:var(--yes);font-weight:600}.no{color:var(--no);font-weight:600}
.note{color:var(--soft);font-size:.88rem}
.scroll+h3,.note+h3,dl+h3{margin-top:1.8rem}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1rem;margin:0;font-size:.95rem}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
pre{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:8px;padding:.8rem;font-size:.85rem}
@media (max-width:34rem){body{font-size:16px}figure{padding:.7rem}dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
)css";

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

// ---- The circumstances of a measurement -----------------------------------------------------------------------------

namespace {

std::string text_of(const char* file) {
    std::ifstream in(file);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
}

std::string output_of(const char* command) {
    std::string out;
    if (FILE* pipe = popen(command, "r")) {
        std::array<char, 256> line{};
        if (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) out = line.data();
        pclose(pipe);
    }
    while (!out.empty() && (out.back() == '\n' || out.back() == ' ')) out.pop_back();
    return out;
}

std::string system_name() {
    std::istringstream lines(text_of("/etc/os-release"));
    const std::string key = "PRETTY_NAME=";
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key)) continue;
        std::string name = line.substr(key.size());
        std::erase(name, '"');
        return name;
    }
    return "unknown";
}

std::string now() {
    const auto time = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm utc{};
    gmtime_r(&time, &utc);
    std::array<char, 64> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc);
    return text.data();
}

}  // namespace

std::string proc_value(const std::string& text, const std::string& key) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key)) continue;
        const auto colon = line.find(':');
        if (colon == std::string::npos) continue;
        const auto begin = line.find_first_not_of(" \t", colon + 1);
        if (begin == std::string::npos) return {};
        return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
    }
    return {};
}

std::vector<std::pair<std::string, std::string>> machine_facts(unsigned threads) {
    const auto cpu = proc_value(text_of("/proc/cpuinfo"), "model name");
    const auto kilobytes = std::strtod(proc_value(text_of("/proc/meminfo"), "MemTotal").c_str(), nullptr);
    const auto gnuplot = output_of("gnuplot --version 2>/dev/null");
#ifdef NDEBUG
    const char* build = "optimised";
#else
    const char* build = "with assertions";
#endif
    return {{"Program", fmt::format("htvm-lab {}, {}", HTVM_VERSION, build)},
            {"Date", now()},
            {"Processor", fmt::format("{}, {} cores, {} threads used", cpu.empty() ? "unknown" : cpu,
                                      std::thread::hardware_concurrency(), threads)},
            {"Memory", fmt::format("{:.1f} GiB", kilobytes / (1024 * 1024))},
            {"System", system_name()},
#ifdef __clang__
            {"Compiler", "clang " __clang_version__},
#else
            {"Compiler", "g++ " __VERSION__},
#endif
            {"Libraries", fmt::format("Draco {}, Embree {}, nlohmann/json {}.{}.{}, fmt {}.{}.{}, CLI11 {}",
                                      draco::kDracoVersion, RTC_VERSION_STRING, NLOHMANN_JSON_VERSION_MAJOR,
                                      NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH, FMT_VERSION / 10000,
                                      FMT_VERSION / 100 % 100, FMT_VERSION % 100, CLI11_VERSION)},
            {"Charts", gnuplot.empty() ? "no gnuplot" : gnuplot}};
}

std::string own_command() {
    std::ifstream in("/proc/self/cmdline", std::ios::binary);
    std::string out;
    for (std::string word; std::getline(in, word, '\0');) {
        if (out.empty()) {
            out = word.substr(word.find_last_of('/') + 1);
            continue;
        }
        const bool plain =
            word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./,=+:@%-") ==
            std::string::npos;
        out += " " + (plain && !word.empty() ? word : quoted_for_shell(word));
    }
    return out;
}

}  // namespace htvm::lab
