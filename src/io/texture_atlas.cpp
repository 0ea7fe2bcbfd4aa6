#include "io/texture_atlas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/srgb.h"

namespace htvm {

using namespace internal;

namespace {

// A corner's coordinates are those of its vertex, less these whole numbers.
struct Shift {
    std::int64_t u = 0, v = 0;
    bool operator==(const Shift&) const = default;
};

// One axis of a triangle: what its corners are moved by, and over how many repetitions they then reach.
struct AxisMoves {
    std::array<std::int64_t, 3> shifts{};
    int repeats = 1;
    bool is_folded = false;
};

AxisMoves moves_along(const std::array<double, 3>& at) {
    constexpr double tolerance = 1e-3;  // less than a texel of most images; programs round
    constexpr double most_repeats = 8;
    AxisMoves out;
    const auto [low, high] = std::ranges::minmax(at);
    if (low >= -tolerance && high <= 1 + tolerance) return out;
    const double shift = std::floor(low + tolerance), repeats = std::ceil(high - shift - tolerance);
    if (repeats <= most_repeats && std::abs(shift) < 1e15) {
        out.shifts.fill(static_cast<std::int64_t>(shift));
        out.repeats = std::max(1, static_cast<int>(repeats));
        return out;
    }
    out.is_folded = true;
    for (std::size_t c = 0; c < 3; ++c)
        out.shifts[c] = std::abs(at[c]) < 1e15 ? static_cast<std::int64_t>(std::floor(at[c])) : 0;
    return out;
}

struct Tiled {
    std::vector<Atlas::Tile> tiles;
    std::vector<std::size_t> tile_of_part;
};

// One for each image and colour that parts show, in the order of the parts' names.
Tiled tiles_of(std::span<const AtlasPart> parts) {
    std::vector<std::size_t> order(parts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t p) -> const std::string& { return parts[p].name; });
    Tiled out;
    out.tile_of_part.resize(parts.size());
    std::map<std::pair<const Image*, Colour>, std::size_t> known;
    for (const std::size_t p : order) {
        const auto [at, is_new] = known.emplace(std::pair{parts[p].image.get(), parts[p].colour}, out.tiles.size());
        if (is_new) out.tiles.push_back({parts[p].image, parts[p].colour, 1, 1});
        out.tile_of_part[p] = at->second;
    }
    return out;
}

// ---- Layout ---------------------------------------------------------------------------------------------------------

struct Cell {
    int width = 0, height = 0;  // gutters included
};

struct Sizes {
    double scale = 1;
    int gutter = 0;
};

constexpr int swatch = 8;  // pixels that a colour alone takes

int scaled_side(int side, double scale) { return std::max(1, static_cast<int>(std::lround(side * scale))); }

// What the tile covers without its gutters.
Cell content_of(const Atlas::Tile& tile, const Sizes& sizes) {
    if (!tile.image) return {swatch, swatch};
    return {scaled_side(tile.image->width, sizes.scale) * tile.across,
            scaled_side(tile.image->height, sizes.scale) * tile.up};
}

int rounded_up(int value, int step) { return (value + step - 1) / step * step; }

struct Layout {
    int width = 0, height = 0;
    std::vector<Atlas::Place> places;  // of the cells' contents
};

// Rows of cells, the highest first, next to each other up to that width. Gives the height that they need.
int height_of_rows(const std::vector<Cell>& cells, const std::vector<std::size_t>& order, int width, Layout* out) {
    int x = 0, y = 0, row = 0;
    for (const std::size_t c : order) {
        if (x > 0 && x + cells[c].width > width) {
            y += row;
            x = row = 0;
        }
        if (out) out->places[c] = {x, y, cells[c].width, cells[c].height};
        x += cells[c].width;
        row = std::max(row, cells[c].height);
    }
    return y + row;
}

// The smallest image of those that were tried, the squarest of equal ones; nothing if none is within the limit.
std::optional<Layout> layout_of(const std::vector<Atlas::Tile>& tiles, const Sizes& sizes, int largest_side) {
    std::vector<Cell> cells;
    int widest = 0;
    for (const auto& tile : tiles) {
        const Cell content = content_of(tile, sizes);
        cells.push_back({rounded_up(content.width + 2 * sizes.gutter, sizes.gutter),
                         rounded_up(content.height + 2 * sizes.gutter, sizes.gutter)});
        if (cells.back().width > largest_side || cells.back().height > largest_side) return std::nullopt;
        widest = std::max(widest, cells.back().width);
    }
    std::vector<std::size_t> order(cells.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
        return std::pair(cells[a].height, cells[a].width) > std::pair(cells[b].height, cells[b].width);
    });
    constexpr int step = 16, most_tries = 64;  // as video is coded in blocks of that size
    const int tries_step = rounded_up(std::max(step, (largest_side - widest) / most_tries), step);
    std::optional<std::array<std::int64_t, 2>> best;  // area and longer side
    int best_width = 0;
    for (int width = rounded_up(widest, step); width <= largest_side; width += tries_step) {
        const int height = rounded_up(height_of_rows(cells, order, width, nullptr), step);
        if (height > largest_side) continue;
        const std::array<std::int64_t, 2> made{std::int64_t{width} * height, std::max(width, height)};
        if (best && *best <= made) continue;
        best = made;
        best_width = width;
    }
    if (!best) return std::nullopt;
    Layout out;
    out.places.resize(cells.size());
    out.width = best_width;
    out.height = rounded_up(height_of_rows(cells, order, best_width, &out), step);
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        const Cell content = content_of(tiles[t], sizes);
        out.places[t] = {out.places[t].x + sizes.gutter, out.places[t].y + sizes.gutter, content.width, content.height};
    }
    return out;
}

