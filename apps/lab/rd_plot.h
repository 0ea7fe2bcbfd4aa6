// Rate-distortion curves, drawn by gnuplot (a program of its own, Debian's gnuplot-nox).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "rd_result.h"

namespace htvm::lab {

struct Axis {
    double low = 0, high = 1;
    bool logarithmic = false;
    std::vector<double> tics;
};

// From 0 to a little above the largest value; logarithmic where the largest is over 8 times the smallest, so that a
// coder at a tenth of another's rate can still be read off. Values must be > 0.
Axis rate_axis(std::span<const double> values);
// Logarithmic, so that equal factors are equal distances; tics at 1, 2 and 5 times powers of ten, and at more first
// digits where fewer than five of those fall into the range. Values must be > 0.
Axis error_axis(std::span<const double> values);
// From a round number below the smallest to one above the largest value; a PSNR has no zero to start from.
Axis psnr_axis(std::span<const double> values);

// As gnuplot's single-quoted string.
std::string quoted(const std::string& text);
// gnuplot's lines that set the x or y axis; without tics it chooses them.
std::string axis_lines(char which, const Axis& axis, const std::string& label);

struct Curves {
    std::string capture;           // names it in every title
    std::filesystem::path folder;  // where the pictures go
    bool png = false;              // beside the SVG
};

// The pictures that curve_script draws, without extension: every measure that was taken, against bpvf and Mbit/s.
std::vector<std::string> curve_names(std::span<const RdPoint> points);

// A gnuplot script, data included, that draws them all.
std::string curve_script(std::span<const RdPoint> points, const Curves& curves);

// Writes the script (curves.gp) and runs gnuplot on it: true where pictures were drawn, false where there is no
// gnuplot.
Result<bool> draw_curves(std::span<const RdPoint> points, const Curves& curves);

}  // namespace htvm::lab
