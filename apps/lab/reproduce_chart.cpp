#include "reproduce_chart.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "rd_cache.h"
#include "rd_peer.h"

namespace htvm::lab {

using namespace app;
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

// A step of 1, 2 or 5 times a power of ten that cuts `span` into at most `most` parts.
double round_step(double span, int most) {
    const double rough = span / most, power = std::pow(10, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= rough * (1 - 1e-9)) return factor * power;
    return 10 * power;
}

}  // namespace

CoderLook look_of_coder(const std::string& coder) {
    if (coder == "paper") return {"the paper's coder", "#0072b2", 7};
    if (coder == "htvm-ep") return {"htvm-ep", "#009e73", 5};
    if (coder == "tfan") return {"TFAN", "#e69f00", 9};
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
