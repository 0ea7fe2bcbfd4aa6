#include "charts.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "coders.h"
#include "results.h"
#include "sweep.h"

namespace htvm::lab {

using namespace app;

// ---- Rate-distortion curves -----------------------------------------------------------------------------------------

namespace {

// How a coder's curve looks. The colours can be distinguished by colour-blind people too (after Okabe and Ito); the
// marks distinguish curves that lie on each other: disc, square, triangle, diamond, inverted triangle.
struct Look {
    const char* rgb;
    int mark;
};
struct NamedLook {
    const char* coder;
    Look look;
};
// Known coders look the same in every picture.
constexpr std::array<NamedLook, 8> named_looks = {{{"paper", {"#0072b2", 7}},
                                                   {"htvm-ep", {"#009e73", 5}},
                                                   {"htvm-motion", {"#56b4e9", 7}},
                                                   {"htvm-rd", {"#000000", 5}},
                                                   {"tfan", {"#e69f00", 9}},
                                                   {"tfan-mpeg", {"#8c564b", 8}},
                                                   {"draco10", {"#d55e00", 13}},
                                                   {"draco7", {"#cc79a7", 11}}}};
constexpr std::array<Look, 5> other_looks = {
    {{"#56b4e9", 7}, {"#000000", 5}, {"#117733", 9}, {"#7f7f7f", 13}, {"#6a3d9a", 11}}};

Look look_of(const std::vector<std::string>& coders, const std::string& name) {
    std::size_t others = 0;
    for (const auto& coder : coders) {
        const auto known = std::find_if(named_looks.begin(), named_looks.end(),
                                        [&](const NamedLook& named) { return coder == named.coder; });
        if (coder == name) return known != named_looks.end() ? known->look : other_looks[others % other_looks.size()];
        if (known == named_looks.end()) ++others;
    }
    return other_looks[0];
}

// A step of 1, 2 or 5 times a power of ten that divides `span` into at most `most` parts.
double round_step(double span, int most) {
    const double rough = span / most, power = std::pow(10, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= rough * (1 - 1e-9)) return factor * power;
    return 10 * power;
}

std::vector<double> linear_tics(double low, double high, double step) {
    std::vector<double> out;
    for (double tic = std::ceil(low / step - 1e-9) * step; tic <= high + step * 1e-9; tic += step)
        out.push_back(std::abs(tic) < step * 1e-9 ? 0 : tic);
    return out;
}

std::vector<double> logarithmic_tics(double low, double high, std::span<const double> digits) {
    std::vector<double> out;
    for (double power = std::pow(10, std::floor(std::log10(low))); power <= high; power *= 10)
        for (const double digit : digits)
            if (digit * power >= low * (1 - 1e-9) && digit * power <= high * (1 + 1e-9)) out.push_back(digit * power);
    return out;
}

Axis logarithmic_axis(double smallest, double largest) {
    Axis axis;
    axis.logarithmic = true;
    axis.low = smallest / 1.12;
    axis.high = largest * 1.12;
    constexpr std::array<double, 3> few = {1, 2, 5};
    constexpr std::array<double, 5> more = {1, 2, 3, 5, 7};
    constexpr std::array<double, 9> many = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    for (const std::span<const double> digits :
         {std::span<const double>(few), std::span<const double>(more), std::span<const double>(many)})
        if (axis.tics.size() < 5) axis.tics = logarithmic_tics(axis.low, axis.high, digits);
    return axis;
}

struct Coordinate {
    double x, y;
};

std::vector<Coordinate> curve_of(std::span<const RdPoint> points, const std::string& coder, const Measure& measure,
                                 bool by_bits_per_vertex) {
    std::vector<Coordinate> out;
    for (const auto& point : points) {
        const auto value = point.values.find(measure.key);
        if (point.coder != coder || value == point.values.end()) continue;
        if (measure.is_error && !(value->second > 0)) continue;  // cannot be shown on a logarithmic axis
        out.push_back({by_bits_per_vertex ? bits_per_vertex(point) : megabits_per_second(point), value->second});
    }
    std::sort(out.begin(), out.end(), [](const Coordinate& a, const Coordinate& b) { return a.x < b.x; });
    return out;
}

bool drawn(std::span<const RdPoint> points, const Measure& measure) {
    return measure.is_curve && std::any_of(points.begin(), points.end(), [&](const RdPoint& p) {
               const auto value = p.values.find(measure.key);
               return value != p.values.end() && (!measure.is_error || value->second > 0);
           });
}

std::string file_name(const Measure& measure, bool by_bits_per_vertex) {
    return fmt::format("{}_{}", measure.key, by_bits_per_vertex ? "bpvf" : "mbits");
}

// The curves of one picture in gnuplot's language, and the values that its axes must include.
struct PictureCurves {
    std::string data, plots;
    std::vector<double> xs, ys;
};

PictureCurves picture_curves(std::span<const RdPoint> points, const Measure& measure, bool by_bits_per_vertex) {
    PictureCurves out;
    const auto coders = coders_of(points);
    int number = 0;
    for (const auto& coder : coders) {
        const auto curve = curve_of(points, coder, measure, by_bits_per_vertex);
        if (curve.empty()) continue;
        const Look look = look_of(coders, coder);
        if (number > 0) out.plots += ", \\\n   ";
        out.plots += fmt::format(
            " $curve{} with linespoints linewidth 2.2 pointtype {} pointsize 0.9 linecolor rgb '{}' title {}", number,
            look.mark, look.rgb, quoted(coder));
        out.data += fmt::format("$curve{} << END\n", number++);
        for (const auto& [x, y] : curve) {
            out.data += fmt::format("{:.8g} {:.8g}\n", x, y);
            out.xs.push_back(x);
            out.ys.push_back(y);
        }
        out.data += "END\n";
    }
    return out;
}

std::string picture_lines(std::span<const RdPoint> points, const Measure& measure, bool by_bits_per_vertex,
                          const Curves& curves) {
    const auto [data, plots, xs, ys] = picture_curves(points, measure, by_bits_per_vertex);
    std::string out = data;
    out += axis_lines('x', rate_axis(xs), by_bits_per_vertex ? "bits per captured vertex (bpvf)" : "Mbit/s");
    // A hundred of the last digits that tables show: 1 dB, 0.01 of an SSIM.
    const double least_range = std::pow(10, 2 - measure.digits);
    out += axis_lines('y', measure.is_error ? error_axis(ys) : psnr_axis(ys, least_range),
                      fmt::format("{}, {}{}", measure.title, measure.unit, measure.is_error ? " (log scale)" : ""));
    out += "set key tmargin center horizontal noenhanced\n";  // inside, it would cover points
    const auto path = curves.folder / file_name(measure, by_bits_per_vertex);
    out += "set terminal svg size 900,620 font 'Helvetica,Arial,sans-serif,16' background 'white'\n";
    out += fmt::format("set output {}\nplot{}\n", quoted(path.string() + ".svg"), plots);
    if (curves.png) {
        out += "set terminal pngcairo size 1200,827 fontscale 1.35 linewidth 1.35 pointscale 1.35 background 'white'\n";
        out += fmt::format("set output {}\nreplot\n", quoted(path.string() + ".png"));
    }
    return out + "unset output\n\n";
}

}  // namespace

std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'') out += c;
        out += c == '\n' ? ' ' : c;
    }
    return out + "'";
}

