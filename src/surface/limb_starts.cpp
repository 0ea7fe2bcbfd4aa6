#include "surface/limb_starts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/disjoint_sets.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

// Mean distance of each place from places spread over the graph, among those that can be reached.
std::vector<double> mean_distances(const PlaceGraph& graph) {
    constexpr std::size_t most_sources = 48;
    const std::size_t count = graph.places.size(), sources = std::min(count, most_sources);
    std::vector<double> sum(count, 0);
    std::vector<std::size_t> reached(count, 0);
    for (std::size_t i = 0; i < sources; ++i) {
        const auto distance = distances_from(graph, static_cast<std::uint32_t>(i * count / sources));
        for (std::size_t place = 0; place < count; ++place)
            if (distance[place] < unreachable) sum[place] += distance[place], ++reached[place];
    }
    for (std::size_t place = 0; place < count; ++place)
        if (reached[place] > 0) sum[place] /= static_cast<double>(reached[place]);
    return sum;
}

std::vector<std::uint32_t> extremities_of(const PlaceGraph& graph, const std::vector<double>& mean, double reach) {
    constexpr double farther = 7.0 / 6;
    std::vector<std::uint32_t> order;
    for (std::uint32_t place = 0; place < mean.size(); ++place)
        if (mean[place] > reach / 2) order.push_back(place);
    std::sort(order.begin(), order.end(),
              [&](auto a, auto b) { return mean[a] != mean[b] ? mean[a] > mean[b] : a < b; });
    std::vector<bool> covered(mean.size(), false);
    std::vector<std::uint32_t> out;
    for (const auto place : order) {
        if (covered[place]) continue;
        const auto distance = distances_from(graph, place);
        bool farthest = true;
        double least = mean[place];
        for (std::uint32_t other = 0; other < distance.size(); ++other) {
            if (distance[other] == unreachable) continue;
            least = std::min(least, mean[other]);
            if (distance[other] > reach) continue;
            covered[other] = true;
            if (mean[other] > mean[place]) farthest = false;
        }
        if (farthest && mean[place] >= farther * least) out.push_back(place);
    }
    std::sort(out.begin(), out.end());
    return out;
}

}  // namespace

