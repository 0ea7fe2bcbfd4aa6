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

namespace {

constexpr std::size_t most_looked_at = 2048;  // vertices, triangles

double distance(const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return static_cast<double>(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
}

double edge_of(const Mesh& mesh) {
    std::vector<double> lengths;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += mesh.triangles.size() / most_looked_at + 1) {
        const auto& triangle = mesh.triangles[t];
        for (std::size_t i = 0; i < 3; ++i)
            lengths.push_back(distance(mesh.positions[triangle[i]], mesh.positions[triangle[(i + 1) % 3]]));
    }
    return middle_of(std::move(lengths));
}

}  // namespace

MeshSize size_of(const Mesh& mesh) {
    MeshSize out;
    const std::size_t step = mesh.positions.size() / most_looked_at + 1;
    std::array<std::vector<float>, 3> along;
    for (std::size_t v = 0; v < mesh.positions.size(); v += step)
        for (std::size_t c = 0; c < 3; ++c) along[c].push_back(mesh.positions[v][c]);
    if (along[0].empty()) return out;
    for (std::size_t c = 0; c < 3; ++c) out.middle[c] = middle_of(along[c]);
    std::vector<double> distances;
    for (std::size_t v = 0; v < mesh.positions.size(); v += step)
        distances.push_back(distance(mesh.positions[v], out.middle));
    out.reach = middle_of(std::move(distances));
    out.edge = edge_of(mesh);
    return out;
}

double farthest_from(const std::array<float, 3>& middle, const Mesh& mesh) {
    double out = 0;
    for (const auto& triangle : mesh.triangles)
        for (const auto v : triangle) out = std::max(out, distance(mesh.positions[v], middle));
    return out;
}

MeshSize usual_size(const std::vector<MeshSize>& sizes) {
    MeshSize out;
    const auto usual = [&](double MeshSize::*measure) {
        std::vector<double> values;
        for (const auto& size : sizes)
            if (size.*measure > 0) values.push_back(size.*measure);
        return middle_of(std::move(values));
    };
    out.reach = usual(&MeshSize::reach);
    out.edge = usual(&MeshSize::edge);
    return out;
}

double scale_beside(const MeshSize& size, const MeshSize& usual) {
    if (!(size.reach > 0 && size.edge > 0 && usual.reach > 0 && usual.edge > 0)) return 1;
    constexpr double alike = 1.6;  // a person who crouches in another unit
    const double reach = size.reach / usual.reach, edge = size.edge / usual.edge;
    return std::max(reach / edge, edge / reach) > alike ? 1 : std::sqrt(reach * edge);
}

namespace {

std::string times_text(double scale) {
    const double times = std::max(scale, 1 / scale);
    return fmt::format("{:.{}f} times {}", times, times < 9.5 ? 1 : 0, scale < 1 ? "smaller" : "larger");
}

}  // namespace

std::string odd_scale(const MeshSize& size, const MeshSize& usual) {
    constexpr double most = 2;
    const double scale = scale_beside(size, usual);
    if (std::max(scale, 1 / scale) <= most) return {};
    return times_text(scale) +
           " than the other frames, in its extent and its edges alike, as if it were in another unit";
}

void CaptureKind::add(const Mesh& mesh, const MeshFindings& findings, bool has_texture) {
    levels_ += findings.colour_levels;
    if (const auto range = certain_range_of(findings.colour_levels)) ++of_range_[static_cast<std::size_t>(*range)];
    if (mesh.positions.empty()) return;
    sizes_.push_back(size_of(mesh));
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
    constexpr double most_alike = 5;
    const auto size = size_of(mesh), usual = usual_size(sizes_);
    if (!(size.reach > 0 && usual.reach > 0)) return {};
    const double reach = size.reach / usual.reach, scale = scale_beside(size, usual);
    if (std::max(reach, 1 / reach) <= most && std::max(scale, 1 / scale) <= most_alike) return {};
    return "it is " + times_text(reach) + " than the other frames: it is of another capture, or in another unit";
}

std::string CaptureKind::odd_size(const Mesh& mesh) const {
    return mesh.positions.empty() || sizes_.empty() ? std::string() : odd_scale(size_of(mesh), usual_size(sizes_));
}

}  // namespace htvm::app