std::string axis_lines(char which, const Axis& axis, const std::string& label) {
    std::string out =
        fmt::format("{} logscale {}\nset {}range [{:.6g}:{:.6g}]\nset {}label {} noenhanced\n",
                    axis.logarithmic ? "set" : "unset", which, which, axis.low, axis.high, which, quoted(label));
    if (axis.tics.empty()) return out + fmt::format("set {}tics auto\n", which);
    out += fmt::format("set {}tics (", which);
    for (std::size_t i = 0; i < axis.tics.size(); ++i)
        out += fmt::format("{}\"{:.4g}\" {:.6g}", i == 0 ? "" : ", ", axis.tics[i], axis.tics[i]);
    return out + ")\n";
}

Axis rate_axis(std::span<const double> values) {
    if (values.empty()) return {};
    const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
    if (*largest > 8 * *smallest) return logarithmic_axis(*smallest, *largest);
    Axis axis;
    axis.high = 1.06 * *largest;
    axis.tics = linear_tics(0, axis.high, round_step(axis.high, 10));
    return axis;
}

Axis error_axis(std::span<const double> values) {
    if (values.empty()) return {};
    const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
    return logarithmic_axis(*smallest, *largest);
}

Axis psnr_axis(std::span<const double> values, double least_range) {
    if (values.empty()) return {};
    const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
    const double step = round_step(std::max(*largest - *smallest, least_range), 8);
    Axis axis;
    axis.low = std::floor(*smallest / step) * step;
    axis.high = std::ceil(*largest / step + 1e-9) * step;
    axis.tics = linear_tics(axis.low, axis.high, step);
    return axis;
}

