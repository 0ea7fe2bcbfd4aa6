#include "codec/reference/skinning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <queue>
#include <vector>

#include "core/parallel.h"

namespace htvm::internal {

namespace {

struct Projection {
    bool inside = false;
    double axis_distance = 0;
};

// All integers below fit in 53 bits: differences have 26, products 52.
Projection project(LatticePoint v, const BoneCylinder& bone) {
    const LatticePoint u = bone.second - bone.first, d = v - bone.first;
    const double ux = u.x, uy = u.y, uz = u.z, dx = d.x, dy = d.y, dz = d.z;
    const double length2 = ux * ux + uy * uy + uz * uz;
    const double along = ux * dx + uy * dy + uz * dz;
    if (length2 == 0 || along < 0 || along > length2) return {};
    const double cx = uy * dz - uz * dy, cy = uz * dx - ux * dz, cz = ux * dy - uy * dx;
    return {true, std::sqrt((cx * cx + cy * cy + cz * cz) / length2)};
}

}  // namespace

double distance_to_bone(LatticePoint vertex, const BoneCylinder& bone) {
    const auto projection = project(vertex, bone);
    if (projection.inside) return projection.axis_distance - bone.radius;
    const auto to_first = squared_distance(vertex, bone.first), to_second = squared_distance(vertex, bone.second);
    return std::sqrt(static_cast<double>(to_first < to_second ? to_first : to_second));
}

double distance_to_axis(LatticePoint vertex, const BoneCylinder& bone) {
    const auto projection = project(vertex, bone);
    return projection.inside ? projection.axis_distance : -1.0;
}

namespace {

// A sphere around a bone's cylinder. The distance to the bone is at least the distance to the sphere.
struct BoneSphere {
    double x = 0, y = 0, z = 0, radius = 0;

    explicit BoneSphere(const BoneCylinder& bone) {
        constexpr double more = 1;  // lattice units: what roundings may sum up to is far less
        x = (bone.first.x + bone.second.x) / 2.0;
        y = (bone.first.y + bone.second.y) / 2.0;
        z = (bone.first.z + bone.second.z) / 2.0;
        const auto length = static_cast<double>(squared_distance(bone.first, bone.second));
        radius = std::sqrt(length) / 2 + std::max(bone.radius, 0) + more;
    }
    bool is_beyond(double distance, LatticePoint v) const {
        const double dx = v.x - x, dy = v.y - y, dz = v.z - z, reach = radius + distance;
        return reach > 0 && dx * dx + dy * dy + dz * dz > reach * reach;
    }
};

}  // namespace

// Most bones are too far away by far. The neighbouring vertex's bone comes first, as it is likely to be the nearest.
std::vector<BoneIndex> skin(std::span<const LatticePoint> vertices, std::span<const BoneCylinder> bones,
                            Threads threads) {
    const std::vector<BoneSphere> spheres(bones.begin(), bones.end());
    std::vector<BoneIndex> out(vertices.size());
    parallel_for(vertices.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        std::size_t nearest = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const std::size_t first = nearest;
            double best = distance_to_bone(vertices[k], bones[first]);
            for (std::size_t i = 0; i < bones.size(); ++i) {
                if (i == first || spheres[i].is_beyond(best, vertices[k])) continue;
                const double d = distance_to_bone(vertices[k], bones[i]);
                if (d < best || (d == best && i < nearest)) {
                    best = d;
                    nearest = i;
                }
            }
            out[k] = static_cast<BoneIndex>(nearest);
        }
    });
    return out;
}

SubMeshes group_by_bone(std::span<const BoneIndex> bone_of_vertex, std::size_t bones) {
    SubMeshes out;
    out.begin.assign(bones + 1, 0);
    for (const auto bone : bone_of_vertex) ++out.begin[bone + 1u];
    for (std::size_t i = 0; i < bones; ++i) out.begin[i + 1] += out.begin[i];
    out.vertices.resize(bone_of_vertex.size());
    auto next = out.begin;
    for (std::size_t k = 0; k < bone_of_vertex.size(); ++k)
        out.vertices[next[bone_of_vertex[k]]++] = static_cast<std::uint32_t>(k);
    return out;
}

std::vector<BoneCylinder> cylinders(const std::vector<Bone>& bones, std::span<const LatticePoint> joints,
                                    std::span<const std::int32_t> radii) {
    std::vector<BoneCylinder> out;
    for (std::size_t i = 0; i < bones.size(); ++i)
        out.push_back({joints[bones[i].first], joints[bones[i].second], radii[i]});
    return out;
}

namespace {

constexpr std::size_t others_a_vertex = handles_per_vertex - 1;

// The mesh's edges in both directions; those between two triangles appear twice.
struct Neighbours {
    std::vector<std::uint32_t> vertices;
    std::vector<std::size_t> begin;  // vertices + 1 entries
};

Neighbours neighbours_of(std::size_t vertices, std::span<const Triangle> triangles) {
    Neighbours out;
    out.begin.assign(vertices + 1, 0);
    for (const auto& t : triangles)
        for (const auto v : t) out.begin[v + 1] += 2;
    for (std::size_t v = 0; v < vertices; ++v) out.begin[v + 1] += out.begin[v];
    out.vertices.resize(out.begin[vertices]);
    std::vector<std::size_t> next(out.begin.begin(), out.begin.end() - 1);
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            out.vertices[next[t[i]]++] = t[(i + 1) % 3];
            out.vertices[next[t[i]]++] = t[(i + 2) % 3];
        }
    return out;
}