// As large as they fit, in whole or all smaller by the same factor.
std::optional<std::pair<Layout, Sizes>> largest_layout(const std::vector<Atlas::Tile>& tiles, int largest_side) {
    for (const int gutter : {8, 2}) {
        Sizes sizes{1, gutter};
        if (auto whole = layout_of(tiles, sizes, largest_side)) return std::pair{std::move(*whole), sizes};
        std::optional<std::pair<Layout, Sizes>> best;
        double low = 0, high = 1;
        constexpr int halvings = 12;
        for (int i = 0; i < halvings; ++i) {
            sizes.scale = (low + high) / 2;
            auto tried = layout_of(tiles, sizes, largest_side);
            (tried ? low : high) = sizes.scale;
            if (tried) best = {std::move(*tried), sizes};
        }
        if (best) return best;
    }
    return std::nullopt;
}

// ---- Pixels ---------------------------------------------------------------------------------------------------------

using Levels = std::array<std::array<std::uint8_t, 256>, 3>;

Levels levels_under(const Colour& colour) {
    Levels out;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t level = 0; level < 256; ++level)
            out[c][level] = level_of(light_of(static_cast<std::uint8_t>(level)) * light_of(colour[c]));
    return out;
}

void paint(const Atlas::Tile& tile, const Atlas::Place& place, int gutter, Image& out) {
    const Image one{1, 1, {255, 255, 255}};
    const int width = tile.image ? place.width / tile.across : 1, height = tile.image ? place.height / tile.up : 1;
    Image smaller;
    const Image* from = tile.image ? tile.image.get() : &one;
    if (from->width != width || from->height != height) {
        smaller = resized(*from, width, height);
        from = &smaller;
    }
    const auto levels = levels_under(tile.colour);
    const int left = place.x - gutter, right = left + rounded_up(place.width + 2 * gutter, gutter);
    const int top = place.y - gutter, bottom = top + rounded_up(place.height + 2 * gutter, gutter);
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) {
            const int row = std::clamp(y - place.y, 0, place.height - 1) % height;
            const int column = std::clamp(x - place.x, 0, place.width - 1) % width;
            const auto source = 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                     static_cast<std::size_t>(column));
            const auto to =
                3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x));
            for (std::size_t c = 0; c < 3; ++c) out.rgb[to + c] = levels[c][from->rgb[source + c]];
        }
}

// ---- Coordinates ----------------------------------------------------------------------------------------------------

struct Wear {
    std::size_t tile = 0;
    Shift shift;
    bool operator==(const Wear&) const = default;
};

struct Worn {
    std::uint32_t vertex = 0;
    Wear wear;
    bool operator==(const Worn&) const = default;
};

struct WornHash {
    std::size_t operator()(const Worn& worn) const {
        std::uint64_t h = worn.vertex;
        for (const std::uint64_t value :
             {static_cast<std::uint64_t>(worn.wear.tile), static_cast<std::uint64_t>(worn.wear.shift.u),
              static_cast<std::uint64_t>(worn.wear.shift.v)})
            h = (h ^ (h >> 29) ^ value) * 0xbf58476d1ce4e5b9u;
        return static_cast<std::size_t>(h ^ (h >> 31));
    }
};

// What each corner of the triangles wears; counts the tiles' repetitions.
struct Corners {
    std::vector<std::array<Wear, 3>> of_triangles;
    bool is_folded = false;
};