std::vector<std::string> curve_names(std::span<const RdPoint> points) {
    std::vector<std::string> out;
    for (const auto& measure : measures())
        if (drawn(points, measure))
            for (const bool by_bits_per_vertex : {true, false}) out.push_back(file_name(measure, by_bits_per_vertex));
    return out;
}

std::string curve_script(std::span<const RdPoint> points, const Curves& curves) {
    std::string out = "# Rate-distortion curves; run gnuplot on this file to draw them again.\n";
    out += fmt::format("set title {} noenhanced\n", quoted(curves.capture));
    out += "set grid linetype 1 linecolor rgb '#dddddd' linewidth 1\nset border 3 linecolor rgb '#444444'\n";
    out += "set tics nomirror out scale 0.6\nset key spacing 1.25 samplen 2.5\n\n";
    for (const auto& measure : measures())
        if (drawn(points, measure))
            for (const bool by_bits_per_vertex : {true, false})
                out += picture_lines(points, measure, by_bits_per_vertex, curves);
    return out;
}

Result<bool> draw_curves(std::span<const RdPoint> points, const Curves& curves) {
    const auto script = curves.folder / "curves.gp";
    if (auto written = write_text(script, curve_script(points, curves)); !written)
        return tl::unexpected(written.error());
    if (std::system("command -v gnuplot >/dev/null 2>&1") != 0) return false;
    const std::string log = quoted_for_shell((curves.folder / "gnuplot.log").string());
    if (std::system(fmt::format("gnuplot {} >{} 2>&1", quoted_for_shell(script.string()), log).c_str()) != 0)
        return fail(ErrorKind::bad_input, "gnuplot failed; it says why in " + log);
    std::error_code ignored;
    std::filesystem::remove(curves.folder / "gnuplot.log", ignored);
    return true;
}

// ---- Charts of the reproduction -------------------------------------------------------------------------------------

namespace {

std::string opening(const std::string& title, int width, int height, const std::filesystem::path& output) {
    std::string out = "reset\n";
    out += fmt::format("set terminal svg size {},{} font 'Helvetica,Arial,sans-serif,15' background 'white'\n", width,
                       height);
    out += fmt::format("set output {}\nset title {} noenhanced\n", quoted(output.string()), quoted(title));
    out += "set grid linetype 1 linecolor rgb '#dddddd' linewidth 1\nset border 3 linecolor rgb '#444444'\n";
    out += "set tics nomirror out scale 0.6\nset key opaque box linecolor rgb '#bbbbbb' spacing 1.2 samplen 2.2\n";
    return out;
}

}  // namespace

CoderLook look_of_coder(const std::string& coder) {
    if (coder == "paper") return {"the paper's coder", "#0072b2", 7};
    if (coder == "htvm-ep") return {"htvm-ep", "#009e73", 5};
    if (coder == "tfan") return {"our TFAN", "#e69f00", 9};
    if (coder == "tfan-mpeg") return {"TFAN as in MPEG-4", "#8c564b", 8};
    if (coder == "draco10") return {"Draco", "#d55e00", 13};
    return {"another coder", "#7f7f7f", 7};
}

Axis zero_axis(std::span<const double> values) {
    Axis axis;
    const double largest = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
    axis.high = largest > 0 ? 1.08 * largest : 1;
    const double step = round_step(axis.high, 8);
    for (int i = 0; i * step <= axis.high * (1 + 1e-9); ++i) axis.tics.push_back(i * step);
    return axis;
}

ChartLine line_of(std::span<const RdPoint> points, const std::string& coder, const std::string& measure) {
    const auto look = look_of_coder(coder);
    ChartLine line{look.name, look.colour, look.mark, 1, {}};
    for (const auto& point : points) {
        const auto value = point.values.find(measure);
        if (point.coder == coder && value != point.values.end() && value->second > 0)
            line.points.push_back({bits_per_vertex(point), value->second});
    }
    std::sort(line.points.begin(), line.points.end());
    return line;
}

void fit_axes(Chart& chart, bool is_error) {
    std::vector<double> xs, ys;
    for (const auto& line : chart.lines) {
        for (const auto& [x, y] : line.points) {
            xs.push_back(x);
            ys.push_back(y);
        }
    }
    chart.x = rate_axis(xs);
    chart.y = is_error ? error_axis(ys) : psnr_axis(ys);
    if (is_error) chart.y_label += " (log scale)";
    if (chart.x.logarithmic) chart.x_label += " (log scale)";
}

