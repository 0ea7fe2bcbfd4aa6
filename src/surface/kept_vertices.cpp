#include "surface/kept_vertices.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "core/parallel.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

Vector3d vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }

// The vertex beside each sample of the reference as it was moved; OrientedPoints::no_point where none is near.
std::vector<std::uint32_t> vertices_beside(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                           const KeptVertices& vertices, const KeptVerticesOptions& options) {
    const auto moved = deform(mesh, last, options.threads);
    const auto normals = points_of(vertex_normals(std::span<const Point3f>(moved), mesh.triangles));
    const auto reach = static_cast<float>(options.scale.on_lattice(options.reach).value);
    const OrientedPoints near(vertices.before, points_of(vertex_normals(vertices.before, vertices.triangles)),
                              std::max(1.0F, reach / 8));
    std::vector<std::uint32_t> out(mesh.samples.size(), OrientedPoints::no_point);
    parallel_for(out.size(), options.threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto v = mesh.samples[i];
            const auto found = near.nearest(moved[v], normals[v], reach, options.agreement);
            if (found.found && vertices.again[found.index] != OrientedPoints::no_point) out[i] = found.index;
        }
    });
    return out;
}

RigidMotion step_of(const KeptVertices& vertices, std::span<const std::uint32_t> which) {
    std::vector<Vector3d> from, to;
    for (const auto v : which) {
        from.push_back(vector_of(vertices.before[v]));
        to.push_back(vector_of(vertices.now[vertices.again[v]]));
    }
    return align(from, to);
}

// Any number for any number, such that sums of them tell what was summed (finaliser of splitmix64).
std::uint64_t scattered(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31);
}

// Which vertex alone has a number: a table in which one is looked for from the place on that its last bits say, since
// numbers are scattered.
class SingledOut {
public:
    explicit SingledOut(std::span<const std::uint64_t> around) : entries_(2 * std::bit_ceil(around.size() + 1)) {
        for (std::uint32_t v = 0; v < around.size(); ++v) {
            auto& entry = entries_[place_of(around[v])];
            entry = {around[v], entry.is == nobody ? v : several};
        }
    }
    // OrientedPoints::no_point if none has it, or several have.
    std::uint32_t vertex(std::uint64_t number) const {
        const auto is = entries_[place_of(number)].is;
        return is == nobody || is == several ? OrientedPoints::no_point : is;
    }

private:
    static constexpr std::uint32_t nobody = ~0U, several = ~0U - 1;
    struct Entry {
        std::uint64_t number = 0;
        std::uint32_t is = nobody;
    };

    std::size_t place_of(std::uint64_t number) const {
        const std::size_t last = entries_.size() - 1;
        std::size_t place = static_cast<std::size_t>(number) & last;
        while (entries_[place].is != nobody && entries_[place].number != number) place = (place + 1) & last;
        return place;
    }

    std::vector<Entry> entries_;
};

}  // namespace

std::vector<std::uint64_t> connectivity_around(std::size_t vertices, std::span<const Triangle> triangles) {
    constexpr int edges_away = 2;
    std::vector<std::uint64_t> out(vertices, 1), of_neighbours(vertices), known(vertices);
    for (const auto& t : triangles)
        for (const auto v : t) ++out[v];
    for (int ring = 0; ring < edges_away; ++ring) {
        std::transform(out.begin(), out.end(), known.begin(), scattered);
        std::fill(of_neighbours.begin(), of_neighbours.end(), 0);
        for (const auto& t : triangles)
            for (std::size_t i = 0; i < 3; ++i) of_neighbours[t[i]] += known[t[(i + 1) % 3]];
        for (std::size_t v = 0; v < vertices; ++v) out[v] = scattered(3 * out[v] + of_neighbours[v]);
    }
    return out;
}

std::vector<std::uint32_t> vertices_again(std::span<const std::uint64_t> before, std::span<const std::uint64_t> now) {
    std::vector<std::uint32_t> out(before.size(), OrientedPoints::no_point);
    if (std::equal(before.begin(), before.end(), now.begin(), now.end())) {
        std::iota(out.begin(), out.end(), 0U);
        return out;
    }
    const SingledOut of_before(before), of_now(now);
    for (std::uint32_t v = 0; v < before.size(); ++v)
        if (of_before.vertex(before[v]) == v) out[v] = of_now.vertex(before[v]);
    return out;
}

std::vector<RigidMotion> carried_by_vertices(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                             const KeptVertices& vertices, const KeptVerticesOptions& options) {
    constexpr float least_weight = 0.2F;  // of a handle at a sample that says something about it
    const auto beside = vertices_beside(mesh, last, vertices, options);
    std::vector<std::vector<std::uint32_t>> of_handle(mesh.handles.size());
    std::vector<std::uint32_t> all;
    for (std::size_t i = 0; i < beside.size(); ++i) {
        if (beside[i] == OrientedPoints::no_point) continue;
        all.push_back(beside[i]);
        const auto& blend = mesh.blends[mesh.samples[i]];
        for (std::size_t k = 0; k < blend.count; ++k)
            if (blend.weight[k] >= least_weight) of_handle[blend.handle[k]].push_back(beside[i]);
    }
    if (all.empty()) return {};
    const RigidMotion of_all = step_of(vertices, all);
    std::vector<RigidMotion> out(mesh.handles.size());
    parallel_for(out.size(), options.threads, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t h = begin; h < end; ++h) {
            const RigidMotion step = of_handle[h].size() < options.fewest ? of_all : step_of(vertices, of_handle[h]);
            out[h] = last.empty() ? step : step * last[h];
        }
    });
    return out;
}

}  // namespace htvm::internal
