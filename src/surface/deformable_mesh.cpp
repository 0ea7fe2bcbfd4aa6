#include <algorithm>
#include <functional>
#include <limits>
#include <queue>

#include "surface/deformation.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;
using Places = std::vector<std::pair<std::uint16_t, std::uint16_t>>;

// The strongest few of (weight, handle), their weights made to sum to 1.
SampleBlend strongest(std::vector<std::pair<float, std::uint16_t>> parts) {
    std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    parts.resize(std::min(parts.size(), handles_a_vertex));
    float sum = 0;
    for (const auto& part : parts) sum += part.first;
    SampleBlend out;
    for (const auto& [weight, handle] : parts) {
        if (weight < 0.02f * sum) continue;
        out.handle[out.count] = handle;
        out.weight[out.count++] = weight;
    }
    float kept = 0;
    for (std::size_t k = 0; k < out.count; ++k) kept += out.weight[k];
    for (std::size_t k = 0; k < out.count; ++k) out.weight[k] /= kept;
    return out;
}

// As many vertices of each handle's region, evenly through them, as make up about `count` in all.
std::vector<std::uint32_t> spread_samples(const HandleWeights& weights, std::size_t handles, std::size_t count) {
    std::vector<std::vector<std::uint32_t>> region(handles);
    for (std::uint32_t v = 0; v < weights.size(); ++v)
        if (weights[v].weight[0] > 0) region[weights[v].handle[0]].push_back(v);
    const std::size_t quota = std::max<std::size_t>(count / std::max<std::size_t>(handles, 1), 4);
    std::vector<std::uint32_t> out;
    for (const auto& vertices : region) {
        const std::size_t taken = std::min(quota, vertices.size());
        for (std::size_t i = 0; i < taken; ++i) out.push_back(vertices[(2 * i + 1) * vertices.size() / (2 * taken)]);
    }
    return out;
}

void find_blocks(std::vector<SampleBlend>& blends, const std::vector<HandlePair>& pairs, std::size_t handles,
                 BlockPattern& pattern) {
    Places places;
    for (const auto& pair : pairs) places.emplace_back(pair.first, pair.second);
    for (const auto& blend : blends)
        for (std::size_t a = 0; a < blend.count; ++a)
            for (std::size_t b = a + 1; b < blend.count; ++b) places.emplace_back(blend.handle[a], blend.handle[b]);
    pattern = make_pattern(handles, std::move(places));
    for (auto& blend : blends) {
        // Ascending handles, so that every pair of a blend is above the diagonal.
        for (std::size_t a = 1; a < blend.count; ++a)
            for (std::size_t b = a; b > 0 && blend.handle[b] < blend.handle[b - 1]; --b) {
                std::swap(blend.handle[b], blend.handle[b - 1]);
                std::swap(blend.weight[b], blend.weight[b - 1]);
            }
        std::size_t slot = 0;
        for (std::size_t a = 0; a < blend.count; ++a)
            for (std::size_t b = a + 1; b < blend.count; ++b)
                blend.block[slot++] = pattern.find(blend.handle[a], blend.handle[b]);
    }
}

// Distances along the graph of pairs from one handle, no further than reach.
std::vector<double> reach_over_pairs(const std::vector<Vector3d>& handles,
                                     const std::vector<std::vector<std::uint16_t>>& tied, std::uint32_t start,
                                     double reach) {
    std::vector<double> distance(handles.size(), std::numeric_limits<double>::max());
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> heap;
    distance[start] = 0;
    heap.emplace(0, start);
    while (!heap.empty()) {
        const auto [d, h] = heap.top();
        heap.pop();
        if (d > distance[h]) continue;
        for (const std::uint16_t other : tied[h]) {
            const double there = d + (handles[other] - handles[h]).norm();
            if (there > reach || there >= distance[other]) continue;
            distance[other] = there;
            heap.emplace(there, other);
        }
    }
    return distance;
}