PlaceGraph graph_of_surface(const SurfaceIndex& surface, LatticeUnits side) {
    using Cube = std::array<std::int32_t, 3>;
    const auto cube_of = [&](std::uint32_t v) {
        Cube cube{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            cube[axis] =
                static_cast<std::int32_t>(std::floor(static_cast<double>(surface.positions[v][axis]) / side.value));
        return cube;
    };
    std::vector<Cube> cube(surface.positions.size());
    for (std::uint32_t v = 0; v < cube.size(); ++v) cube[v] = cube_of(v);
    DisjointSets parts(cube.size());
    for (const auto& t : surface.triangles)
        for (std::size_t i = 0; i < 3; ++i)
            if (cube[t[i]] == cube[t[(i + 1) % 3]]) parts.join(t[i], t[(i + 1) % 3]);
    constexpr auto none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> place(cube.size(), none);
    PlaceGraph out;
    std::vector<double> count;
    for (std::uint32_t v = 0; v < cube.size(); ++v) {
        auto& of_part = place[parts.of(v)];  // whose name is its first vertex
        if (of_part == none) {
            of_part = static_cast<std::uint32_t>(out.places.size());
            out.places.emplace_back(Vector3d::Zero());
            count.push_back(0);
        }
        place[v] = of_part;
        const auto& p = surface.positions[v];
        out.places[of_part] += Vector3d(p[0], p[1], p[2]);
        count[of_part] += 1;
    }
    for (std::size_t i = 0; i < count.size(); ++i) out.places[i] /= count[i];
    out.beside.resize(out.places.size());
    for (const auto& t : surface.triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            const auto a = place[t[i]], b = place[t[(i + 1) % 3]];
            if (a != b) out.beside[a].push_back(b), out.beside[b].push_back(a);
        }
    for (auto& list : out.beside) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return out;
}

std::vector<std::uint32_t> extremities(const PlaceGraph& graph, LatticeUnits reach) {
    return extremities_of(graph, mean_distances(graph), reach.value);
}

std::vector<Limb> limbs_of(const DeformableMesh& mesh, LatticeUnits reach) {
    constexpr double limb_of_way = 0.7;  // of the way from an extremity to what lies in the middle of the body
    const auto graph = graph_of_handles(mesh);
    const auto mean = mean_distances(graph);
    const auto ends = extremities_of(graph, mean, reach.value);
    std::vector<std::vector<double>> distance;
    for (const auto end : ends) distance.push_back(distances_from(graph, end));
    std::vector<Limb> out;
    for (std::size_t i = 0; i < ends.size(); ++i) {
        double least = unreachable, to_middle = 0;
        for (std::size_t h = 0; h < mean.size(); ++h)
            if (distance[i][h] < unreachable && mean[h] < least) least = mean[h], to_middle = distance[i][h];
        std::vector<std::pair<double, std::uint16_t>> chain;
        for (std::size_t h = 0; h < mean.size(); ++h) {
            const bool nearer = std::all_of(distance.begin(), distance.end(),
                                            [&](const auto& other) { return distance[i][h] <= other[h]; });
            if (nearer && distance[i][h] <= limb_of_way * to_middle)
                chain.emplace_back(distance[i][h], static_cast<std::uint16_t>(h));
        }
        std::sort(chain.begin(), chain.end());
        if (chain.size() < 3) continue;
        auto& limb = out.emplace_back();
        for (const auto& [from_end, handle] : chain) {
            limb.handles.push_back(handle);
            limb.from_root.push_back(1 - from_end / chain.back().first);
        }
    }
    return out;
}

namespace {

// Whether the reference's samples at the end of each limb lie on the target: then none is lost.
bool all_lie_on(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> motions,
                const std::vector<Limb>& limbs, const LimbReach& options) {
    constexpr AdultMillimetres on(15);  // mean distance
    const double reach = options.scale.on_lattice(options.matched / 2).value, near = options.scale.on_lattice(on).value;
    std::vector<double> sum(mesh.handles.size(), 0);
    std::vector<std::size_t> count(mesh.handles.size(), 0);
    std::vector<bool> ends(mesh.handles.size(), false);
    for (const auto& limb : limbs) ends[limb.handles.front()] = true;
    for (std::size_t i = 0; i < mesh.samples.size(); ++i) {
        const auto& blend = mesh.blends[mesh.samples[i]];
        const auto handle = blend.handle[0];
        if (blend.count == 0 || !ends[handle]) continue;
        const auto& p = mesh.positions[mesh.samples[i]];
        const auto& n = mesh.sample_normals[i];
        const Vector3d point = motions[handle](Vector3d(p[0], p[1], p[2]));
        const Vector3d normal = motions[handle].rotation * Vector3d(n[0], n[1], n[2]);
        const auto found = target.nearest_facing(
            to_floats({point.x(), point.y(), point.z()}), to_floats({normal.x(), normal.y(), normal.z()}),
            {.reach = static_cast<float>(reach), .agreement = 0.2F}, OrientedPoints::no_point);
        sum[handle] += found.found ? std::sqrt(static_cast<double>(found.squared_distance)) : reach;
        ++count[handle];
    }
    return std::all_of(limbs.begin(), limbs.end(), [&](const Limb& limb) {
        const auto tip = limb.handles.front();
        return sum[tip] < near * static_cast<double>(count[tip]);
    });
}

}  // namespace

std::vector<RigidMotion> reached_for_extremities(const DeformableMesh& mesh, const SurfaceIndex& target,
                                                 std::span<const RigidMotion> motions,
                                                 std::span<const RigidMotion> last, const LimbReach& options) {
    constexpr double bend = 0.25;  // of the limb, from its root on, in which it turns
    const auto limbs = limbs_of(mesh, options.scale.on_lattice(options.apart));
    if (limbs.empty() || all_lie_on(mesh, target, motions, limbs, options)) return {};
    const auto graph = graph_of_surface(target, options.scale.on_lattice(options.cell));
    std::vector<Vector3d> free;
    for (const auto place : extremities(graph, options.scale.on_lattice(options.apart)))
        free.push_back(graph.places[place]);
    // Those that a limb ends near are taken.
    std::vector<bool> lost(limbs.size(), true);
    for (std::size_t i = 0; i < limbs.size(); ++i) {
        const auto tip = limbs[i].handles.front();
        const Vector3d end = motions[tip](mesh.handles[tip]);
        const auto near = std::find_if(free.begin(), free.end(), [&](const Vector3d& place) {
            return LatticeUnits((place - end).norm()) < options.scale.on_lattice(options.matched);
        });
        if (near == free.end()) continue;
        lost[i] = false;
        free.erase(near);
    }
    std::vector<RigidMotion> out;
    for (std::size_t i = 0; i < limbs.size(); ++i) {
        if (!lost[i] || free.empty()) continue;
        const auto tip = limbs[i].handles.front(), root = limbs[i].handles.back();
        const auto was = [&](std::uint16_t h) { return last.empty() ? RigidMotion{} : last[h]; };
        // How the root has moved since `last`.
        const RigidMotion carried = motions[root] * was(root).inverse();
        const Vector3d from = motions[root](mesh.handles[root]);
        const Vector3d end = carried(was(tip)(mesh.handles[tip]));
        const auto nearest = std::min_element(free.begin(), free.end(), [&](const Vector3d& a, const Vector3d& b) {
            return (a - end).squaredNorm() < (b - end).squaredNorm();
        });
        const Vector3d to = *nearest;
        if (LatticeUnits((to - end).norm()) > options.scale.on_lattice(options.farthest)) continue;
        double length = 0;  // of the limb when it is straight, at least
        for (const auto h : limbs[i].handles) length = std::max(length, (mesh.handles[h] - mesh.handles[root]).norm());
        if ((to - from).norm() > options.longer * length || !((to - from).norm() > 0)) continue;
        free.erase(nearest);
        if (out.empty()) out.assign(motions.begin(), motions.end());
        const Eigen::AngleAxisd whole(Eigen::Quaterniond::FromTwoVectors(end - from, to - from));
        const Vector3d rest = to - (from + whole * (end - from));
        for (std::size_t k = 0; k < limbs[i].handles.size(); ++k) {
            const auto h = limbs[i].handles[k];
            const double way = limbs[i].from_root[k];
            const Eigen::Matrix3d turn =
                Eigen::AngleAxisd(whole.angle() * std::min(1.0, way / bend), whole.axis()).toRotationMatrix();
            const RigidMotion here = was(h);
            out[h].rotation = turn * carried.rotation * here.rotation;
            out[h].shift = turn * (carried(here.shift) - from) + from + way * rest;
        }
    }
    return out;
}

}  // namespace htvm::internal
