// Charts are packed by what they cover, not by boxes: the picture is a grid of cells, each chart a set of cells that
// its triangles touch and one more around them. The largest comes first, each at the lowest place where its cells are
// free, upright or turned by a quarter.
#include "codec/encoder/charts/chart_packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "codec/encoder/charts/chart_cut.h"
#include "core/geometry.h"

namespace htvm::internal {
namespace {

constexpr std::int32_t texel = 1 << texel_bits;
// The share of the picture, its upper part, that a whole mesh's charts leave free.
constexpr double free_share = 0.15;

// The side of a cell in texels: a gutter, or more where the grid would have more than 256 cells along a side.
std::int32_t cell_of(const StreamTexture& picture) {
    return std::max(4, (std::max(picture.width, picture.height) + 255) / 256);
}

// A grid of bits, 64 to a word.
class Cells {
public:
    Cells(std::int32_t width, std::int32_t height)
        : width_(width),
          height_(height),
          words_((static_cast<std::size_t>(width) + 63) / 64),
          bits_(words_ * static_cast<std::size_t>(height), 0) {}
    std::int32_t width() const { return width_; }
    std::int32_t height() const { return height_; }
    void set(std::int32_t x, std::int32_t y) {
        if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
        bits_[row(y) + static_cast<std::size_t>(x) / 64] |= std::uint64_t{1} << (x % 64);
    }
    std::size_t count() const {
        std::size_t out = 0;
        for (const auto word : bits_) out += static_cast<std::size_t>(std::popcount(word));
        return out;
    }
    // Whether a row of these cells is free where a row of the others would come to lie.
    bool row_is_free(const Cells& others, std::int32_t y, std::int32_t at_x, std::int32_t at_y) const {
        const std::size_t to = row(at_y + y) + static_cast<std::size_t>(at_x) / 64, from = others.row(y);
        const int shift = at_x % 64;
        for (std::size_t i = 0; i < others.words_; ++i) {
            const auto word = others.bits_[from + i];
            if ((bits_[to + i] & (word << shift)) != 0) return false;
            if (shift > 0 && (word >> (64 - shift)) != 0 && (bits_[to + i + 1] & (word >> (64 - shift))) != 0)
                return false;
        }
        return true;
    }
    void add(const Cells& others, std::int32_t at_x, std::int32_t at_y) {
        for (std::int32_t y = 0; y < others.height_; ++y)
            for (std::int32_t x = 0; x < others.width_; ++x)
                if ((others.bits_[others.row(y) + static_cast<std::size_t>(x) / 64] >> (x % 64) & 1) != 0)
                    set(at_x + x, at_y + y);
    }

private:
    std::size_t row(std::int32_t y) const { return words_ * static_cast<std::size_t>(y); }
    std::int32_t width_, height_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

// Sets the cells that a triangle touches, and those around them. Corners in texels times 2^texel_bits, cells from
// `ring` cells before the origin on.
void cover(Cells& cells, const CornerTexcoords& corners, std::int32_t cell, std::int32_t ring) {
    const double side = static_cast<double>(cell) * texel;
    std::array<std::array<double, 2>, 3> p;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t axis = 0; axis < 2; ++axis) p[i][axis] = corners[i][axis] / side;
    const auto range = [&](std::size_t axis) {
        const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
        return std::array<std::int32_t, 2>{static_cast<std::int32_t>(std::floor(low)),
                                           static_cast<std::int32_t>(std::floor(high))};
    };
    const auto [left, right] = range(0);
    const auto [bottom, top] = range(1);
    // A cell is beside the triangle if it is on the outer side of an edge with all of its corners.
    struct Edge {
        double x, y, farthest;
    };
    std::array<Edge, 3> edges;
    double area = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = p[i], &b = p[(i + 1) % 3];
        area += a[0] * b[1] - a[1] * b[0];
    }
    const double turn = area < 0 ? -1 : 1;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = p[i], &b = p[(i + 1) % 3];
        const double x = (a[1] - b[1]) * turn, y = (b[0] - a[0]) * turn;
        edges[i] = {x, y, x * a[0] + y * a[1] - std::max(x, 0.0) - std::max(y, 0.0)};
    }
    for (std::int32_t y = bottom; y <= top; ++y)
        for (std::int32_t x = left; x <= right; ++x) {
            const bool beside = std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) {
                return edge.x * x + edge.y * y < edge.farthest - 1e-9;
            });
            if (beside) continue;
            for (std::int32_t dy = -1; dy <= 1; ++dy)
                for (std::int32_t dx = -1; dx <= 1; ++dx) cells.set(x + ring + dx, y + ring + dy);
        }
}

