// Charts are packed by what they cover, not by boxes: the picture is a grid of fine cells, each chart a set of cells
// that its triangles touch and a gutter's width of them around. The largest comes first, each at the lowest place where
// its cells are free, upright or turned by a quarter.
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
constexpr double free_share = 0.08;
constexpr std::int32_t gutter = 4;  // texels

// The side of a cell in texels: half a gutter, or more where the grid would have more than 640 cells along a side.
std::int32_t cell_of(const StreamTexture& picture) {
    return std::max(gutter / 2, (std::max(picture.width, picture.height) + 639) / 640);
}
// How many cells a gutter takes.
std::int32_t ring_of(std::int32_t cell) { return (gutter + cell - 1) / cell; }
// Places are tried so many cells apart: the time of a search grows with the square of how many there are.
std::int32_t stride_of(const StreamTexture& picture, std::int32_t cell) {
    return std::max(1, (std::max(picture.width, picture.height) / cell + 271) / 272);
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
    // These and those around them, up to `ring` cells away along either axis.
    Cells grown(std::int32_t ring) const {
        Cells wide = *this, out(width_, height_);
        for (std::int32_t y = 0; y < height_; ++y)
            for (std::size_t i = 0; i < words_; ++i) {
                const auto at = row(y) + i;
                const auto before = i > 0 ? bits_[at - 1] : 0, own = bits_[at],
                           next = i + 1 < words_ ? bits_[at + 1] : 0;
                for (int k = 1; k <= ring; ++k)
                    wide.bits_[at] |= own << k | own >> k | before >> (64 - k) | next << (64 - k);
            }
        for (std::int32_t y = 0; y < height_; ++y)
            for (std::int32_t from = std::max(y - ring, 0); from <= std::min(y + ring, height_ - 1); ++from)
                for (std::size_t i = 0; i < words_; ++i) out.bits_[row(y) + i] |= wide.bits_[row(from) + i];
        out.clear_beyond();
        return out;
    }
    void add(const Cells& others, std::int32_t at_x, std::int32_t at_y) {
        for (std::int32_t y = 0; y < others.height_; ++y)
            for (std::int32_t x = 0; x < others.width_; ++x)
                if ((others.bits_[others.row(y) + static_cast<std::size_t>(x) / 64] >> (x % 64) & 1) != 0)
                    set(at_x + x, at_y + y);
    }

private:
    // A row's last word has bits for cells that are not there.
    void clear_beyond() {
        if (width_ % 64 == 0) return;
        const auto kept = (std::uint64_t{1} << (width_ % 64)) - 1;
        for (std::int32_t y = 0; y < height_; ++y) bits_[row(y) + words_ - 1] &= kept;
    }
    std::size_t row(std::int32_t y) const { return words_ * static_cast<std::size_t>(y); }
    std::int32_t width_, height_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

// Sets the cells that a triangle touches. Corners in texels times 2^texel_bits, cells from `ring` cells before the
// origin on.
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
            cells.set(x + ring, y + ring);
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
    const auto ring = ring_of(cell);
    std::vector<Cells> out;
    const auto side = [&](std::int32_t to) { return std::min(to / (cell * texel) + 1 + 2 * ring, most_cells); };
    for (const auto& [x, y] : largest) out.emplace_back(side(x), side(y));
    const auto fits = [&](const Cells& cells) { return cells.width() < most_cells && cells.height() < most_cells; };
    for (std::size_t t = 0; t < corners.size(); ++t) {
        auto& cells = out[layout.chart_of_triangle[t]];
        if (fits(cells)) cover(cells, corners[t], cell, ring);
    }
    for (auto& cells : out)
        if (fits(cells)) cells = cells.grown(ring);
    return out;
}

// The lowest place where the cells are free, of those the leftmost.
std::optional<std::array<std::int32_t, 2>> place_for(const Cells& chart, const Cells& picture, std::int32_t top,
                                                     std::int32_t stride) {
    std::int32_t last = 0;  // the row that did not fit the last time, which probably does not fit the next time
    for (std::int32_t y = 0; y + chart.height() <= top; y += stride)
        for (std::int32_t x = 0; x + chart.width() <= picture.width(); x += stride) {
            if (!picture.row_is_free(chart, last, x, y)) continue;
            std::int32_t row = 0;
            while (row < chart.height() && picture.row_is_free(chart, row, x, y)) ++row;
            if (row == chart.height()) return std::array{x, y};
            last = row;
        }
    return std::nullopt;
}

// The picture as charts are packed into it.
struct Grid {
    Cells cells;            // taken or free
    std::int32_t top;       // charts are laid below this row
    std::int32_t cell = 1;  // a cell's side in texels
    std::int32_t stride = 1;
};

