#include "surface/deformable_mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "surface/open_border.h"

namespace htvm::internal {

namespace {

using Eigen::Vector3d;
using Places = std::vector<std::pair<std::uint16_t, std::uint16_t>>;

// The handles with the largest weights; their weights are scaled to sum to 1.
SampleBlend strongest(std::vector<std::pair<float, std::uint16_t>> parts) {
    std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    parts.resize(std::min(parts.size(), handles_per_vertex));
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

// About `count` vertices in all: the same number from the region of each handle, spread evenly through it.
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

// The sample that is the fewest edges away from each vertex; no_point where none can be reached.
std::vector<std::uint32_t> samples_of_vertices(const DeformableMesh& mesh, const DeformationLevel& level) {
    constexpr auto none = OrientedPoints::no_point;
    std::vector<std::uint32_t> sample_of(mesh.positions.size(), none), reached;
    for (std::uint32_t i = 0; i < level.samples.size(); ++i) {
        sample_of[mesh.samples[level.samples[i]]] = i;
        reached.push_back(mesh.samples[level.samples[i]]);
    }
    for (std::size_t i = 0; i < reached.size(); ++i)
        for (const auto t : mesh.around.of(reached[i]))
            for (const auto v : mesh.triangles[t])
                if (sample_of[v] == none) sample_of[v] = sample_of[reached[i]], reached.push_back(v);
    return sample_of;
}

// Which samples are beside each other: those whose vertices share an edge.
SamplesBeside samples_beside(const DeformableMesh& mesh, const DeformationLevel& level,
                             std::span<const std::uint32_t> sample_of) {
    constexpr auto none = OrientedPoints::no_point;
    std::vector<std::vector<std::uint32_t>> beside(level.samples.size());
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
        if (a == b || a == none || b == none) return;
        auto& list = beside[a];
        if (std::find(list.begin(), list.end(), b) == list.end()) list.push_back(b), beside[b].push_back(a);
    };
    for (const auto& t : mesh.triangles) {
        const auto a = sample_of[t[0]], b = sample_of[t[1]], c = sample_of[t[2]];
        join(a, b), join(b, c), join(c, a);
    }
    SamplesBeside out;
    out.first.push_back(0);
    for (const auto& list : beside) {
        out.samples.insert(out.samples.end(), list.begin(), list.end());
        out.first.push_back(static_cast<std::uint32_t>(out.samples.size()));
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
        // Handles in ascending order, so that every pair in a blend lies above the diagonal.
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

// Forms groups of handles about this far apart along their pairs, and how each handle follows the groups.
void group_handles(DeformableMesh& mesh, LatticeUnits apart) {
    const double spacing = apart.value;
    const PlaceGraph graph = graph_of_handles(mesh);
    std::vector<bool> covered(mesh.handles.size(), false);
    std::vector<std::vector<std::pair<float, std::uint16_t>>> parts(mesh.handles.size());
    for (std::uint32_t h = 0; h < mesh.handles.size(); ++h) {
        if (covered[h]) continue;
        const auto group = static_cast<std::uint16_t>(mesh.coarse.centre.size());
        mesh.coarse.centre.push_back(h);
        const auto distance = distances_from(graph, h, 2 * spacing);
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

// The colours around a vertex, and how well they fit a slope; zero slope and trust if they do not. normal: unit length.
SampleTexture texture_at(const DeformableMesh& mesh, std::span<const Colour> colours, std::uint32_t vertex,
                         const Vector3d& normal) {
    // A slope explains a third of random colours at six neighbours; trust begins where it explains two thirds.
    constexpr double chance = 3, least_moment = 0.02;
    const auto place_of = [&](std::uint32_t v) {
        return Vector3d(mesh.positions[v][0], mesh.positions[v][1], mesh.positions[v][2]);
    };
    const auto colour_of = [&](std::uint32_t v) { return Vector3d(colours[v][0], colours[v][1], colours[v][2]); };
    SampleTexture out;
    out.colour = colour_of(vertex).cast<float>();
    const auto visit_neighbours = [&](auto&& use) {
        for (const auto t : mesh.around.of(vertex))
            for (const auto other : mesh.triangles[t]) {
                if (other == vertex) continue;
                const Vector3d apart = place_of(other) - place_of(vertex);
                use(Vector3d(apart - normal.dot(apart) * normal), Vector3d(colour_of(other) - colour_of(vertex)));
            }
    };
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero(), products = Eigen::Matrix3d::Zero();
    double size = 0, changes = 0;
    std::size_t count = 0;
    visit_neighbours([&](const Vector3d& apart, const Vector3d& change) {
        moments += apart * apart.transpose();
        products += change * apart.transpose();
        size += apart.squaredNorm();
        changes += change.squaredNorm();
        ++count;
    });
    if (count < 4 || !(size > 0) || !(changes > 0)) return out;
    // The plane's normal, and a direction in which there are hardly any neighbours, get no slope.
    moments += size * normal * normal.transpose() + least_moment * size * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d slope = products * moments.inverse();
    double rest = 0;
    visit_neighbours(
        [&](const Vector3d& apart, const Vector3d& change) { rest += (change - slope * apart).squaredNorm(); });
    const double trust = 1 - chance * rest / changes;
    if (!(trust > 0)) return out;
    out.trust = static_cast<float>(trust);
    out.slope = slope.cast<float>();
    out.unevenness = static_cast<float>(rest / (3 * static_cast<double>(count)));
    return out;
}

// None if no slope can be trusted: then colours tell nothing of where the surface is.
std::vector<SampleTexture> textures_of_samples(const DeformableMesh& mesh, std::span<const Colour> colours) {
    std::vector<SampleTexture> out;
    if (colours.empty()) return out;
    for (std::size_t i = 0; i < mesh.samples.size(); ++i) {
        const auto& n = mesh.sample_normals[i];
        out.push_back(texture_at(mesh, colours, mesh.samples[i], {n[0], n[1], n[2]}));
    }
    if (std::none_of(out.begin(), out.end(), [](const auto& texture) { return texture.trust > 0; })) out.clear();
    return out;
}

}  // namespace

PlaceGraph graph_of_handles(const DeformableMesh& mesh) {
    PlaceGraph out{mesh.handles, std::vector<std::vector<std::uint32_t>>(mesh.handles.size())};
    for (const auto& pair : mesh.fine.pairs) {
        out.beside[pair.first].push_back(pair.second);
        out.beside[pair.second].push_back(pair.first);
    }
    return out;
}

SampleBlend blend_of(const VertexWeights& weights) {
    SampleBlend out;
    for (std::size_t k = 0; k < handles_per_vertex; ++k) {
        if (weights.weight[k] == 0) continue;
        out.handle[out.count] = weights.handle[k];
        out.weight[out.count++] = static_cast<float>(weights.weight[k]) / static_cast<float>(1 << weight_bits);
    }
    return out;
}

DeformableMesh make_deformable(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                               HandleWeights weights, std::span<const Vector3d> handles, std::vector<HandlePair> pairs,
                               const DeformationOptions& options, std::span<const Colour> colours) {
    DeformableMesh mesh;
    mesh.positions.assign(positions.begin(), positions.end());
    mesh.triangles.assign(triangles.begin(), triangles.end());
    mesh.around = triangles_around(positions.size(), triangles);
    mesh.weights = std::move(weights);
    mesh.blends.reserve(mesh.weights.size());
    for (const auto& vertex : mesh.weights) mesh.blends.push_back(blend_of(vertex));
    mesh.handles.assign(handles.begin(), handles.end());
    if (handles.empty()) return mesh;
    mesh.samples = spread_samples(mesh.weights, handles.size(), options.samples);
    mesh.sample_gap = point_gap(positions, triangles, mesh.samples.size());
    const auto normals = points_of(vertex_normals(positions, triangles));
    mesh.sample_fans.resize(mesh.samples.size());
    for (std::size_t i = 0; i < mesh.samples.size(); ++i)
        fan_searches().set_fan(mesh.positions, mesh.triangles, mesh.around, mesh.samples[i], mesh.sample_fans[i]);
    for (const std::uint32_t v : mesh.samples) {
        mesh.fine.samples.push_back(static_cast<std::uint32_t>(mesh.fine.samples.size()));
        mesh.sample_normals.push_back(normals[v]);
        mesh.fine.blends.push_back(mesh.blends[v]);
    }
    if (options.open) {
        const auto from_border = edges_from_border(mesh.positions, mesh.triangles);
        for (const auto v : mesh.samples) mesh.sample_from_border.push_back(from_border[v]);
    }
    for (std::uint32_t i = 0; i < mesh.samples.size(); i += 2) mesh.coarse.samples.push_back(i);
    parallel_invoke(
        options.threads.at_most(2),
        [&] {
            mesh.sample_of = samples_of_vertices(mesh, mesh.fine);
            mesh.fine.beside = samples_beside(mesh, mesh.fine, mesh.sample_of);
            mesh.coarse.beside = samples_beside(mesh, mesh.coarse, samples_of_vertices(mesh, mesh.coarse));
        },
        [&] { mesh.sample_textures = textures_of_samples(mesh, colours); });
    for (std::uint32_t h = 0; h < handles.size(); ++h) mesh.fine.centre.push_back(h);
    mesh.fine.pairs = std::move(pairs);
    group_handles(mesh, options.scale.on_lattice(options.coarse_spacing));
    for (const auto i : mesh.coarse.samples)
        mesh.coarse.blends.push_back(over_groups(mesh.fine.blends[i], mesh.groups));
    find_blocks(mesh.fine.blends, mesh.fine.pairs, handles.size(), mesh.fine.pattern);
    find_blocks(mesh.coarse.blends, mesh.coarse.pairs, mesh.coarse.centre.size(), mesh.coarse.pattern);
    return mesh;
}

}  // namespace htvm::internal
