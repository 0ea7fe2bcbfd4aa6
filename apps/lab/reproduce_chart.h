// Charts of the reproduction, drawn by gnuplot.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "rd_plot.h"
#include "rd_result.h"

namespace htvm::lab {

struct ChartLine {
    std::string title;                          // in the legend
    std::string colour = "#000000";             // #rrggbb
    int mark = 7;                               // gnuplot's point type
    int dash = 1;                               // gnuplot's dash type; 1: solid
    std::vector<std::array<double, 2>> points;  // x, y; drawn in this order
};

// A vertical line with words beside it.
struct ChartRule {
    double x = 0;
    std::string title;
    std::string colour = "#000000";
    int dash = 1;
};

struct Chart {
    std::string title, x_label, y_label;
    Axis x, y;
    std::vector<ChartLine> lines;
    std::vector<ChartRule> rules;
    double bar_width = 0;                                 // > 0: the lines are bars of this width instead
    std::string key = "tmargin center horizontal nobox";  // where the legend is, in gnuplot's words; empty: none
    int width = 640, height = 440;
};

// Points in space: x and y on the floor, z upwards; every line a row of points.
struct SpaceChart {
    struct Series {
        std::string title, colour;
        int mark = 7;
        std::vector<std::vector<std::array<double, 3>>> rows;
    };
    std::string title, x_label, y_label, z_label;
    std::vector<Series> series;
    int width = 720, height = 560;
};

// How a coder looks in every chart of the report; the same as in htvm-lab rd's curves.
struct CoderLook {
    const char* name;    // as people call it
    const char* colour;  // #rrggbb
    int mark;
};
CoderLook look_of_coder(const std::string& coder);

// An axis from 0 to a little above the largest value. Values >= 0.
Axis zero_axis(std::span<const double> values);

// A coder's measured points, by rising rate.
ChartLine line_of(std::span<const RdPoint> points, const std::string& coder, const std::string& measure);

// The axes that hold all lines: rates from 0 (logarithmic over wide ranges), errors logarithmic, PSNR as it comes.
void fit_axes(Chart& chart, bool is_error);

// A gnuplot script, data included, that draws the chart as SVG to `output`.
std::string chart_script(const Chart& chart, const std::filesystem::path& output);
std::string chart_script(const SpaceChart& chart, const std::filesystem::path& output);

// Runs gnuplot on the scripts. Unsupported, saying what to install, where there is no gnuplot.
Result<void> run_gnuplot(const std::string& script, const std::filesystem::path& script_file);

}  // namespace htvm::lab
