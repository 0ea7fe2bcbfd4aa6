// A chart's triangles must face its direction within some angle, since the picture's resolution falls with the angle's
// cosine. First the surface is covered greedily: of 26 directions, the largest connected region that faces one becomes
// a chart, then the largest of the rest, and so on. So the cover is found of what the surface looks like, a face or a
// back stays whole, and there is no number of charts to choose. Then each chart takes its own mean direction, and all
// grow anew from their middles, the best-facing triangle first, so that borders lie where triangles face two charts
// equally (which is also what makes them cheap to code). What overlaps in the projection is cut off, what is too small
// is given to a neighbour.
#include "codec/encoder/charts/chart_cut.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <unordered_map>

#include "core/geometry.h"
#include "core/raster.h"

namespace htvm::internal {
namespace {

constexpr std::uint32_t none = no_chart;

// Cosines of the largest angles between triangles and their chart's direction.
constexpr double cover_facing = 0.64;   // 50 degrees: to be covered
constexpr double grow_facing = 0.5;     // 60 degrees: when charts grow anew
constexpr double least_facing = 0.2;    // 78 degrees: rather than to be a chart of a few triangles
constexpr double merged_facing = 0.42;  // 65 degrees: for two charts to become one

struct Face {
    Vector3d normal{};  // unit length; zero without an area
    Vector3d facing{};  // mean of the normals around, so that a wrinkle is no border
    double area = 0;
    std::array<std::uint32_t, 3> neighbours = {none, none, none};
};

using Faces = std::vector<Face>;
using Labels = std::vector<std::uint32_t>;

// Pairs the triangles at each edge: the first with the second, the third with the fourth.
void find_neighbours(std::span<const Triangle> triangles, Faces& faces) {
    std::unordered_map<std::uint64_t, std::uint32_t> open;
    open.reserve(2 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
        for (std::uint32_t i = 0; i < 3; ++i) {
            const auto a = triangles[t][i], b = triangles[t][(i + 1) % 3];
            const auto key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
            const auto [at, is_new] = open.emplace(key, 3 * t + i);
            if (is_new) continue;
            const auto other = at->second;
            faces[t].neighbours[i] = other / 3;
            faces[other / 3].neighbours[other % 3] = t;
            open.erase(at);
        }
}

Faces make_faces(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    Faces faces(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto along = area_vector(positions, triangles[t]);
        faces[t].area = length(along) / 2;
        faces[t].normal = faces[t].facing = normalised(along);
    }
    find_neighbours(triangles, faces);
    constexpr int rounds = 3;
    for (int round = 0; round < rounds; ++round) {
        std::vector<Vector3d> means;
        means.reserve(faces.size());
        for (const auto& face : faces) {
            auto sum = face.facing * face.area;
            for (const auto n : face.neighbours)
                if (n != none) sum = sum + faces[n].facing * faces[n].area;
            means.push_back(normalised(sum));
        }
        for (std::size_t t = 0; t < faces.size(); ++t) faces[t].facing = means[t];
    }
    return faces;
}

// What hangs together with the start through faces that `take` lets through; it must let none through twice.
template <class Test>
std::vector<std::uint32_t> connected(const Faces& faces, std::uint32_t start, const Test& take) {
    std::vector<std::uint32_t> out;
    if (!take(start)) return out;
    out.push_back(start);
    for (std::size_t i = 0; i < out.size(); ++i)
        for (const auto n : faces[out[i]].neighbours)
            if (n != none && take(n)) out.push_back(n);
    return out;
}

double area_of(const Faces& faces, std::span<const std::uint32_t> of) {
    double sum = 0;
    for (const auto t : of) sum += faces[t].area;
    return sum;
}

Vector3d mean_normal(const Faces& faces, std::span<const std::uint32_t> of) {
    Vector3d sum{};
    for (const auto t : of) sum = sum + faces[t].normal * faces[t].area;
    return normalised(sum);
}

// ---- The cover -----------------------------------------------------------------------------------------------------

// Gives numbers from `count` on to the largest regions that face a direction, down to the given area.
void cover(const Faces& faces, double least_area, Labels& labels, std::uint32_t& count) {
    std::vector<Vector3d> directions;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (x != 0 || y != 0 || z != 0)
                    directions.push_back(
                        normalised({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}));
    struct Region {
        double area = 0;
        std::vector<std::uint32_t> faces;
    };
    std::vector<std::uint32_t> seen(faces.size(), 0);
    std::uint32_t pass = 0;
    const auto largest = [&](const Vector3d& direction) {
        ++pass;
        const auto take = [&](std::uint32_t t) {
            if (labels[t] != none || seen[t] == pass || dot(faces[t].facing, direction) < cover_facing) return false;
            seen[t] = pass;
            return true;
        };
        Region best;
        for (std::uint32_t t = 0; t < faces.size(); ++t) {
            auto region = connected(faces, t, take);
            const double area = area_of(faces, region);
            if (area > best.area) best = {area, std::move(region)};
        }
        return best;
    };
    // What is left only shrinks, so a region found before says how large one may still be.
    using Bound = std::pair<double, std::size_t>;
    std::priority_queue<Bound> bounds;
    std::vector<Region> found;
    for (std::size_t i = 0; i < directions.size(); ++i) {
        found.push_back(largest(directions[i]));
        bounds.emplace(found[i].area, i);
    }
    while (!bounds.empty() && bounds.top().first > least_area) {
        const auto i = bounds.top().second;
        bounds.pop();
        const bool whole = std::all_of(found[i].faces.begin(), found[i].faces.end(),
                                       [&](std::uint32_t t) { return labels[t] == none; });
        if (whole) {
            for (const auto t : found[i].faces) labels[t] = count;
            ++count;
        }
        found[i] = largest(directions[i]);
        bounds.emplace(found[i].area, i);
    }
}

// Makes charts of what has none: each of what hangs together and faces about the same way.
void cover_the_rest(const Faces& faces, Labels& labels, std::uint32_t& count) {
    for (std::uint32_t t = 0; t < faces.size(); ++t) {
        if (labels[t] != none) continue;
        const auto direction = faces[t].facing;
        connected(faces, t, [&](std::uint32_t u) {
            if (labels[u] != none || (u != t && dot(faces[u].facing, direction) < cover_facing)) return false;
            labels[u] = count;
            return true;
        });
        ++count;
    }
}

// ---- Growing anew --------------------------------------------------------------------------------------------------

std::vector<std::vector<std::uint32_t>> members(const Labels& labels, std::uint32_t count) {
    std::vector<std::vector<std::uint32_t>> out(count);
    for (std::uint32_t t = 0; t < labels.size(); ++t)
        if (labels[t] != none) out[labels[t]].push_back(t);
    return out;
}

// Each chart from the triangle that faces its direction best, everywhere the best-facing triangle first.
Labels grown(const Faces& faces, const Labels& labels, std::uint32_t count) {
    Labels out(faces.size(), none);
    std::vector<Vector3d> directions;
    struct Offer {
        double facing;
        std::uint32_t face, chart;
        bool operator<(const Offer& other) const {
            return facing != other.facing ? facing < other.facing : face > other.face;
        }
    };
    std::priority_queue<Offer> offers;
    const auto offer = [&](std::uint32_t t, std::uint32_t chart) {
        const double facing = dot(faces[t].facing, directions[chart]);
        if (out[t] == none && facing >= grow_facing) offers.push({facing, t, chart});
    };
    const auto all = members(labels, count);
    for (std::uint32_t chart = 0; chart < count; ++chart) {
        directions.push_back(mean_normal(faces, all[chart]));
        const auto seed = std::max_element(all[chart].begin(), all[chart].end(), [&](std::uint32_t a, std::uint32_t b) {
            return dot(faces[a].facing, directions[chart]) < dot(faces[b].facing, directions[chart]);
        });
        if (seed != all[chart].end()) offer(*seed, chart);
    }
    while (!offers.empty()) {
        const auto [facing, t, chart] = offers.top();
        offers.pop();
        if (out[t] != none) continue;
        out[t] = chart;
        for (const auto n : faces[t].neighbours)
            if (n != none) offer(n, chart);
    }
    return out;
}

// Gives faces that have no chart to the one beside them that they face best.
void fill(const Faces& faces, std::uint32_t count, Labels& labels) {
    const auto all = members(labels, count);
    std::vector<Vector3d> directions;
    for (const auto& chart : all) directions.push_back(mean_normal(faces, chart));
    for (bool changed = true; changed;) {
        changed = false;
        for (std::uint32_t t = 0; t < faces.size(); ++t) {
            if (labels[t] != none) continue;
            double best = faces[t].area > 0 ? least_facing : -2;
            for (const auto n : faces[t].neighbours) {
                if (n == none || labels[n] == none) continue;
                const double facing = dot(faces[t].normal, directions[labels[n]]);
                if (facing <= best) continue;
                best = facing;
                labels[t] = labels[n];
                changed = true;
            }
        }
    }
}

// A face between two of another chart joins them, so that borders are short.
void smooth_borders(const Faces& faces, std::uint32_t count, Labels& labels) {
    constexpr int rounds = 3;
    const auto all = members(labels, count);
    std::vector<Vector3d> directions;
    for (const auto& chart : all) directions.push_back(mean_normal(faces, chart));
    for (int round = 0; round < rounds; ++round)
        for (std::uint32_t t = 0; t < faces.size(); ++t) {
            const auto& n = faces[t].neighbours;
            for (std::size_t i = 0; i < 3; ++i) {
                const auto a = n[i], b = n[(i + 1) % 3];
                if (a == none || b == none || labels[a] != labels[b] || labels[a] == labels[t] || labels[a] == none)
                    continue;
                if (dot(faces[t].normal, directions[labels[a]]) < merged_facing) continue;
                labels[t] = labels[a];
                break;
            }
        }
}

// ---- Overlaps ------------------------------------------------------------------------------------------------------

struct Frame {
    Vector3d x{}, y{}, direction{};
};

// Axes at a right angle to the direction.
Frame frame_of(const Vector3d& direction) {
    const Vector3d other = std::abs(direction[1]) < 0.9 ? Vector3d{0, 1, 0} : Vector3d{1, 0, 0};
    const auto x = normalised(cross(other, direction));
    return {x, cross(direction, x), direction};
}

struct Mesh2 {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
    double cell;  // of the grid in which overlaps are looked for, lattice units
};

// The faces, in this order, that hide none of those before them, nor are seen from behind.
class Shadow {
public:
    Shadow(const Mesh2& mesh, const Frame& frame, std::span<const std::uint32_t> faces) : mesh_(mesh), frame_(frame) {
        std::array<double, 2> low = {1e300, 1e300}, high = {-1e300, -1e300};
        for (const auto t : faces)
            for (const auto v : mesh.triangles[t]) {
                const auto p = to_vector(mesh.positions[v]);
                const std::array<double, 2> at = {dot(p, frame.x), dot(p, frame.y)};
                for (std::size_t axis = 0; axis < 2; ++axis) {
                    low[axis] = std::min(low[axis], at[axis]);
                    high[axis] = std::max(high[axis], at[axis]);
                }
            }
        if (faces.empty()) return;
        // Not more cells than this, whatever the mesh.
        constexpr double most = 1 << 22;
        cell_ = std::max(mesh.cell, std::sqrt((high[0] - low[0]) * (high[1] - low[1]) / most));
        constexpr double longest = 1 << 20;
        cell_ = std::max({cell_, (high[0] - low[0]) / longest, (high[1] - low[1]) / longest});
        low_ = low;
        width_ = static_cast<std::int32_t>((high[0] - low[0]) / cell_) + 2;
        height_ = static_cast<std::int32_t>((high[1] - low[1]) / cell_) + 2;
        covered_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), false);
    }