struct Shape {
    ChartLayout alone;  // the layout with each chart turned this way
    std::vector<Cells> cells;
};

// Turns the picture by a quarter of a turn: what was to the right is then above.
QuantisedRotation by_a_quarter(const QuantisedRotation& rotation) {
    std::array<double, 4> q{};
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        q[i] = i == rotation.largest ? 1 << rotation_bits : rotation.others[other++];
    // The product of a quarter of a turn about the third axis and the rotation.
    const double h = std::sqrt(0.5);
    auto out = quantise_rotation({h * (q[0] - q[3]), h * (q[1] - q[2]), h * (q[2] + q[1]), h * (q[3] + q[0])});
    for (auto& c : out.others)
        c = static_cast<std::int16_t>(std::lround(static_cast<double>(c) / coarse_rotation) * coarse_rotation);
    return out;
}

std::vector<Cells> cells_of(const ChartLayout& layout, std::span<const CornerTexcoords> corners, std::int32_t cell) {
    std::vector<std::array<std::int32_t, 2>> largest(layout.charts.size());
    for (std::size_t t = 0; t < corners.size(); ++t)
        for (const auto& corner : corners[t])
            for (std::size_t axis = 0; axis < 2; ++axis) {
                auto& most = largest[layout.chart_of_triangle[t]][axis];
                most = std::max(most, corner[axis]);
            }
    // No chart is larger than this and fits.
    constexpr std::int32_t most_cells = 1100;
    std::vector<Cells> out;
    for (const auto& [x, y] : largest)
        out.emplace_back(std::min(x / (cell * texel) + 3, most_cells), std::min(y / (cell * texel) + 3, most_cells));
    for (std::size_t t = 0; t < corners.size(); ++t) {
        auto& cells = out[layout.chart_of_triangle[t]];
        if (cells.width() < most_cells && cells.height() < most_cells) cover(cells, corners[t], cell, 1);
    }
    return out;
}

// The lowest place where the cells are free, of those the leftmost.
std::optional<std::array<std::int32_t, 2>> place_for(const Cells& chart, const Cells& picture, std::int32_t top) {
    std::int32_t last = 0;  // the row that did not fit the last time, which probably does not fit the next time
    for (std::int32_t y = 0; y + chart.height() <= top; ++y)
        for (std::int32_t x = 0; x + chart.width() <= picture.width(); ++x) {
            if (!picture.row_is_free(chart, last, x, y)) continue;
            std::int32_t row = 0;
            while (row < chart.height() && picture.row_is_free(chart, row, x, y)) ++row;
            if (row == chart.height()) return std::array{x, y};
            last = row;
        }
    return std::nullopt;
}

// Gives all charts places among the free cells below `top`; false if one finds none. upright, turned: of the same
// charts.
bool pack(ChartLayout& layout, const Shape& upright, const Shape& turned, Cells picture, std::int32_t top,
          std::int32_t cell) {
    std::vector<std::size_t> order(layout.charts.size()), sizes;
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (const auto& cells : upright.cells)
        sizes.push_back(static_cast<std::size_t>(cells.width()) * static_cast<std::size_t>(cells.height()));
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });
    for (const auto chart : order) {
        const auto first = place_for(upright.cells[chart], picture, top);
        const auto second = place_for(turned.cells[chart], picture, top);
        if (!first && !second) return false;
        const auto end = [&](const auto& place, const Shape& shape) {
            return place ? (*place)[1] + shape.cells[chart].height() : std::numeric_limits<std::int32_t>::max();
        };
        const bool turns = end(second, turned) < end(first, upright);
        const auto& shape = turns ? turned : upright;
        const auto [x, y] = turns ? *second : *first;
        picture.add(shape.cells[chart], x, y);
        layout.charts[chart].rotation = shape.alone.charts[chart].rotation;
        layout.charts[chart].x = (x + 1) * cell;
        layout.charts[chart].y = (y + 1) * cell;
    }
    return true;
}

Cells empty_picture(const StreamTexture& picture, std::int32_t cell) {
    return {picture.width / cell, picture.height / cell};
}

Shape shape_of(ChartLayout layout, std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
               std::int32_t cell) {
    Shape out;
    out.cells = cells_of(layout, projected_corners(layout, positions, triangles), cell);
    out.alone = std::move(layout);
    return out;
}

