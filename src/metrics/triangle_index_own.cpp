// In place of triangle_index.cpp where there is no Embree: a tree of boxes around halves of the triangles. It takes
// longer, and gives the same distances.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "metrics/triangle_index.h"

namespace htvm {

using namespace internal;

namespace {

constexpr std::uint32_t most_in_leaf = 4;

struct Bounds {
    std::array<float, 3> low, high;

    Bounds() {
        low.fill(std::numeric_limits<float>::max());
        high.fill(std::numeric_limits<float>::lowest());
    }
    void extend(const Vector3f& p) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
        }
    }
    double squared_distance(const Point3& p) const {
        double sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double apart = std::max({low[axis] - p[axis], p[axis] - high[axis], 0.0});
            sum += apart * apart;
        }
        return sum;
    }
};

// The children of an inner node are the next one and `second`; a leaf has the triangles order[first .. first + count).
struct Node {
    Bounds bounds;
    std::uint32_t first = 0, count = 0;  // count: 0 of inner nodes
    std::uint32_t second = 0;
};

double largest_component(const Point3& p) { return std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}); }

// What is beyond this is farther than `distance` for sure, however distances were rounded.
double squared_reach(double distance, double largest) {
    const double reach = distance * (1 + 1e-9) + largest * 1e-9;
    return reach * reach;
}

}  // namespace

struct TriangleIndex::Impl {
    const Mesh* mesh = nullptr;
    double largest = 0;  // largest absolute coordinate
    std::vector<Node> nodes;
    std::vector<std::uint32_t> order;

    void build(std::uint32_t first, std::uint32_t count, const std::vector<Vector3f>& middles) {
        const auto at = nodes.size();
        nodes.emplace_back();
        Bounds of_middles;
        for (auto i = first; i < first + count; ++i) {
            of_middles.extend(middles[order[i]]);
            for (const auto corner : mesh->triangles[order[i]]) nodes[at].bounds.extend(mesh->positions[corner]);
        }
        if (count <= most_in_leaf) {
            nodes[at].first = first;
            nodes[at].count = count;
            return;
        }
        std::size_t widest = 0;
        const auto extent = [&](std::size_t axis) { return of_middles.high[axis] - of_middles.low[axis]; };
        for (std::size_t axis = 1; axis < 3; ++axis)
            if (extent(axis) > extent(widest)) widest = axis;
        const auto half = count / 2;
        const auto begin = order.begin() + first;
        std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
            return middles[a][widest] != middles[b][widest] ? middles[a][widest] < middles[b][widest] : a < b;
        });
        build(first, half, middles);
        nodes[at].second = static_cast<std::uint32_t>(nodes.size());
        build(first + half, count - half, middles);
    }

    // Calls visit(triangle) for all in boxes within reach(), which may shrink meanwhile; until it returns false.
    template <class Reach, class Visit>
    void search(const Point3& p, const Reach& reach, const Visit& visit) const {
        // Each level of the tree halves the triangles, of which there are at most 2^31.
        std::array<std::uint32_t, 64> waiting;
        std::size_t depth = 0;
        waiting[depth++] = 0;
        while (depth > 0) {
            const auto& node = nodes[waiting[--depth]];
            if (node.bounds.squared_distance(p) > reach()) continue;
            for (auto i = node.first; i < node.first + node.count; ++i)
                if (!visit(order[i])) return;
            if (node.count > 0) continue;
            const auto next = static_cast<std::uint32_t>(&node - nodes.data()) + 1;
            const bool nearer = nodes[next].bounds.squared_distance(p) <= nodes[node.second].bounds.squared_distance(p);
            waiting[depth++] = nearer ? node.second : next;
            waiting[depth++] = nearer ? next : node.second;
        }
    }
};

Result<TriangleIndex> TriangleIndex::build(const Mesh& mesh, Threads) {
    if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "A mesh without triangles has no surface to index.");
    auto impl = std::make_shared<Impl>();
    impl->mesh = &mesh;
    std::vector<Vector3f> middles;
    middles.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        Vector3f middle;
        for (std::size_t axis = 0; axis < 3; ++axis)
            middle[axis] = (mesh.positions[t[0]][axis] + mesh.positions[t[1]][axis] + mesh.positions[t[2]][axis]) / 3;
        middles.push_back(middle);
    }
    impl->order.resize(mesh.triangles.size());
    std::iota(impl->order.begin(), impl->order.end(), 0u);
    impl->build(0, static_cast<std::uint32_t>(impl->order.size()), middles);
    for (const auto& p : mesh.positions) impl->largest = std::max(impl->largest, largest_component(to_point(p)));
    TriangleIndex index;
    index.impl_ = std::move(impl);
    return index;
}

ClosestTriangle TriangleIndex::closest(const Point3& p, std::uint32_t hint) const {
    const double largest = std::max(impl_->largest, largest_component(p));
    ClosestTriangle best{squared_distance_to(*impl_->mesh, hint, p), hint};
    double reach = squared_reach(std::sqrt(best.squared_distance), largest);
    impl_->search(
        p, [&] { return reach; },
        [&](std::uint32_t triangle) {
            const double d = squared_distance_to(*impl_->mesh, triangle, p);
            if (d == best.squared_distance) best.triangle = std::min(best.triangle, triangle);
            if (d < best.squared_distance) {
                best = {d, triangle};
                reach = squared_reach(std::sqrt(d), largest);
            }
            return true;
        });
    return best;
}

void TriangleIndex::visit_near(const Point3& p, double radius, const std::function<bool(std::uint32_t)>& visit) const {
    const double reach = squared_reach(radius, std::max(impl_->largest, largest_component(p)));
    impl_->search(
        p, [&] { return reach; }, visit);
}

}  // namespace htvm