    bool hides(std::uint32_t t) const {
        bool out = false;
        cells(t, [&](std::size_t at) { out = out || covered_[at]; });
        return out;
    }
    void cover(std::uint32_t t) {
        cells(t, [&](std::size_t at) { covered_[at] = true; });
    }

private:
    template <class At>
    void cells(std::uint32_t t, const At& at) const {
        std::array<RasterPoint, 3> corners;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto p = to_vector(mesh_.positions[mesh_.triangles[t][i]]);
            constexpr double unit = 1 << raster_bits;
            corners[i] = {static_cast<std::int32_t>(std::lround((dot(p, frame_.x) - low_[0]) / cell_ * unit)),
                          static_cast<std::int32_t>(std::lround((dot(p, frame_.y) - low_[1]) / cell_ * unit))};
        }
        for_each_cell(corners, {0, 0, width_, height_}, [&](std::int32_t x, std::int32_t y) {
            at(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
        });
    }
    const Mesh2& mesh_;
    Frame frame_;
    double cell_ = 1;
    std::array<double, 2> low_{};
    std::int32_t width_ = 0, height_ = 0;
    std::vector<bool> covered_;
};

// Whether all of them are seen from the direction, and none hides another.
bool lie_side_by_side(const Faces& faces, const Mesh2& mesh, std::span<const std::uint32_t> of, double least) {
    const auto direction = mean_normal(faces, of);
    for (const auto t : of)
        if (faces[t].area > 0 && dot(faces[t].normal, direction) < least) return false;
    Shadow shadow(mesh, frame_of(direction), of);
    for (const auto t : of) {
        if (shadow.hides(t)) return false;
        shadow.cover(t);
    }
    return true;
}

// Takes out of each chart the faces that others hide, or that are seen from behind. What is taken out becomes charts by
// itself, each of which hangs together, and is looked at in the same way.
void cut_overlaps(const Faces& faces, const Mesh2& mesh, Labels& labels, std::uint32_t& count) {
    auto charts = members(labels, count);
    std::vector<bool> looked(faces.size(), false);
    for (std::uint32_t chart = 0; chart < charts.size(); ++chart) {
        const auto own = charts[chart];
        if (own.empty()) continue;
        const auto direction = mean_normal(faces, own);
        Shadow shadow(mesh, frame_of(direction), own);
        std::vector<std::uint32_t> out;
        const auto take = [&](std::uint32_t t) {
            if (labels[t] != chart || looked[t]) return false;
            looked[t] = true;
            const bool from_behind = faces[t].area > 0 && dot(faces[t].normal, direction) <= 0.05;
            if (own.size() > 1 && (from_behind || shadow.hides(t))) {
                out.push_back(t);
                return false;
            }
            shadow.cover(t);
            return true;
        };
        // From the middle on, so that what is cut off hangs together.
        connected(faces,
                  *std::max_element(own.begin(), own.end(),
                                    [&](std::uint32_t a, std::uint32_t b) {
                                        return dot(faces[a].facing, direction) < dot(faces[b].facing, direction);
                                    }),
                  take);
        for (const auto t : own) connected(faces, t, take);
        for (const auto t : own) looked[t] = false;
        // Where all would be taken out, as of a chart that faces nowhere, each face is a chart.
        const bool all = out.size() == own.size();
        for (const auto t : out) labels[t] = none;
        for (const auto t : out) {
            const auto next = static_cast<std::uint32_t>(charts.size());
            auto piece = connected(faces, t, [&](std::uint32_t u) {
                if (labels[u] != none || (all && u != t)) return false;
                labels[u] = next;
                return true;
            });
            if (!piece.empty()) charts.push_back(std::move(piece));
        }
    }
    count = static_cast<std::uint32_t>(charts.size());
}

// ---- Joining -------------------------------------------------------------------------------------------------------

// Joins charts that lie beside each other as long as that is possible: the smallest first, with the neighbour to which
// it has the longest border. A crumb, such as the inside of a wrinkle, is joined in any case: a few triangles then show
// what lies over them, which is seen less than a gutter costs.
void join(const Faces& faces, const Mesh2& mesh, double area, std::uint32_t count, Labels& labels) {
    constexpr double small_share = 0.004, crumb_share = 0.0004;
    auto all = members(labels, count);
    std::vector<double> areas;
    for (const auto& chart : all) areas.push_back(area_of(faces, chart));
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return areas[a] < areas[b]; });
    for (const auto chart : order) {
        if (all[chart].empty()) continue;
        std::vector<std::pair<std::uint32_t, std::uint32_t>> borders;  // edges, chart beside
        std::unordered_map<std::uint32_t, std::uint32_t> edges;
        for (const auto t : all[chart])
            for (const auto n : faces[t].neighbours)
                if (n != none && labels[n] != chart) ++edges[labels[n]];
        for (const auto& [beside, number] : edges) borders.emplace_back(number, beside);
        std::sort(borders.rbegin(), borders.rend());
        for (const auto& [number, beside] : borders) {
            auto both = all[beside];
            both.insert(both.end(), all[chart].begin(), all[chart].end());
            const double least = areas[chart] < small_share * area ? least_facing : merged_facing;
            if (areas[chart] > crumb_share * area && !lie_side_by_side(faces, mesh, both, least)) continue;
            for (const auto t : all[chart]) labels[t] = beside;
            areas[beside] += areas[chart];
            all[beside] = std::move(both);
            all[chart].clear();
            break;
        }
    }
}