ChartLayout turned_by_a_quarter(ChartLayout layout) {
    for (auto& chart : layout.charts) chart.rotation = by_a_quarter(chart.rotation);
    return layout;
}

// Packs the charts at the layout's scale.
bool pack_at_scale(ChartLayout& layout, const Cells& picture, std::int32_t top, std::int32_t cell,
                   std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    const auto upright = shape_of(layout, positions, triangles, cell);
    const auto turned = shape_of(turned_by_a_quarter(layout), positions, triangles, cell);
    return pack(layout, upright, turned, picture, top, cell);
}

double area_of(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    double sum = 0;
    for (const auto& t : triangles) sum += length(area_vector(positions, t)) / 2;
    return sum;
}

Result<PlacedCharts> placed(const ChartLayout& layout, std::span<const LatticePoint> positions,
                            std::span<const Triangle> triangles, const StreamTexture& picture) {
    PlacedCharts out;
    out.scale = layout.scale;
    out.layer = encode_charts(layout, positions, triangles);
    auto corners = chart_texcoords(layout, picture, positions, triangles);
    if (!corners) return tl::unexpected(corners.error());
    out.corners = std::move(*corners);
    return out;
}

constexpr double scale_unit = static_cast<double>(texel) * (1 << 16);  // a texel a lattice unit

std::uint32_t whole_scale(double scale) {
    return static_cast<std::uint32_t>(std::clamp(std::floor(scale * scale_unit), 1.0, 1.0 * largest_scale));
}

}  // namespace

Result<PlacedCharts> lay_out(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                             const StreamTexture& picture) {
    const auto cut = cut_into_charts(positions, triangles);
    auto layout = cut;
    const auto cell = cell_of(picture);
    const auto empty = empty_picture(picture, cell);
    const auto top = static_cast<std::int32_t>(std::floor(empty.height() * (1 - free_share)));
    // The largest scale that fits lies below that at which triangles seen from the front would fill the picture. Where
    // even the smallest does not fit, there are more charts than the picture has gutters for.
    const double area = std::max(area_of(positions, triangles), 1.0);
    double too_large = std::sqrt(1.0 * picture.width * picture.height / area), fits = 0;
    constexpr double precise = 1.015;
    const auto try_scale = [&](double scale) {
        auto tried = cut;
        tried.scale = whole_scale(scale);
        const bool fine = pack_at_scale(tried, empty, top, cell, positions, triangles);
        if (fine) layout = std::move(tried), fits = scale;
        return fine;
    };
    double scale = 0.8 * too_large;
    constexpr double smaller = 0.85;
    while (!try_scale(scale)) {
        if (whole_scale(scale) == 1)
            return fail(ErrorKind::bad_input, "the texture's pictures, " + std::to_string(picture.width) + " x " +
                                                  std::to_string(picture.height) + ", have no room for " +
                                                  std::to_string(layout.charts.size()) + " charts; make them larger");
        too_large = scale;
        scale *= smaller;
    }
    while (too_large / fits > precise) {
        scale = std::sqrt(too_large * fits);
        if (!try_scale(scale)) too_large = scale;
    }
    return placed(layout, positions, triangles, picture);
}

std::optional<PlacedCharts> lay_out_beside(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                           const StreamTexture& picture, std::span<const CornerTexcoords> taken,
                                           std::uint32_t scale) {
    auto layout = cut_into_charts(positions, triangles);
    layout.scale = scale;
    const auto cell = cell_of(picture);
    auto cells = empty_picture(picture, cell);
    const std::array<std::int64_t, 2> sides = {picture.width, picture.height};
    for (auto corners : taken) {
        for (auto& corner : corners)
            for (std::size_t axis = 0; axis < 2; ++axis)
                corner[axis] = static_cast<std::int32_t>((corner[axis] * sides[axis]) >> (picture_bits - texel_bits));
        cover(cells, corners, cell, 0);
    }
    // Smaller charts rather than none, down to half the size.
    for (const std::int32_t size : {usual_size, 13, 10, 8}) {
        auto tried = layout;
        for (auto& chart : tried.charts) chart.size = size;
        if (!pack_at_scale(tried, cells, cells.height(), cell, positions, triangles)) continue;
        auto out = placed(tried, positions, triangles, picture);
        return out ? std::optional(std::move(*out)) : std::nullopt;
    }
    return std::nullopt;
}

}  // namespace htvm::internal
