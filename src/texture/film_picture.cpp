#include "texture/film_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/raster.h"
#include "surface/projection_fit.h"

namespace htvm {

using namespace internal;

namespace {

constexpr int grid = 8;  // pixels: windows lie on multiples of this, as the blocks of video do

// In pixels of the film, from the left and from the top.
std::array<double, 2> place_of(const TexturedMesh& captured, std::size_t v) {
    const auto& at = captured.mesh.texcoords[v];
    const auto side = [](float coordinate, int pixels) {
        const double place = static_cast<double>(coordinate) * pixels;
        return std::isfinite(place) ? std::clamp(place, 0.0, 1.0 * pixels) : 0;
    };
    return {side(at[0], captured.texture->width), side(1 - at[1], captured.texture->height)};
}

bool names_vertices(const Mesh& mesh, const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](auto v) { return v < mesh.texcoords.size(); });
}

struct Extent {
    double left = 0, top = 0, right = 0, bottom = 0;
    double width() const { return right - left; }
    double height() const { return bottom - top; }
};

// The part that the mesh shows; the whole film if that is nothing.
Extent extent_of(const TexturedMesh& captured) {
    Extent out{1e9, 1e9, -1e9, -1e9};
    for (const auto& t : captured.mesh.triangles) {
        if (!names_vertices(captured.mesh, t)) continue;
        for (const auto v : t) {
            const auto [x, y] = place_of(captured, v);
            out = {std::min(out.left, x), std::min(out.top, y), std::max(out.right, x), std::max(out.bottom, y)};
        }
    }
    if (out.left <= out.right) return out;
    return {0, 0, 1.0 * captured.texture->width, 1.0 * captured.texture->height};
}

int on_grid_below(double x) { return grid * static_cast<int>(std::floor(x / grid)); }
int on_grid_above(double x) { return grid * static_cast<int>(std::ceil(x / grid)); }

bool holds(const FilmWindow& window, const Extent& extent) {
    return extent.left >= window.left && extent.top >= window.top && extent.right <= window.left + window.width &&
           extent.bottom <= window.top + window.height;
}

FilmWindow centred(const Extent& extent, int width, int height) {
    return {on_grid_below((extent.left + extent.right - width) / 2 + grid / 2.0),
            on_grid_below((extent.top + extent.bottom - height) / 2 + grid / 2.0), width, height};
}

// ---- What nobody sees -----------------------------------------------------------------------------------------------

using Known = std::vector<std::uint8_t>;  // one per pixel, row by row from the top

// The pixels of the window that the mesh covers.
Known covered(const TexturedMesh& captured, const FilmWindow& window) {
    Known out(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height), 0);
    const auto point_of = [&](std::size_t v) {
        const auto [x, y] = place_of(captured, v);
        constexpr double cell = 1 << raster_bits;
        return RasterPoint{static_cast<std::int32_t>(std::lround((x - window.left) * cell)),
                           static_cast<std::int32_t>(std::lround((y - window.top) * cell))};
    };
    for (const auto& t : captured.mesh.triangles) {
        if (!names_vertices(captured.mesh, t)) continue;
        for_each_cell({point_of(t[0]), point_of(t[1]), point_of(t[2])}, {0, 0, window.width, window.height},
                      [&](std::int32_t x, std::int32_t y) {
                          out[static_cast<std::size_t>(y) * static_cast<std::size_t>(window.width) +
                              static_cast<std::size_t>(x)] = 1;
                      });
    }
    return out;
}