// ---- The result ----------------------------------------------------------------------------------------------------

// The turn about the direction at which the box around the faces has the least area, its long side up.
Frame turned(const Mesh2& mesh, std::span<const std::uint32_t> faces, const Vector3d& direction) {
    const auto frame = frame_of(direction);
    std::vector<std::array<double, 2>> points;
    for (const auto t : faces)
        for (const auto v : mesh.triangles[t]) {
            const auto p = to_vector(mesh.positions[v]);
            points.push_back({dot(p, frame.x), dot(p, frame.y)});
        }
    constexpr int steps = 45;  // in a quarter of a turn
    double best = 1e300;
    Frame out = frame;
    for (int step = 0; step < steps; ++step) {
        const double angle = 1.5707963267948966 * step / steps, c = std::cos(angle), s = std::sin(angle);
        std::array<double, 2> low = {1e300, 1e300}, high = {-1e300, -1e300};
        for (const auto& [x, y] : points) {
            const std::array<double, 2> at = {c * x + s * y, c * y - s * x};
            for (std::size_t axis = 0; axis < 2; ++axis) {
                low[axis] = std::min(low[axis], at[axis]);
                high[axis] = std::max(high[axis], at[axis]);
            }
        }
        const double wide = high[0] - low[0], high_by = high[1] - low[1];
        if (wide * high_by >= best) continue;
        best = wide * high_by;
        out.x = frame.x * c + frame.y * s;
        out.y = frame.y * c - frame.x * s;
        if (wide > high_by) out = {out.y * -1.0, out.x, direction};
    }
    out.direction = direction;
    return out;
}

