#include "codec/bones/zipper_surface.h"

#include <algorithm>
#include <array>
#include <utility>

namespace htvm::internal::zipping {
namespace {

constexpr std::uint32_t most_in_cell = 128;  // only the first triangles of a cell are stored
constexpr std::int64_t most_cells_long = 4;  // longer triangles are left out

// At most 2^20, since a cell is at least 32 long.
std::int64_t cell_coordinate(std::int64_t c, std::int64_t cell) { return (c + (std::int64_t{1} << 24)) / cell; }
// Adds 1 to each coordinate, so that -1 and 0 are possible; a key is never 0.
std::uint64_t key_of(std::int64_t x, std::int64_t y, std::int64_t z) {
    return (std::uint64_t{1} << 63) | static_cast<std::uint64_t>(x + 1) << 42 |
           static_cast<std::uint64_t>(y + 1) << 21 | static_cast<std::uint64_t>(z + 1);
}

struct Cells {
    std::array<std::int64_t, 3> low, high;
};

constexpr std::uint64_t key_step = (std::uint64_t{1} << 42) + (std::uint64_t{1} << 21) + 1;  // the difference of keys
                                                                                             // one cell further along
                                                                                             // each axis
constexpr std::size_t filter_bits = std::size_t{1} << 19;

std::uint64_t mixed(std::uint64_t key) {
    key *= 0x9E3779B97F4A7C15u;
    return key ^ key >> 29;
}

bool too_long(const Box& box, std::int64_t cell) {
    const LatticePoint size = box.high - box.low;
    return std::max({size.x, size.y, size.z}) > most_cells_long * cell;
}

// Calls visit(key) for each cell of a box, in order.
template <class Visit>
void for_each_cell(const Cells& cells, const Visit& visit) {
    for (std::int64_t x = cells.low[0]; x <= cells.high[0]; ++x)
        for (std::int64_t y = cells.low[1]; y <= cells.high[1]; ++y)
            for (std::int64_t z = cells.low[2]; z <= cells.high[2]; ++z) visit(key_of(x, y, z));
}

Cells cells_of(const Box& box, std::int64_t cell) {
    return {{cell_coordinate(box.low.x, cell), cell_coordinate(box.low.y, cell), cell_coordinate(box.low.z, cell)},
            {cell_coordinate(box.high.x, cell), cell_coordinate(box.high.y, cell), cell_coordinate(box.high.z, cell)}};
}

// A box is never farther away than its contents; the margin is for rounding errors.
double with_margin(double squared_distance) { return squared_distance * 1.001 + 1; }

double distance_to_box(LatticePoint p, const Box& box) {  // squared
    const auto outside = [](std::int32_t low, std::int32_t high, std::int32_t c) {
        return std::max<std::int64_t>({0, std::int64_t{low} - c, std::int64_t{c} - high});
    };
    const std::int64_t dx = outside(box.low.x, box.high.x, p.x), dy = outside(box.low.y, box.high.y, p.y),
                       dz = outside(box.low.z, box.high.z, p.z);
    return static_cast<double>(dx * dx + dy * dy + dz * dz);
}

// The point nearest to x on the triangle with corners p and normal n.
SurfacePoint nearest_on_triangle(LatticePoint x, const std::array<LatticePoint, 3>& p, Direction n) {
    SurfacePoint best;
    bool inside = true;
    for (std::size_t i = 0; i < 3 && inside; ++i)
        inside = dot(cross(direction(p[i], p[(i + 1) % 3]), direction(p[i], x)), n) > 0;
    if (inside) {
        const double height = dot(direction(p[0], x), n);
        best.squared_distance = height * height / dot(n, n);
        return best;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const Direction side = direction(p[i], p[(i + 1) % 3]), to = direction(p[i], x);
        const double along = dot(side, to), length = dot(side, side);
        SurfacePoint here;
        if (along <= 0) {
            here.squared_distance = dot(to, to);
            here.corner = static_cast<int>(i);
        } else if (along >= length) {
            const Direction end = direction(p[(i + 1) % 3], x);
            here.squared_distance = dot(end, end);
            here.corner = static_cast<int>((i + 1) % 3);
        } else {
            const Direction across = cross(side, to);
            here.squared_distance = dot(across, across) / length;
            here.side = static_cast<int>(i);
        }
        if (i == 0 || here.squared_distance < best.squared_distance) best = here;
    }
    return best;
}

}  // namespace

Box box_of(std::span<const LatticePoint> positions, const Triangle& t) {
    Box box{positions[t[0]], positions[t[0]]};
    for (const std::uint32_t v : {t[1], t[2]}) {
        const LatticePoint p = positions[v];
        box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
        box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
    return box;
}

std::int64_t cell_side(std::int64_t reach) { return std::max<std::int64_t>(32, reach); }

CellFilter::CellFilter(std::int64_t reach) : cell_(cell_side(reach)), bits_(filter_bits / 64), last_marked_(1u << 14) {}

void CellFilter::mark(const Box& box) {
    everything_ = everything_ || too_long(box, cell_);
    if (everything_) return;
    for_each_cell(cells_of(box, cell_), [&](std::uint64_t key) {
        std::uint64_t& last = last_marked_[static_cast<std::size_t>(mixed(key)) % last_marked_.size()];
        if (last == key) return;
        last = key;
        marked_.push_back(key);
    });
}

void CellFilter::widen() {
    for (const std::uint64_t key : marked_)
        for (std::uint64_t x = 0; x < 3; ++x)
            for (std::uint64_t y = 0; y < 3; ++y)
                for (std::uint64_t z = 0; z < 3; ++z) {
                    const std::uint64_t around = key + (x << 42) + (y << 21) + z - key_step;
                    const std::size_t bit = static_cast<std::size_t>(mixed(around)) % filter_bits;
                    bits_[bit / 64] |= std::uint64_t{1} << bit % 64;
                }
}

bool CellFilter::may_touch(const Box& box) const {
    bool touches = everything_ || too_long(box, cell_);
    if (touches) return true;
    for_each_cell(cells_of(box, cell_), [&](std::uint64_t key) {
        const std::size_t bit = static_cast<std::size_t>(mixed(key)) % filter_bits;
        touches = touches || (bits_[bit / 64] >> bit % 64 & 1);
    });
    return touches;
}

SurfaceGrid::SurfaceGrid(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                         std::span<const std::uint32_t> used, std::int64_t reach)
    : positions_(positions), triangles_(triangles), reach_(reach), cell_(cell_side(reach)) {
    std::vector<Entry> boxes;
    boxes.reserve(used.size());
    std::size_t in_cells = 0;
    for (const std::uint32_t t : used) {
        const Entry entry{box_of(positions, triangles[t]), t};
        if (too_long(entry.box, cell_)) continue;
        boxes.push_back(entry);
        for_each_cell(cells_of(entry.box, cell_), [&](std::uint64_t) { ++in_cells; });
    }
    std::size_t slots = 16;
    while (slots < 2 * in_cells) slots *= 2;
    cells_.resize(slots);
    for (const Entry& entry : boxes)
        for_each_cell(cells_of(entry.box, cell_), [&](std::uint64_t key) {
            Cell& cell = cells_[slot_of(key)];
            cell.key = key;
            cell.end = std::min(cell.end + 1, most_in_cell);
        });
    std::uint32_t begin = 0;
    for (Cell& cell : cells_) {
        const std::uint32_t count = cell.end;
        cell.begin = cell.end = begin;
        begin += count;
    }
    entries_.resize(begin);
    for (const Entry& entry : boxes)
        for_each_cell(cells_of(entry.box, cell_), [&](std::uint64_t key) {
            Cell& cell = cells_[slot_of(key)];
            if (cell.end - cell.begin < most_in_cell) entries_[cell.end++] = entry;
        });
}

// The slot that holds the key, or a free one.
std::size_t SurfaceGrid::slot_of(std::uint64_t key) const {
    const std::size_t mask = cells_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(mixed(key)) & mask;
    while (cells_[slot].key != 0 && cells_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
}

void SurfaceGrid::look_at(const Entry& entry, LatticePoint point, Direction facing, SurfacePoint& best) const {
    const Triangle& t = triangles_[entry.triangle];
    const std::array<LatticePoint, 3> corners = {positions_[t[0]], positions_[t[1]], positions_[t[2]]};
    const Direction normal = cross(direction(corners[0], corners[1]), direction(corners[0], corners[2]));
    if (!(dot(normal, facing) > 0)) return;
    SurfacePoint here = nearest_on_triangle(point, corners, normal);
    here.triangle = entry.triangle;
    if (here.squared_distance < best.squared_distance ||
        (here.squared_distance == best.squared_distance && here.triangle < best.triangle))
        best = here;
}

// Searches the triangles of one cell; the result does not depend on the order of the cells.
void SurfaceGrid::look_into(std::uint64_t key, LatticePoint point, Direction facing, SurfacePoint& best) const {
    const Cell& cell = cells_[slot_of(key)];
    if (cell.key == 0) return;
    std::array<std::pair<double, std::uint32_t>, most_in_cell> boxes;  // squared distance, entry
    std::size_t count = 0, nearest = 0;
    const double limit = with_margin(best.squared_distance);
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
        const double distance = distance_to_box(point, entries_[i].box);
        if (distance > limit) continue;
        if (count == 0 || distance < boxes[nearest].first) nearest = count;
        boxes[count++] = {distance, i};
    }
    if (count == 0) return;
    look_at(entries_[boxes[nearest].second], point, facing, best);
    for (std::size_t k = 0; k < count; ++k)
        if (k != nearest && boxes[k].first <= with_margin(best.squared_distance))
            look_at(entries_[boxes[k].second], point, facing, best);
}

SurfacePoint SurfaceGrid::nearest(LatticePoint point, Direction facing) const {
    SurfacePoint best;  // triangle none with the reach as its distance; ordered after every triangle
    best.squared_distance = static_cast<double>(reach_) * static_cast<double>(reach_);
    if (entries_.empty()) return best;
    const Cells own = cells_of({point, point}, cell_);
    const LatticePoint moved = point - LatticePoint{-lattice_limit, -lattice_limit, -lattice_limit};
    const std::array<std::int64_t, 3> within = {moved.x - own.low[0] * cell_, moved.y - own.low[1] * cell_,
                                                moved.z - own.low[2] * cell_};
    const auto gap = [&](std::int64_t step, std::size_t axis) {
        return step == 0 ? 0 : step > 0 ? cell_ - within[axis] : within[axis];
    };
    look_into(key_of(own.low[0], own.low[1], own.low[2]), point, facing, best);
    for (std::int64_t x = -1; x <= 1; ++x)
        for (std::int64_t y = -1; y <= 1; ++y)
            for (std::int64_t z = -1; z <= 1; ++z) {
                const std::int64_t dx = gap(x, 0), dy = gap(y, 1), dz = gap(z, 2);
                if ((x == 0 && y == 0 && z == 0) ||
                    static_cast<double>(dx * dx + dy * dy + dz * dz) > with_margin(best.squared_distance))
                    continue;
                look_into(key_of(own.low[0] + x, own.low[1] + y, own.low[2] + z), point, facing, best);
            }
    return best;
}

}  // namespace htvm::internal::zipping