std::string chart_script(const Chart& chart, const std::filesystem::path& output) {
    std::string out = opening(chart.title, chart.width, chart.height, output);
    out += chart.key.empty() ? "unset key\n" : fmt::format("set key {} noenhanced\n", chart.key);
    out += axis_lines('x', chart.x, chart.x_label) + axis_lines('y', chart.y, chart.y_label);
    std::string plots;
    auto add = [&](const std::string& plot) { plots += (plots.empty() ? " " : ", \\\n  ") + plot; };
    for (std::size_t i = 0; i < chart.lines.size(); ++i) {
        const auto& line = chart.lines[i];
        if (line.points.empty()) continue;
        out += fmt::format("$line{} << END\n", i);
        for (const auto& [x, y] : line.points) out += fmt::format("{:.8g} {:.8g}\n", x, y);
        out += "END\n";
        const std::string title = line.title.empty() ? "notitle" : "title " + quoted(line.title);
        if (chart.bar_width > 0)
            add(fmt::format("$line{} with boxes fillstyle solid 0.8 border linecolor rgb '{}' fillcolor rgb '{}' {}", i,
                            line.colour, line.colour, title));
        else
            add(fmt::format(
                "$line{} with linespoints linewidth 2.2 dashtype {} pointtype {} pointsize 0.8 linecolor rgb '{}' {}",
                i, line.dash, line.mark, line.colour, title));
    }
    if (chart.bar_width > 0) out += fmt::format("set boxwidth {:.8g}\n", chart.bar_width);
    for (std::size_t i = 0; i < chart.rules.size(); ++i) {
        const auto& rule = chart.rules[i];
        out += fmt::format("$rule{} << END\n{:.8g} {:.8g}\n{:.8g} {:.8g}\nEND\n", i, rule.x, chart.y.low, rule.x,
                           chart.y.high);
        add(fmt::format("$rule{} with lines linewidth 2.2 dashtype {} linecolor rgb '{}' title {}", i, rule.dash,
                        rule.colour, quoted(rule.title)));
    }
    if (plots.empty()) plots = " NaN notitle";
    return out + "plot" + plots + "\nunset output\n";
}

std::string chart_script(const SpaceChart& chart, const std::filesystem::path& output) {
    std::string out = opening(chart.title, chart.width, chart.height, output);
    out += fmt::format("set key top right noenhanced\nset xlabel {} noenhanced\nset ylabel {} noenhanced\n",
                       quoted(chart.x_label), quoted(chart.y_label));
    out += fmt::format("set zlabel {} rotate parallel offset -1,0 noenhanced\n", quoted(chart.z_label));
    out +=
        "set border 31\nset ticslevel 0\nset view 62,128\nset grid z\nset zrange [0:*]\nset logscale x\nset autoscale "
        "xfix\n";
    out += "set xtics offset 0,-0.3\nset ytics offset 0,-0.3\n";
    std::string plots;
    for (std::size_t i = 0; i < chart.series.size(); ++i) {
        const auto& series = chart.series[i];
        out += fmt::format("$series{} << END\n", i);
        for (const auto& row : series.rows) {
            for (const auto& [x, y, z] : row) out += fmt::format("{:.8g} {:.8g} {:.8g}\n", x, y, z);
            out += "\n";
        }
        out += "END\n";
        plots += fmt::format(
            "{} $series{} with linespoints linewidth 1.6 pointtype {} pointsize 0.8 linecolor rgb '{}' title {}, \\\n"
            "  $series{} with impulses linewidth 0.6 linecolor rgb '{}' notitle",
            i == 0 ? "" : ", \\\n ", i, series.mark, series.colour, quoted(series.title), i, series.colour);
    }
    return out + "splot" + plots + "\nunset output\n";
}

Result<void> run_gnuplot(const std::string& script, const std::filesystem::path& script_file) {
    if (auto written = write_text(script_file, script); !written) return written;
    if (std::system("command -v gnuplot >/dev/null 2>&1") != 0)
        return fail(ErrorKind::unsupported,
                    "gnuplot, which draws the figures, is not installed: install it (Debian: apt install gnuplot-nox) "
                    "and run the command again; what was measured is kept");
    const auto log = script_file.string() + ".log";
    const auto command =
        fmt::format("gnuplot {} >{} 2>&1", quoted_for_shell(script_file.string()), quoted_for_shell(log));
    if (std::system(command.c_str()) != 0) return fail(ErrorKind::bad_input, "gnuplot failed; it says why in " + log);
    std::error_code ignored;
    std::filesystem::remove(log, ignored);
    return {};
}

}  // namespace htvm::lab
