#include "command_line/subject_height.h"

#include <fmt/core.h>

#include <algorithm>

namespace htvm::app {
namespace {

// Millimetres, of people: of any, and of those who are captured most.
constexpr double shortest = 400, tallest = 2600, usual_shortest = 900, usual_tallest = 2200;

// "; in inches it would be 1.75 m (--unit in)" for each unit in which the subject is as tall as most people.
std::string other_readings(double tall, LengthUnit unit) {
    std::string out;
    for (const auto& other : length_units) {
        const double millimetres = tall * other.millimetres;
        if (other.unit == unit || millimetres < usual_shortest || millimetres > usual_tallest) continue;
        out += fmt::format("; in {} it would be {} (--unit {})", other.name, length_text(millimetres), other.symbol);
    }
    return out;
}

}  // namespace

std::string length_text(double millimetres) {
    if (millimetres < 10) return fmt::format("{:.2g} mm", millimetres);
    if (millimetres < 1000) return fmt::format("{:.0f} cm", millimetres / 10);
    return fmt::format("{:.2f} m", millimetres / 1000);
}

double height_of(const Mesh& mesh, UpAxis up) {
    const auto bounds = surface_bounds(mesh);
    const auto along = [&](std::size_t axis) {
        return bounds ? static_cast<double>(bounds->high[axis]) - static_cast<double>(bounds->low[axis]) : 0.0;
    };
    return up == UpAxis::unknown ? std::max(along(1), along(2)) : along((static_cast<std::size_t>(up) - 1) / 2);
}

MeshRemark remark_on_height(double tall, LengthUnit unit, const std::string& format) {
    MeshRemark out{"height", "", false};
    if (!(tall > 0)) return out;
    const double millimetres = tall * millimetres_per(unit);
    const auto looks = fmt::format("{} in {}, which makes the subject {} tall",
                                   format.empty() ? "the meshes look as if they were" : format + " files are",
                                   names_of(unit).name, length_text(millimetres));
    const bool is_usual = millimetres >= usual_shortest && millimetres <= tallest;
    const auto others = is_usual ? std::string() : other_readings(tall, unit);
    // What a format prescribes is not doubted for a small child, or half of a person.
    const bool is_possible = millimetres >= shortest && millimetres <= tallest;
    out.is_loss = !is_possible || (!others.empty() && format.empty());
    if (out.is_loss)
        out.text = looks + others + "; if that is wrong, give --unit or --height";
    else if (unit != LengthUnit::millimetre && format.empty())
        out.text = looks + " (see --unit)";
    return out;
}

}  // namespace htvm::app