// Holes are known, too: what is not covered and cannot be reached from the window's border.
void add_holes(Known& known, const FilmWindow& window) {
    const auto width = static_cast<std::size_t>(window.width), height = static_cast<std::size_t>(window.height);
    Known outside(known.size(), 0);
    std::vector<std::size_t> open;
    const auto reach = [&](std::size_t at) {
        if (known[at] != 0 || outside[at] != 0) return;
        outside[at] = 1;
        open.push_back(at);
    };
    for (std::size_t x = 0; x < width; ++x) reach(x), reach((height - 1) * width + x);
    for (std::size_t y = 0; y < height; ++y) reach(y * width), reach(y * width + width - 1);
    while (!open.empty()) {
        const auto at = open.back();
        open.pop_back();
        const auto x = at % width;
        if (x > 0) reach(at - 1);
        if (x + 1 < width) reach(at + 1);
        if (at >= width) reach(at - width);
        if (at + width < known.size()) reach(at + width);
    }
    for (std::size_t i = 0; i < known.size(); ++i) known[i] = outside[i] == 0 ? 1 : 0;
}

// Means of colours over squares of pixels, each level of squares twice as large: what is not known is taken from the
// smallest square around it in which anything is.
struct Level {
    std::size_t width = 0, height = 0;
    std::vector<std::array<float, 3>> colour;
    std::vector<float> share;  // 0: nothing is known there
};

Level smaller(const Level& fine) {
    Level out;
    out.width = (fine.width + 1) / 2;
    out.height = (fine.height + 1) / 2;
    out.colour.resize(out.width * out.height);
    out.share.resize(out.width * out.height);
    for (std::size_t y = 0; y < fine.height; ++y)
        for (std::size_t x = 0; x < fine.width; ++x) {
            const auto from = y * fine.width + x, to = y / 2 * out.width + x / 2;
            out.share[to] += fine.share[from];
            for (std::size_t c = 0; c < 3; ++c) out.colour[to][c] += fine.share[from] * fine.colour[from][c];
        }
    for (std::size_t i = 0; i < out.share.size(); ++i) {
        if (out.share[i] <= 0) continue;
        for (auto& c : out.colour[i]) c /= out.share[i];
        out.share[i] = std::min(out.share[i], 1.0f);
    }
    return out;
}

// The coarser level's colour at the middle of a pixel of the finer one, between its nearest four.
std::array<float, 3> between(const Level& coarse, std::size_t x, std::size_t y) {
    const auto along = [](std::size_t at, std::size_t side) {
        const auto own = at / 2, beside = at % 2 == 0 ? (own > 0 ? own - 1 : own) : std::min(own + 1, side - 1);
        return std::array{own, beside};
    };
    const auto columns = along(x, coarse.width), rows = along(y, coarse.height);
    std::array<float, 3> out{};
    for (std::size_t j = 0; j < 2; ++j)
        for (std::size_t i = 0; i < 2; ++i) {
            const float weight = (i == 0 ? 0.75f : 0.25f) * (j == 0 ? 0.75f : 0.25f);
            const auto& colour = coarse.colour[rows[j] * coarse.width + columns[i]];
            for (std::size_t c = 0; c < 3; ++c) out[c] += weight * colour[c];
        }
    return out;
}

void fill(Level& level) {
    const bool is_whole = std::all_of(level.share.begin(), level.share.end(), [](float share) { return share >= 1; });
    if (is_whole || (level.width == 1 && level.height == 1)) return;
    auto coarse = smaller(level);
    fill(coarse);
    for (std::size_t y = 0; y < level.height; ++y)
        for (std::size_t x = 0; x < level.width; ++x) {
            const auto i = y * level.width + x;
            const float share = level.share[i];
            if (share >= 1) continue;
            const auto around = between(coarse, x, y);
            for (std::size_t c = 0; c < 3; ++c)
                level.colour[i][c] = share * level.colour[i][c] + (1 - share) * around[c];
        }
}