// Groups of handles about `spacing` apart along their pairs, and how each handle follows the groups.
void group_handles(DeformableMesh& mesh, double spacing) {
    std::vector<std::vector<std::uint16_t>> tied(mesh.handles.size());
    for (const auto& pair : mesh.fine.pairs) {
        tied[pair.first].push_back(pair.second);
        tied[pair.second].push_back(pair.first);
    }
    std::vector<bool> covered(mesh.handles.size(), false);
    std::vector<std::vector<std::pair<float, std::uint16_t>>> parts(mesh.handles.size());
    for (std::uint32_t h = 0; h < mesh.handles.size(); ++h) {
        if (covered[h]) continue;
        const auto group = static_cast<std::uint16_t>(mesh.coarse.centre.size());
        mesh.coarse.centre.push_back(h);
        const auto distance = reach_over_pairs(mesh.handles, tied, h, 2 * spacing);
        for (std::size_t other = 0; other < distance.size(); ++other) {
            if (distance[other] > 2 * spacing) continue;
            covered[other] = covered[other] || distance[other] <= spacing;
            const double nearness = 1 - distance[other] / (2.001 * spacing);
            parts[other].emplace_back(static_cast<float>(nearness * nearness), group);
        }
    }
    for (auto& part : parts) mesh.groups.push_back(strongest(std::move(part)));

    std::vector<std::pair<std::uint16_t, std::uint16_t>> touching;
    auto main_group = [&](std::size_t h) { return mesh.groups[h].handle[0]; };
    for (const auto& pair : mesh.fine.pairs) {
        const std::uint16_t a = main_group(pair.first), b = main_group(pair.second);
        if (a != b) touching.emplace_back(std::min(a, b), std::max(a, b));
    }
    for (const auto& [first, second] : make_pattern(mesh.coarse.centre.size(), touching).place)
        mesh.coarse.pairs.push_back({first, second});
}

// A sample follows the groups that its handles follow.
SampleBlend over_groups(const SampleBlend& fine, const std::vector<SampleBlend>& groups) {
    std::vector<std::pair<float, std::uint16_t>> parts;
    for (std::size_t k = 0; k < fine.count; ++k) {
        const auto& group = groups[fine.handle[k]];
        for (std::size_t g = 0; g < group.count; ++g) {
            auto it =
                std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.second == group.handle[g]; });
            if (it == parts.end()) it = parts.insert(parts.end(), {0.0f, group.handle[g]});
            it->first += fine.weight[k] * group.weight[g];
        }
    }
    return strongest(std::move(parts));
}

}  // namespace

SampleBlend blend_of(const VertexWeights& weights) {
    SampleBlend out;
    for (std::size_t k = 0; k < handles_a_vertex; ++k) {
        if (weights.weight[k] == 0) continue;
        out.handle[out.count] = weights.handle[k];
        out.weight[out.count++] = static_cast<float>(weights.weight[k]) / static_cast<float>(1 << weight_bits);
    }
    return out;
}

DeformableMesh make_deformable(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                               HandleWeights weights, std::span<const Vector3d> handles, std::vector<HandlePair> pairs,
                               const DeformationOptions& options) {
    DeformableMesh mesh;
    mesh.positions.assign(positions.begin(), positions.end());
    mesh.triangles.assign(triangles.begin(), triangles.end());
    mesh.weights = std::move(weights);
    mesh.handles.assign(handles.begin(), handles.end());
    if (handles.empty()) return mesh;
    mesh.samples = spread_samples(mesh.weights, handles.size(), options.samples);
    mesh.sample_gap = point_gap(positions, triangles, mesh.samples.size());
    const auto normals = vertex_normals(positions, triangles, options.threads);
    for (const std::uint32_t v : mesh.samples) {
        mesh.fine.samples.push_back(static_cast<std::uint32_t>(mesh.fine.samples.size()));
        mesh.sample_normals.push_back(normals[v]);
        mesh.fine.blends.push_back(blend_of(mesh.weights[v]));
    }
    for (std::uint32_t h = 0; h < handles.size(); ++h) mesh.fine.centre.push_back(h);
    mesh.fine.pairs = std::move(pairs);
    group_handles(mesh, options.coarse_spacing * options.millimetre);
    for (std::uint32_t i = 0; i < mesh.samples.size(); i += 2) {
        mesh.coarse.samples.push_back(i);
        mesh.coarse.blends.push_back(over_groups(mesh.fine.blends[i], mesh.groups));
    }
    find_blocks(mesh.fine.blends, mesh.fine.pairs, handles.size(), mesh.fine.pattern);
    find_blocks(mesh.coarse.blends, mesh.coarse.pairs, mesh.coarse.centre.size(), mesh.coarse.pattern);
    return mesh;
}

}  // namespace htvm::internal