// Distances along edges are in half lattice units, so that half an edge is a whole number.
struct Near {
    std::int32_t distance = 0;
    std::uint16_t handle = 0;
    auto operator<=>(const Near&) const = default;
};

// For each vertex, the nearest other handles within half the width, nearest first.
struct NearHandles {
    std::array<Near, others_a_vertex> near{};
    std::uint8_t count = 0;
};

// Enters a handle if it is one of the nearest, or nearer than known; returns whether it was.
bool enter(NearHandles& list, Near candidate) {
    std::size_t place = 0;
    while (place < list.count && list.near[place].handle != candidate.handle) ++place;
    if (place == list.count) {
        if (list.count < others_a_vertex)
            ++list.count;
        else if (--place; list.near[place] < candidate)
            return false;
    } else if (list.near[place] <= candidate) {
        return false;
    }
    for (; place > 0 && candidate < list.near[place - 1]; --place) list.near[place] = list.near[place - 1];
    list.near[place] = candidate;
    return true;
}

// The length of an edge, clamped to 1 .. `longest` + 1.
std::int32_t edge_length(LatticePoint a, LatticePoint b, std::int32_t longest) {
    const std::int64_t squared = squared_distance(a, b);
    if (squared > std::int64_t{longest} * longest) return longest + 1;
    return std::max(1, static_cast<std::int32_t>(std::sqrt(static_cast<double>(squared))));
}

struct Step {
    std::uint32_t vertex;
    Near near;
};
struct FartherStep {  // the result does not depend on the order of equally far steps
    bool operator()(const Step& a, const Step& b) const { return a.near.distance > b.near.distance; }
};

// The lists so far, and the steps still to be taken.
struct Spreading {
    std::span<const std::uint16_t> own;
    std::span<const LatticePoint> positions;
    std::int32_t width;
    Neighbours neighbours;
    std::vector<NearHandles> lists;
    std::priority_queue<Step, std::vector<Step>, FartherStep> steps;
};

void reach(Spreading& state, std::uint32_t v, std::int64_t distance, std::uint16_t handle) {
    if (distance >= state.width || state.own[v] == handle) return;
    const auto d = static_cast<std::int32_t>(distance);
    if (enter(state.lists[v], {d, handle})) state.steps.push({v, {d, handle}});
}

void cross_borders(Spreading& state) {
    for (std::uint32_t v = 0; v < state.own.size(); ++v)
        for (std::size_t i = state.neighbours.begin[v]; i < state.neighbours.begin[v + 1]; ++i) {
            const auto u = state.neighbours.vertices[i];
            if (state.own[u] == state.own[v]) continue;
            reach(state, u, edge_length(state.positions[v], state.positions[u], state.width), state.own[v]);
        }
}

void pass_on(Spreading& state, std::uint32_t v, Near near) {
    for (std::size_t i = state.neighbours.begin[v]; i < state.neighbours.begin[v + 1]; ++i) {
        const auto u = state.neighbours.vertices[i];
        const std::int64_t length = edge_length(state.positions[v], state.positions[u], state.width);
        reach(state, u, near.distance + 2 * length, near.handle);
    }
}

// Dijkstra's shortest paths from all borders at once. A handle that is not among the nearest of a vertex is not among
// those of any vertex that it would reach through it, so the short lists are still exact.
std::vector<NearHandles> near_handles(Spreading state) {
    cross_borders(state);
    while (!state.steps.empty()) {
        const auto [v, near] = state.steps.top();
        state.steps.pop();
        const auto known = std::span(state.lists[v].near).first(state.lists[v].count);
        if (std::find(known.begin(), known.end(), near) != known.end()) pass_on(state, v, near);
    }
    return std::move(state.lists);
}

// On the border between two handles both have the same weight. Away from it the weight of the other handle falls
// linearly to 0 at half the width.
VertexWeights weights_of(std::uint16_t own, const NearHandles& others, std::int32_t width) {
    struct Entry {
        std::int64_t weight;
        std::uint16_t handle;
    };
    constexpr std::int64_t one = std::int64_t{1} << weight_bits;
    std::array<Entry, handles_per_vertex> entries{};
    std::int64_t sum = others.count > 0 ? std::int64_t{width} + others.near[0].distance : 0;
    for (std::size_t i = 0; i < others.count; ++i) sum += width - others.near[i].distance;
    entries[0] = {one, own};
    for (std::size_t i = 0; i < others.count; ++i) {
        const auto& near = others.near[i];
        entries[i + 1] = {(std::int64_t{width} - near.distance) * one / sum, near.handle};
        entries[0].weight -= entries[i + 1].weight;
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.weight != b.weight ? a.weight > b.weight : a.handle < b.handle;
    });
    VertexWeights out;
    for (std::size_t i = 0; i < handles_per_vertex && entries[i].weight > 0; ++i) {
        out.handle[i] = entries[i].handle;
        out.weight[i] = static_cast<std::uint16_t>(entries[i].weight);
    }
    return out;
}

}  // namespace