// The matrix's rows are the frame's axes.
QuantisedRotation rotation_of(const Frame& f) {
    const std::array<Vector3d, 3> m = {f.x, f.y, f.direction};
    // The quaternion is taken from the matrix in that of four ways which has the largest component (Shepperd).
    const std::array<double, 4> squares = {1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
                                           1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]};
    const auto largest = static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
    const double xy = m[0][1] + m[1][0], xz = m[0][2] + m[2][0], yz = m[1][2] + m[2][1];
    const double wx = m[2][1] - m[1][2], wy = m[0][2] - m[2][0], wz = m[1][0] - m[0][1];
    const std::array<std::array<double, 4>, 4> ways = {
        {{squares[0], wx, wy, wz}, {wx, squares[1], xy, xz}, {wy, xy, squares[2], yz}, {wz, xz, yz, squares[3]}}};
    auto out = quantise_rotation(ways[largest]);
    for (auto& c : out.others)
        c = static_cast<std::int16_t>(std::lround(static_cast<double>(c) / coarse_rotation) * coarse_rotation);
    return out;
}

// Numbers the charts in the order in which triangles name them. The last numbers there may be serve for several.
ChartLayout layout_of(const Faces& faces, const Mesh2& mesh, const Labels& labels, std::uint32_t count) {
    ChartLayout out;
    std::vector<std::uint32_t> number(count, none);
    std::uint32_t used = 0;
    for (const auto label : labels) {
        if (number[label] == none)
            number[label] = used < most_charts ? used++ : static_cast<std::uint32_t>(most_charts - 1);
        out.chart_of_triangle.push_back(number[label]);
    }
    for (const auto& chart : members(out.chart_of_triangle, used)) {
        auto direction = mean_normal(faces, chart);
        if (!(length(direction) > 0.5)) direction = {0, 0, 1};
        out.charts.push_back({.rotation = rotation_of(turned(mesh, chart, direction))});
    }
    return out;
}

}  // namespace

ChartLayout cut_into_charts(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    const auto faces = make_faces(positions, triangles);
    const double area =
        std::accumulate(faces.begin(), faces.end(), 0.0, [](double sum, const Face& face) { return sum + face.area; });
    const Mesh2 mesh{positions, triangles, std::max(mean_edge(positions, triangles) / 4, 1.0)};
    constexpr double least_share = 0.001;
    Labels labels(faces.size(), none);
    std::uint32_t count = 0;
    cover(faces, least_share * area, labels, count);
    constexpr int rounds = 3;
    for (int round = 0; round < rounds; ++round) labels = grown(faces, labels, count);
    fill(faces, count, labels);
    cover_the_rest(faces, labels, count);
    smooth_borders(faces, count, labels);
    cut_overlaps(faces, mesh, labels, count);
    join(faces, mesh, area, count, labels);
    return layout_of(faces, mesh, labels, count);
}

}  // namespace htvm::internal
