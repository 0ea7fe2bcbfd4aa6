#include "command_line/capture_kind.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "io/mesh_file.h"
#include "metrics/percentile.h"

namespace htvm::app {

GlobalShift shift_of(const Mesh& mesh, double millimetres_per_unit) {
    constexpr double far = 64;  // sizes: floats then still have a 250,000th of the size
    const auto bounds = surface_bounds(mesh);
    if (!bounds) return {};
    std::array<double, 3> low{}, high{};
    for (std::size_t c = 0; c < 3; ++c) {
        low[c] = static_cast<double>(bounds->low[c]);
        high[c] = static_cast<double>(bounds->high[c]);
    }
    const double size = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    GlobalShift out{};
    bool is_far = false;
    for (std::size_t c = 0; c < 3; ++c) {
        const double middle = (low[c] + high[c]) / 2;
        is_far = is_far || std::abs(middle) > far * size;
        const double metres = std::round(middle * millimetres_per_unit / 1000);
        if (!(std::abs(metres) * 1000 < static_cast<double>(most_global_shift))) return {};
        out[c] = static_cast<std::int64_t>(metres) * 1000;
    }
    return is_far ? out : GlobalShift{};
}

double size_of(const Mesh& mesh) {
    constexpr std::size_t most = 2048;  // vertices looked at
    const std::size_t step = mesh.positions.size() / most + 1;
    std::array<std::vector<float>, 3> along;
    for (std::size_t v = 0; v < mesh.positions.size(); v += step)
        for (std::size_t c = 0; c < 3; ++c) along[c].push_back(mesh.positions[v][c]);
    if (along[0].empty()) return 0;
    std::array<float, 3> middle{};
    for (std::size_t c = 0; c < 3; ++c) middle[c] = middle_of(along[c]);
    std::vector<float> distances;
    for (std::size_t v = 0; v < along[0].size(); ++v)
        distances.push_back(std::hypot(along[0][v] - middle[0], along[1][v] - middle[1], along[2][v] - middle[2]));
    return static_cast<double>(middle_of(std::move(distances)));
}

void CaptureKind::add(const Mesh& mesh, const MeshFindings& findings, bool has_texture) {
    levels_ += findings.colour_levels;
    if (const auto range = certain_range_of(findings.colour_levels)) ++of_range_[static_cast<std::size_t>(*range)];
    if (mesh.positions.empty()) return;
    if (size_ == 0) size_ = size_of(mesh);
    ++meshes_;
    coloured_ += has_texture || !mesh.colours.empty();
}

std::optional<ColourRange> CaptureKind::colour_range() const {
    if (!levels_.any()) return std::nullopt;
    const auto most = std::max_element(of_range_.begin(), of_range_.end());
    return *most > 0 ? static_cast<ColourRange>(most - of_range_.begin()) : colour_range_of(levels_);
}

namespace {

const char* name_of(ColourRange range) {
    return range == ColourRange::unit ? "0 to 1" : range == ColourRange::bytes ? "0 to 255" : "0 to 65535";
}

}  // namespace

std::string CaptureKind::unlike(const Mesh& mesh, const ColourLevels& levels, bool has_texture) const {
    if (meshes_ == 0 || mesh.positions.empty()) return {};
    const bool are_coloured = 2 * coloured_ >= meshes_, is_coloured = has_texture || !mesh.colours.empty();
    if (are_coloured && !is_coloured) return "it has no colours, as the other frames have";
    if (!are_coloured && is_coloured) return "it has colours, which the other frames have not";
    const auto range = certain_range_of(levels), of_others = colour_range();
    if (range && of_others && *range != *of_others)
        return fmt::format("its colours are {}, those of the other frames {}", name_of(*range), name_of(*of_others));
    constexpr double most = 10;  // a person who crouches or spreads the arms changes by less than two
    const double size = size_of(mesh);
    if (size_ > 0 && size > 0 && std::max(size / size_, size_ / size) > most)
        return fmt::format(
            "it is {:.0f} times {} than the first frame: one of the two is of another capture, or in another unit",
            std::max(size / size_, size_ / size), size < size_ ? "smaller" : "larger");
    return {};
}

}  // namespace htvm::app
