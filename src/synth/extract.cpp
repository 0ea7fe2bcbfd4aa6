#include "synth/extract.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace htvm::synth {

using namespace internal;
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int brick_cells = 4;               // along each side
constexpr int brick_side = brick_cells + 1;  // corners along each side
constexpr int brick_corners = brick_side * brick_side * brick_side;
constexpr int edges_per_corner = 7;  // to the corners at +{0,1}^3, numbered by the bits of that offset minus one
constexpr int owned_edges = brick_cells * brick_cells * brick_cells * edges_per_corner;
constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

struct Brick {
    Vector3i first;  // grid index of its lowest corner
    PartSet candidates = 0;
    std::array<float, brick_corners> values;
    std::array<std::uint32_t, owned_edges> vertex;  // on each owned edge; local until the bricks are numbered
    std::array<std::int32_t, 8> neighbour;          // brick at +{0,1}^3 by the bits of the offset, -1 if there is none
    std::vector<Vector3d> positions;
    std::vector<EdgePlace> places;
    std::vector<Triangle> triangles;
};

// 21 bits of brick index per axis.
std::uint64_t brick_key(const Vector3i& brick) {
    const auto part = [](int c) { return static_cast<std::uint64_t>(c + (1 << 20)) & 0x1fffffu; };
    return part(brick.x()) << 42 | part(brick.y()) << 21 | part(brick.z());
}

Vector3d corner_position(const Grid& grid, const Vector3i& corner) {
    return grid.origin + grid.rotation * (grid.cell * corner.cast<double>());
}

int corner_index(int x, int y, int z) { return (z * brick_side + y) * brick_side + x; }
int edge_index(int x, int y, int z, int direction) {
    return ((z * brick_cells + y) * brick_cells + x) * edges_per_corner + direction - 1;
}

// Descends an octree whose nodes of level n have 2^n bricks along a side, and collects the bricks that the surface
// enters.
void find_bricks(const PosedScene& scene, const Grid& grid, const Vector3i& first, int level, PartSet candidates,
                 std::vector<Brick>& bricks) {
    const int cells = brick_cells << level;
    const Vector3d centre =
        grid.origin + grid.rotation * (grid.cell * (first.cast<double>().array() + 0.5 * cells).matrix());
    // A quarter more than the node, so that vertices that later move along the surface still find their parts.
    const BallBounds bounds = bound_surface(scene, candidates, centre, 1.25 * grid.cell * cells * std::sqrt(0.75));
    if (!bounds.crosses) return;
    if (level == 0) {
        Brick& brick = bricks.emplace_back();
        brick.first = first;
        brick.candidates = bounds.candidates;
        return;
    }
    const int half = cells / 2;
    for (int octant = 0; octant < 8; ++octant)
        find_bricks(scene, grid, first + half * Vector3i(octant & 1, octant >> 1 & 1, octant >> 2), level - 1,
                    bounds.candidates, bricks);
}

std::vector<Brick> find_all_bricks(const PosedScene& scene, const Grid& grid) {
    Vector3d low = Vector3d::Constant(std::numeric_limits<double>::max()), high = -low;
    for (const auto& landmark : scene.landmarks) {
        const Vector3d local = grid.rotation.transpose() * (landmark - grid.origin) / grid.cell;
        low = low.cwiseMin(local);
        high = high.cwiseMax(local);
    }
    const double margin = 260.0 / grid.cell;  // mm, no part reaches further from the landmarks
    const Vector3i first = (low.array() - margin).floor().cast<int>().matrix();
    const double extent = (high - low).maxCoeff() + 2 * margin + 2;
    // Bricks start at multiples of their size, so that the brick follows from the position.
    const auto align = [](int c) { return (c >= 0 ? c : c - brick_cells + 1) / brick_cells * brick_cells; };
    int level = 0;
    while ((brick_cells << level) < extent + brick_cells) ++level;
    std::vector<Brick> bricks;
    find_bricks(scene, grid, Vector3i(align(first.x()), align(first.y()), align(first.z())), level, scene.present,
                bricks);
    return bricks;
}

void evaluate_brick(const PosedScene& scene, const Grid& grid, Brick& brick) {
    for (int z = 0; z < brick_side; ++z)
        for (int y = 0; y < brick_side; ++y)
            for (int x = 0; x < brick_side; ++x)
                brick.values[corner_index(x, y, z)] = static_cast<float>(
                    evaluate_surface(scene, brick.candidates, corner_position(grid, brick.first + Vector3i(x, y, z)))
                        .distance);
}

// Puts a vertex where the function, linearly interpolated along the edge, is zero.
void place_vertices(const Grid& grid, Brick& brick) {
    brick.vertex.fill(no_vertex);
    for (int z = 0; z < brick_cells; ++z)
        for (int y = 0; y < brick_cells; ++y)
            for (int x = 0; x < brick_cells; ++x) {
                const float from = brick.values[corner_index(x, y, z)];
                for (int d = 1; d <= edges_per_corner; ++d) {
                    const Vector3i offset(d & 1, d >> 1 & 1, d >> 2);
                    const float to = brick.values[corner_index(x + offset.x(), y + offset.y(), z + offset.z())];
                    if ((from < 0) == (to < 0)) continue;
                    const double share = std::clamp(double{from} / (double{from} - double{to}), 0.02, 0.98);
                    const Vector3i corner = brick.first + Vector3i(x, y, z);
                    brick.vertex[edge_index(x, y, z, d)] = static_cast<std::uint32_t>(brick.positions.size());
                    const Vector3d edge = grid.rotation * (grid.cell * offset.cast<double>());
                    brick.positions.push_back(corner_position(grid, corner) + share * edge);
                    brick.places.push_back({edge, share});
                }
            }
}