// The window of the film as it is, where that is known.
Level cut_out(const Image& film, const FilmWindow& window, const Known& known) {
    Level out;
    out.width = static_cast<std::size_t>(window.width);
    out.height = static_cast<std::size_t>(window.height);
    out.colour.resize(known.size());
    out.share.resize(known.size());
    for (int y = 0; y < window.height; ++y)
        for (int x = 0; x < window.width; ++x) {
            const auto i = static_cast<std::size_t>(y) * out.width + static_cast<std::size_t>(x);
            const int column = x + window.left, row = y + window.top;
            const bool is_on_film = column >= 0 && row >= 0 && column < film.width && row < film.height;
            if (known[i] == 0 || !is_on_film) continue;
            const auto pixel =
                static_cast<std::size_t>(row) * static_cast<std::size_t>(film.width) + static_cast<std::size_t>(column);
            for (std::size_t c = 0; c < 3; ++c) out.colour[i][c] = film.rgb[3 * pixel + c];
            out.share[i] = 1;
        }
    return out;
}

}  // namespace

bool is_film(const TexturedMesh& captured) {
    const auto& mesh = captured.mesh;
    if (!captured.texture || mesh.texcoords.empty() || mesh.triangles.empty()) return false;
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(mesh.positions.size());
    for (const auto& p : mesh.positions) positions.push_back(Eigen::Vector3f(p[0], p[1], p[2]).cast<double>());
    return fit_projection({positions, mesh.texcoords, 1.0 * captured.texture->width, 1.0 * captured.texture->height})
        .has_value();
}

FilmWindow first_window(const TexturedMesh& captured) {
    constexpr double room = 0.15;  // of the subject's extent, on each side
    constexpr double much = 0.7;   // of the film
    const auto extent = extent_of(captured);
    const auto& film = *captured.texture;
    const auto side = [&](double low, double high, int all) {
        const double margin = room * (high - low);
        const int first = std::max(on_grid_below(low - margin), 0);
        return std::pair(first, std::min(on_grid_above(high + margin), all) - first);
    };
    const auto [left, width] = side(extent.left, extent.right, film.width);
    const auto [top, height] = side(extent.top, extent.bottom, film.height);
    if (1.0 * width * height > much * film.width * film.height) return {0, 0, film.width, film.height};
    return {left, top, width, height};
}

std::vector<Vector2f> texcoords_in_window(const TexturedMesh& captured, const FilmWindow& window) {
    const double width = captured.texture->width, height = captured.texture->height;
    const double bottom = height - window.top - window.height;
    std::vector<Vector2f> out;
    out.reserve(captured.mesh.texcoords.size());
    const auto is_cut_off = [](float coordinate, double side) {
        const double place = static_cast<double>(coordinate) * side;
        return !(place > 0.5 && place < side - 0.5);
    };
    for (const auto& t : captured.mesh.texcoords) {
        if (is_cut_off(t[0], width) || is_cut_off(t[1], height)) {
            out.push_back({-1, -1});
            continue;
        }
        out.push_back({static_cast<float>((static_cast<double>(t[0]) * width - window.left) / window.width),
                       static_cast<float>((static_cast<double>(t[1]) * height - bottom) / window.height)});
    }
    return out;
}

FilmWindow FilmFraming::next(const TexturedMesh& captured) {
    constexpr double room = 1.1, much_too_large = 1.4;
    const auto extent = extent_of(captured);
    const double needed = std::max(extent.width() / first_.width, extent.height() / first_.height);
    const double scale = std::max(needed * room, 1.0);
    const double now = 1.0 * window_.width / first_.width;
    if (holds(window_, extent) && now < scale * much_too_large) return window_;
    window_ = centred(extent, static_cast<int>(std::lround(scale * first_.width)),
                      static_cast<int>(std::lround(scale * first_.height)));
    return window_;
}

Image film_picture(const TexturedMesh& captured, const FilmWindow& window, int width, int height) {
    auto known = covered(captured, window);
    add_holes(known, window);
    auto level = cut_out(*captured.texture, window, known);
    fill(level);
    Image out;
    out.width = window.width;
    out.height = window.height;
    out.rgb.reserve(3 * level.colour.size());
    for (const auto& colour : level.colour)
        for (const float c : colour) out.rgb.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(c), 0L, 255L)));
    return out.width == width && out.height == height ? out : resized(out, width, height);
}

}  // namespace htvm