// Gives all charts places among the free cells; false if one finds none. upright, turned: of the same charts.
bool pack(ChartLayout& layout, const Shape& upright, const Shape& turned, const Grid& grid) {
    auto picture = grid.cells;
    std::vector<std::size_t> order(layout.charts.size()), sizes;
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (const auto& cells : upright.cells)
        sizes.push_back(static_cast<std::size_t>(cells.width()) * static_cast<std::size_t>(cells.height()));
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });
    for (const auto chart : order) {
        const auto first = place_for(upright.cells[chart], picture, grid.top, grid.stride);
        const auto second = place_for(turned.cells[chart], picture, grid.top, grid.stride);
        if (!first && !second) return false;
        const auto end = [&](const auto& place, const Shape& shape) {
            return place ? (*place)[1] + shape.cells[chart].height() : std::numeric_limits<std::int32_t>::max();
        };
        const bool turns = end(second, turned) < end(first, upright);
        const auto& shape = turns ? turned : upright;
        const auto [x, y] = turns ? *second : *first;
        picture.add(shape.cells[chart], x, y);
        layout.charts[chart].rotation = shape.alone.charts[chart].rotation;
        layout.charts[chart].x = (x + ring_of(grid.cell)) * grid.cell;
        layout.charts[chart].y = (y + ring_of(grid.cell)) * grid.cell;
    }
    return true;
}

Grid empty_picture(const StreamTexture& picture) {
    const auto cell = cell_of(picture);
    const Cells cells(picture.width / cell, picture.height / cell);
    return {cells, cells.height(), cell, stride_of(picture, cell)};
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
bool pack_at_scale(ChartLayout& layout, const Grid& grid, std::span<const LatticePoint> positions,
                   std::span<const Triangle> triangles) {
    const auto upright = shape_of(layout, positions, triangles, grid.cell);
    const auto turned = shape_of(turned_by_a_quarter(layout), positions, triangles, grid.cell);
    return pack(layout, upright, turned, grid);
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

// Charts with more detail than others get more texels a millimetre: by the root of how much more, within bounds, so
// that neither takes all.
void set_sizes(ChartLayout& layout, std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
               std::span<const float> detail) {
    struct Sum {
        double area = 0, detail = 0;
    };
    std::vector<Sum> charts(layout.charts.size());
    Sum all;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const double area = length(area_vector(positions, triangles[t])) / 2;
        double mean = 0;
        for (const auto v : triangles[t]) mean += static_cast<double>(detail[v]) / 3;
        for (auto* sum : {&charts[layout.chart_of_triangle[t]], &all}) {
            sum->area += area;
            sum->detail += area * mean;
        }
    }
    if (!(all.area > 0 && all.detail > 0)) return;
    constexpr double least = 0.8, most = 1.6;
    for (std::size_t chart = 0; chart < charts.size(); ++chart) {
        const auto& [area, sum] = charts[chart];
        const double share = area > 0 ? sum / area / (all.detail / all.area) : 1;
        layout.charts[chart].size =
            static_cast<std::int32_t>(std::lround(usual_size * std::clamp(std::sqrt(share), least, most)));
    }
}

constexpr double scale_unit = static_cast<double>(texel) * (1 << 16);  // a texel a lattice unit

std::uint32_t whole_scale(double scale) {
    return static_cast<std::uint32_t>(std::clamp(std::floor(scale * scale_unit), 1.0, 1.0 * largest_scale));
}

}  // namespace

Result<PlacedCharts> lay_out(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                             const StreamTexture& picture, std::span<const float> detail) {
    auto cut = cut_into_charts(positions, triangles);
    if (!detail.empty()) set_sizes(cut, positions, triangles, detail);
    auto layout = cut;
    auto grid = empty_picture(picture);
    grid.top = static_cast<std::int32_t>(std::floor(grid.cells.height() * (1 - free_share)));
    // The largest scale that fits lies below that at which triangles seen from the front would fill the picture. Where
    // even the smallest does not fit, there are more charts than the picture has gutters for.
    const double area = std::max(area_of(positions, triangles), 1.0);
    double too_large = std::sqrt(1.0 * picture.width * picture.height / area), fits = 0;
    constexpr double precise = 1.015;
    const auto try_scale = [&](double scale) {
        auto tried = cut;
        tried.scale = whole_scale(scale);
        const bool fine = pack_at_scale(tried, grid, positions, triangles);
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
    auto grid = empty_picture(picture);
    const std::array<std::int64_t, 2> sides = {picture.width, picture.height};
    for (auto corners : taken) {
        for (auto& corner : corners)
            for (std::size_t axis = 0; axis < 2; ++axis)
                corner[axis] = static_cast<std::int32_t>((corner[axis] * sides[axis]) >> (picture_bits - texel_bits));
        cover(grid.cells, corners, grid.cell, 0);
    }
    grid.cells = grid.cells.grown(ring_of(grid.cell));
    // Smaller charts rather than none, down to half the size.
    for (const std::int32_t size : {usual_size, 13, 10, 8}) {
        auto tried = layout;
        for (auto& chart : tried.charts) chart.size = size;
        if (!pack_at_scale(tried, grid, positions, triangles)) continue;
        auto out = placed(tried, positions, triangles, picture);
        return out ? std::optional(std::move(*out)) : std::nullopt;
    }
    return std::nullopt;
}

}  // namespace htvm::internal