// The six tetrahedra of a cell around its main diagonal, as corner bits, each positively oriented.
constexpr std::array<std::array<int, 4>, 6> cell_tetrahedra = {
    {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 3, 2, 7}, {0, 6, 4, 7}, {0, 5, 1, 7}}};

// Even permutations that put a given corner, or a given pair of corners, first.
constexpr std::array<std::array<int, 4>, 4> one_first = {{{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}};
constexpr std::array<std::array<int, 4>, 6> two_first = {
    {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};

// Emits the triangles of a tetrahedron; each vertex is given as the two corners whose edge it lies on.
template <class Emit>
void polygonise_tetrahedron(unsigned inside, const Emit& emit) {
    using Edge = std::array<int, 2>;
    const int count = (inside & 1) + (inside >> 1 & 1) + (inside >> 2 & 1) + (inside >> 3 & 1);
    if (count == 1 || count == 3) {
        const unsigned single = count == 1 ? inside : ~inside & 15u;
        for (const auto& p : one_first) {
            if (single != 1u << p[0]) continue;
            const Edge a{p[0], p[1]}, b{p[0], p[2]}, c{p[0], p[3]};
            if (count == 1)
                emit(a, b, c);
            else
                emit(a, c, b);
        }
    } else if (count == 2) {
        for (const auto& p : two_first) {
            if (inside != ((1u << p[0]) | (1u << p[1]))) continue;
            const Edge a{p[0], p[2]}, b{p[0], p[3]}, c{p[1], p[3]}, d{p[1], p[2]};
            emit(a, b, c);
            emit(a, c, d);
        }
    }
}

// The global index of the vertex on the edge between two corners of a cell, which are given as offset bits.
std::uint32_t vertex_on_edge(const std::vector<Brick>& bricks, const Brick& brick, const Vector3i& cell, int a, int b) {
    const int low = a & b, direction = a ^ b;
    Vector3i corner = cell + Vector3i(low & 1, low >> 1 & 1, low >> 2);
    int side = 0;
    for (int axis = 0; axis < 3; ++axis)
        if (corner[axis] == brick_cells) {
            side |= 1 << axis;
            corner[axis] = 0;
        }
    const std::int32_t owner = brick.neighbour[side];
    if (owner < 0) return no_vertex;
    return bricks[owner].vertex[edge_index(corner.x(), corner.y(), corner.z(), direction)];
}

void triangulate_brick(const std::vector<Brick>& bricks, Brick& brick) {
    for (int z = 0; z < brick_cells; ++z)
        for (int y = 0; y < brick_cells; ++y)
            for (int x = 0; x < brick_cells; ++x) {
                unsigned inside = 0;
                for (int c = 0; c < 8; ++c)
                    inside |= unsigned{brick.values[corner_index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))] < 0}
                              << c;
                if (inside == 0 || inside == 255) continue;
                for (const auto& corners : cell_tetrahedra) {
                    unsigned mask = 0;
                    for (int i = 0; i < 4; ++i) mask |= (inside >> corners[i] & 1u) << i;
                    polygonise_tetrahedron(mask, [&](auto a, auto b, auto c) {
                        const auto vertex = [&](auto edge) {
                            return vertex_on_edge(bricks, brick, {x, y, z}, corners[edge[0]], corners[edge[1]]);
                        };
                        const Triangle triangle{vertex(a), vertex(b), vertex(c)};
                        if (std::ranges::find(triangle, no_vertex) == triangle.end())
                            brick.triangles.push_back(triangle);
                    });
                }
            }
}

}  // namespace

PartSet BrickMap::at(const Vector3d& world) const {
    const Vector3d local = grid.rotation.transpose() * (world - grid.origin) / (grid.cell * brick_cells);
    const auto found = candidates.find(brick_key(local.array().floor().cast<int>().matrix()));
    return found == candidates.end() ? present : found->second;
}

Extraction extract_surface(const PosedScene& scene, const Grid& grid, Threads threads) {
    std::vector<Brick> bricks = find_all_bricks(scene, grid);
    std::unordered_map<std::uint64_t, std::int32_t> index;
    index.reserve(2 * bricks.size());
    const auto brick_of = [](const Vector3i& first) { return Vector3i(first / brick_cells); };
    for (std::size_t i = 0; i < bricks.size(); ++i)
        index.emplace(brick_key(brick_of(bricks[i].first)), static_cast<std::int32_t>(i));
    parallel_for(bricks.size(), threads, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            evaluate_brick(scene, grid, bricks[i]);
            place_vertices(grid, bricks[i]);
            for (int side = 0; side < 8; ++side) {
                const Vector3i offset(side & 1, side >> 1 & 1, side >> 2);
                const auto found = index.find(brick_key(brick_of(bricks[i].first) + offset));
                bricks[i].neighbour[side] = found == index.end() ? -1 : found->second;
            }
        }
    });
    Extraction result;
    for (Brick& brick : bricks) {
        const auto first = static_cast<std::uint32_t>(result.positions.size());
        for (auto& vertex : brick.vertex)
            if (vertex != no_vertex) vertex += first;
        result.positions.insert(result.positions.end(), brick.positions.begin(), brick.positions.end());
        result.places.insert(result.places.end(), brick.places.begin(), brick.places.end());
    }
    parallel_for(bricks.size(), threads, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) triangulate_brick(bricks, bricks[i]);
    });
    result.bricks.grid = grid;
    result.bricks.present = scene.present;
    result.bricks.candidates.reserve(2 * bricks.size());
    for (const Brick& brick : bricks) {
        result.triangles.insert(result.triangles.end(), brick.triangles.begin(), brick.triangles.end());
        result.bricks.candidates.emplace(brick_key(brick_of(brick.first)), brick.candidates);
    }
    return result;
}

}  // namespace htvm::synth