HandleWeights smooth_weights(std::span<const std::uint16_t> handle_of_vertex, std::span<const LatticePoint> positions,
                             std::span<const Triangle> triangles, std::int32_t width, Threads threads) {
    static_cast<void>(threads);  // not used: a single pass takes only a few milliseconds
    const auto count = positions.size();
    const auto others = near_handles(
        {handle_of_vertex, positions, width, neighbours_of(count, triangles), std::vector<NearHandles>(count), {}});
    HandleWeights out;
    out.reserve(others.size());
    for (std::size_t v = 0; v < others.size(); ++v) out.push_back(weights_of(handle_of_vertex[v], others[v], width));
    return out;
}

namespace {

std::vector<LatticePoint> sub_mesh_means(const ReferenceMesh& reference, const std::vector<Bone>& bones) {
    std::vector<LatticePoint> means;
    for (std::size_t bone = 0; bone < bones.size(); ++bone) {
        const auto vertices = reference.sub_meshes.of(bone);
        std::int64_t x = 0, y = 0, z = 0;
        for (const auto v : vertices) {
            x += reference.mesh.positions[v].x;
            y += reference.mesh.positions[v].y;
            z += reference.mesh.positions[v].z;
        }
        const auto n = static_cast<std::int64_t>(vertices.size());
        if (n == 0) {
            means.push_back(reference.joints[bones[bone].first]);
        } else {
            means.push_back({static_cast<std::int32_t>(divide_rounded(x, n)),
                             static_cast<std::int32_t>(divide_rounded(y, n)),
                             static_cast<std::int32_t>(divide_rounded(z, n))});
        }
    }
    return means;
}

bool blends(const ReferenceMesh& reference, std::size_t vertex) {
    return !reference.weights.empty() && reference.weights[vertex].weight[1] > 0;
}

}  // namespace

void skin_reference(ReferenceMesh& reference, const std::vector<Bone>& bones, std::span<const std::int32_t> radii,
                    std::int32_t weight_width, Threads threads) {
    const auto& mesh = reference.mesh;
    reference.bone_of_vertex = skin(mesh.positions, cylinders(bones, reference.joints, radii), threads);
    reference.sub_meshes = group_by_bone(reference.bone_of_vertex, bones.size());
    if (weight_width > 0)
        reference.weights =
            smooth_weights(reference.bone_of_vertex, mesh.positions, mesh.triangles, weight_width, threads);
    reference.pivots = sub_mesh_means(reference, bones);
    reference.mapping_prior = make_mapping_prior(mesh.positions, mesh.triangles);
}

ReferenceMesh make_reference(LatticeMesh mesh, const std::vector<Bone>& bones, std::vector<LatticePoint> joints,
                             std::vector<QuantisedRotation> orientations, std::span<const std::int32_t> radii,
                             std::int32_t weight_width, std::uint32_t frame, Threads threads) {
    ReferenceMesh out;
    out.mesh = std::move(mesh);
    out.joints = std::move(joints);
    out.orientations = std::move(orientations);
    out.frame = frame;
    skin_reference(out, bones, radii, weight_width, threads);
    return out;
}

std::vector<LatticePoint> predict_positions(const ReferenceMesh& reference,
                                            std::span<const QuantisedTransform> transforms, Threads threads) {
    const auto moves = point_moves(transforms, reference.pivots);
    const auto rotations = rotation_matrices(transforms);
    std::vector<LatticePoint> out(reference.mesh.positions.size());
    // About 10 ns per vertex: a mesh of ordinary size is done before another thread would be awake.
    parallel_for(out.size(), threads, 1 << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const LatticePoint v = reference.mesh.positions[k];
            const auto bone = reference.bone_of_vertex[k];
            out[k] = blends(reference, k) ? blended_move(v, reference.weights[k], moves)
                                          : move(v, rotations[bone], reference.pivots[bone], transforms[bone].shift);
        }
    });
    return out;
}

std::vector<QuantisedNormal> predict_normals(const ReferenceMesh& reference,
                                             std::span<const QuantisedTransform> transforms) {
    const auto rotation = rotation_matrices(transforms);
    std::vector<QuantisedNormal> out;
    out.reserve(reference.mesh.normals.size());
    for (std::size_t k = 0; k < reference.mesh.normals.size(); ++k) {
        const auto& n = reference.mesh.normals[k];
        const LatticePoint normal{n[0], n[1], n[2]};
        const LatticePoint turned = blends(reference, k) ? blended_turn(normal, reference.weights[k], rotation)
                                                         : rotate(rotation[reference.bone_of_vertex[k]], normal);
        out.push_back({turned.x, turned.y, turned.z});
    }
    return out;
}

}  // namespace htvm::internal
