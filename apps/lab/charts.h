// Rate-distortion curves, drawn by gnuplot (a separate program, Debian's gnuplot-nox).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "results.h"

namespace htvm::lab {

struct Axis {
    double low = 0, high = 1;
    bool logarithmic = false;
    std::vector<double> tics;
};

// From 0 to slightly above the largest value; logarithmic if the largest is over 8 times the smallest, so that a coder
// at a tenth of another's rate can still be read. Values must be > 0.
Axis rate_axis(std::span<const double> values);
// Logarithmic, so that equal factors are equal distances; tics at 1, 2 and 5 times powers of ten, and at more first
// digits if fewer than five of those are in the range. Values must be > 0.
Axis error_axis(std::span<const double> values);
// From a round number below the smallest to one above the largest value; a PSNR has no natural zero, nor has an SSIM.
// least_range: what it shows at least, however close the values are.
Axis psnr_axis(std::span<const double> values, double least_range = 1);

// The text as gnuplot's single-quoted string.
std::string quoted(const std::string& text);
// The gnuplot lines that set the x or y axis; without tics, gnuplot chooses them.
std::string axis_lines(char which, const Axis& axis, const std::string& label);

struct Curves {
    std::string capture;           // its name, for every title
    std::filesystem::path folder;  // where the pictures go
    bool png = false;              // also write PNG
};

// The pictures that curve_script draws, without extension: every measure that was taken, over bpvf and Mbit/s.
std::vector<std::string> curve_names(std::span<const RdPoint> points);

// A gnuplot script, data included, that draws them all.
std::string curve_script(std::span<const RdPoint> points, const Curves& curves);

// Writes the script (curves.gp) and runs gnuplot on it: true if pictures were drawn, false if gnuplot is not installed.
Result<bool> draw_curves(std::span<const RdPoint> points, const Curves& curves);

// ---- Charts of the reproduction -------------------------------------------------------------------------------------

struct ChartLine {
    std::string title;                          // in the legend
    std::string colour = "#000000";             // #rrggbb
    int mark = 7;                               // gnuplot's point type
    int dash = 1;                               // gnuplot's dash type; 1: solid
    std::vector<std::array<double, 2>> points;  // x, y; drawn in this order
};

// A vertical line with a label.
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
    std::string key = "tmargin center horizontal nobox";  // position of the legend, in gnuplot's words; empty: none
    int width = 640, height = 440;
};

// Points in space: x and y on the floor, z upwards; every line is a row of points.
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

// How a coder looks in every chart of the report; the same as in the curves of htvm-lab rd.
struct CoderLook {
    const char* name;    // for display
    const char* colour;  // #rrggbb
    int mark;
};
CoderLook look_of_coder(const std::string& coder);

// An axis from 0 to slightly above the largest value. Values must be >= 0.
Axis zero_axis(std::span<const double> values);

// A coder's measured points, by rising rate.
ChartLine line_of(std::span<const RdPoint> points, const std::string& coder, const std::string& measure);

// The axes that fit all lines: rates from 0 (logarithmic over wide ranges), errors logarithmic, PSNR linear.
void fit_axes(Chart& chart, bool is_error);

// A gnuplot script, data included, that draws the chart as SVG to `output`.
std::string chart_script(const Chart& chart, const std::filesystem::path& output);
std::string chart_script(const SpaceChart& chart, const std::filesystem::path& output);

// Runs gnuplot on the scripts. Unsupported, with what to install, if there is no gnuplot.
Result<void> run_gnuplot(const std::string& script, const std::filesystem::path& script_file);

}  // namespace htvm::lab