Corners corners_of(const Mesh& mesh, std::span<const std::size_t> part_of, Tiled& tiled) {
    Corners out;
    out.of_triangles.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::size_t number = tiled.tile_of_part[part_of[t]];
        auto& tile = tiled.tiles[number];
        for (auto& wear : out.of_triangles[t]) wear.tile = number;
        if (!tile.image) continue;
        std::array<AxisMoves, 2> moves;
        for (std::size_t axis = 0; axis < 2; ++axis) {
            std::array<double, 3> at{};
            for (std::size_t c = 0; c < 3; ++c) at[c] = static_cast<double>(mesh.texcoords[mesh.triangles[t][c]][axis]);
            moves[axis] = moves_along(at);
            out.is_folded = out.is_folded || moves[axis].is_folded;
        }
        tile.across = std::max(tile.across, moves[0].repeats);
        tile.up = std::max(tile.up, moves[1].repeats);
        for (std::size_t c = 0; c < 3; ++c) out.of_triangles[t][c].shift = {moves[0].shifts[c], moves[1].shifts[c]};
    }
    return out;
}

// In the atlas, from its lower left corner.
Vector2f placed(const Vector2f& texcoord, const Wear& wear, const Atlas& atlas) {
    const auto& tile = atlas.tiles[wear.tile];
    const auto& place = atlas.places[wear.tile];
    std::array<double, 2> share{0.5, 0.5};  // of what the tile covers
    if (tile.image) {
        share[0] = (static_cast<double>(texcoord[0]) - static_cast<double>(wear.shift.u)) / tile.across;
        share[1] = (static_cast<double>(texcoord[1]) - static_cast<double>(wear.shift.v)) / tile.up;
    }
    for (auto& s : share) s = std::clamp(s, 0.0, 1.0);
    return {static_cast<float>((place.x + share[0] * place.width) / atlas.image->width),
            static_cast<float>(1 - (place.y + (1 - share[1]) * place.height) / atlas.image->height)};
}

void move_texcoords(Mesh& mesh, const Corners& corners, const Atlas& atlas) {
    const auto before = mesh.texcoords;
    std::vector<std::optional<Wear>> first(mesh.positions.size());
    std::unordered_map<Worn, std::uint32_t, WornHash> copies;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t c = 0; c < 3; ++c) {
            std::uint32_t& vertex = mesh.triangles[t][c];
            const Wear& wear = corners.of_triangles[t][c];
            if (!first[vertex]) {
                first[vertex] = wear;
                mesh.texcoords[vertex] = placed(before[vertex], wear, atlas);
            }
            if (*first[vertex] == wear) continue;
            const auto [at, is_new] =
                copies.emplace(Worn{vertex, wear}, static_cast<std::uint32_t>(mesh.positions.size()));
            if (is_new) {
                mesh.positions.push_back(mesh.positions[vertex]);
                mesh.texcoords.push_back(placed(before[vertex], wear, atlas));
                if (!mesh.normals.empty()) mesh.normals.push_back(mesh.normals[vertex]);
                if (!mesh.colours.empty()) mesh.colours.push_back(mesh.colours[vertex]);
            }
            vertex = at->second;
        }
    for (std::size_t v = 0; v < first.size(); ++v)
        if (!first[v]) mesh.texcoords[v] = placed({0.5f, 0.5f}, {}, atlas);
}

}  // namespace

Result<Atlased> put_into_atlas(Mesh& mesh, std::span<const AtlasPart> parts, std::span<const std::size_t> part_of,
                               const Atlas& known, int largest_side) {
    auto tiled = tiles_of(parts);
    const auto corners = corners_of(mesh, part_of, tiled);
    Atlased out;
    out.is_folded = corners.is_folded;
    if (known.image && known.tiles == tiled.tiles) {
        out.atlas = known;
    } else {
        auto layout = largest_layout(tiled.tiles, largest_side);
        if (!layout)
            return fail(ErrorKind::limit, "its " + std::to_string(parts.size()) +
                                              " parts have too many images and colours to be put into one image");
        auto& [placed_tiles, sizes] = *layout;
        constexpr std::uint8_t grey = 128;  // between tiles
        Image image{placed_tiles.width, placed_tiles.height, {}};
        image.rgb.assign(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height), grey);
        for (std::size_t t = 0; t < tiled.tiles.size(); ++t)
            paint(tiled.tiles[t], placed_tiles.places[t], sizes.gutter, image);
        out.atlas = {std::move(tiled.tiles), std::move(placed_tiles.places), sizes.scale,
                     std::make_shared<const Image>(std::move(image))};
    }
    move_texcoords(mesh, corners, out.atlas);
    return out;
}

Image multiplied(const Image& image, const Colour& colour) {
    Image out = image;
    const auto levels = levels_under(colour);
    for (std::size_t i = 0; i < out.rgb.size(); ++i) out.rgb[i] = levels[i % 3][out.rgb[i]];
    return out;
}

}  // namespace htvm
