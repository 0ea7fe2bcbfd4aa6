#include "codec/bones/nearest_order.h"

#include <algorithm>
#include <array>
#include <limits>

namespace htvm::internal {
namespace {

constexpr std::size_t leaf_size = 16;
constexpr std::size_t most_nearest = 64;

std::int32_t coordinate(const LatticePoint& p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

std::int64_t beyond(std::int32_t low, std::int32_t high, std::int32_t c) {
    return std::max<std::int64_t>({0, std::int64_t{low} - c, std::int64_t{c} - high});
}

}  // namespace

// The best points found so far, ascending by (distance, index).
struct NearestOrder::Search {
    LatticePoint centre;
    std::uint32_t centre_index = 0;
    std::size_t wanted = 0, found = 0;
    // A point must be nearer than this to enter.
    std::int64_t worst_distance = std::numeric_limits<std::int64_t>::max();
    std::uint32_t worst_index = 0;
    std::array<std::int64_t, most_nearest> distances;
    std::uint32_t* indices = nullptr;

    bool enters(std::int64_t distance, std::uint32_t index) const {
        return distance < worst_distance || (distance == worst_distance && index < worst_index);
    }
    void insert(std::int64_t distance, std::uint32_t index) {
        std::size_t at = found < wanted ? found++ : wanted - 1;
        for (; at > 0; --at) {
            if (distances[at - 1] < distance || (distances[at - 1] == distance && indices[at - 1] < index)) break;
            distances[at] = distances[at - 1];
            indices[at] = indices[at - 1];
        }
        distances[at] = distance;
        indices[at] = index;
        if (found == wanted) {
            worst_distance = distances[wanted - 1];
            worst_index = indices[wanted - 1];
        }
    }
    std::int64_t distance_to_box(const Node& node) const {
        const std::int64_t dx = beyond(node.low.x, node.high.x, centre.x);
        const std::int64_t dy = beyond(node.low.y, node.high.y, centre.y);
        const std::int64_t dz = beyond(node.low.z, node.high.z, centre.z);
        return dx * dx + dy * dy + dz * dz;
    }
};

NearestOrder::NearestOrder(std::span<const LatticePoint> points) : entries_(points.size()), leaf_of_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) entries_[i] = {points[i], static_cast<std::uint32_t>(i)};
    while ((points.size() >> depth_) > leaf_size) ++depth_;
    const std::size_t leaves = std::size_t{1} << depth_;
    split(0, leaves);
    for (std::size_t leaf = 0; leaf < leaves; ++leaf)
        for (std::size_t i = leaf_begin(leaf); i < leaf_begin(leaf + 1); ++i)
            leaf_of_[entries_[i].index] = static_cast<std::uint32_t>(leaf);
    bound_nodes();
}

// Partitions the entries of a range of leaves into two halves, along the longest side of their box.
void NearestOrder::split(std::size_t begin_leaf, std::size_t end_leaf) {
    if (end_leaf - begin_leaf < 2) return;
    const std::size_t middle_leaf = (begin_leaf + end_leaf) / 2;
    const auto at = [&](std::size_t leaf) { return entries_.begin() + static_cast<std::ptrdiff_t>(leaf_begin(leaf)); };
    const auto begin = at(begin_leaf), end = at(end_leaf);
    LatticePoint low = begin->point, high = low;
    for (auto entry = begin; entry != end; ++entry) {
        const LatticePoint p = entry->point;
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const LatticePoint size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    if (coordinate(size, axis) > 0)
        std::nth_element(begin, at(middle_leaf), end, [axis](const Entry& a, const Entry& b) {
            return coordinate(a.point, axis) < coordinate(b.point, axis);
        });
    split(begin_leaf, middle_leaf);
    split(middle_leaf, end_leaf);
}

void NearestOrder::bound_nodes() {
    const std::size_t leaves = std::size_t{1} << depth_;
    constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
    nodes_.assign(2 * leaves, {{most, most, most}, {-most, -most, -most}, 0xFFFFFFFFu});
    const auto extend = [](Node& node, LatticePoint low, LatticePoint high, std::uint32_t index) {
        node.low = {std::min(node.low.x, low.x), std::min(node.low.y, low.y), std::min(node.low.z, low.z)};
        node.high = {std::max(node.high.x, high.x), std::max(node.high.y, high.y), std::max(node.high.z, high.z)};
        node.lowest_index = std::min(node.lowest_index, index);
    };
    for (std::size_t leaf = 0; leaf < leaves; ++leaf)
        for (std::size_t i = leaf_begin(leaf); i < leaf_begin(leaf + 1); ++i)
            extend(nodes_[leaves + leaf], entries_[i].point, entries_[i].point, entries_[i].index);
    for (std::size_t n = leaves - 1; n > 0; --n)
        for (const std::size_t child : {2 * n, 2 * n + 1})
            extend(nodes_[n], nodes_[child].low, nodes_[child].high, nodes_[child].lowest_index);
}

void NearestOrder::scan_leaf(std::size_t leaf, Search& search) const {
    for (std::size_t i = leaf_begin(leaf), end = leaf_begin(leaf + 1); i < end; ++i) {
        const std::int64_t distance = squared_distance(search.centre, entries_[i].point);
        if (!search.enters(distance, entries_[i].index) || entries_[i].index == search.centre_index) continue;
        search.insert(distance, entries_[i].index);
    }
}

void NearestOrder::descend(std::size_t node, Search& search) const {
    const std::size_t leaves = std::size_t{1} << depth_;
    if (node >= leaves) {
        scan_leaf(node - leaves, search);
        return;
    }
    std::size_t first = 2 * node, second = first + 1;
    std::int64_t near = search.distance_to_box(nodes_[first]), far = search.distance_to_box(nodes_[second]);
    if (far < near || (far == near && nodes_[second].lowest_index < nodes_[first].lowest_index)) {
        std::swap(first, second);
        std::swap(near, far);
    }
    if (search.enters(near, nodes_[first].lowest_index)) descend(first, search);
    if (search.enters(far, nodes_[second].lowest_index)) descend(second, search);
}

std::size_t NearestOrder::find(std::uint32_t of, std::span<std::uint32_t> nearest) const {
    Search search;
    search.wanted = std::min({nearest.size(), entries_.size() - 1, most_nearest});
    if (search.wanted == 0) return 0;
    search.indices = nearest.data();
    search.centre_index = of;
    std::size_t node = (std::size_t{1} << depth_) + leaf_of_[of];
    const std::size_t leaf = leaf_of_[of];
    for (std::size_t i = leaf_begin(leaf); i < leaf_begin(leaf + 1); ++i)
        if (entries_[i].index == of) search.centre = entries_[i].point;
    scan_leaf(leaf, search);
    for (; node > 1; node /= 2) {
        const std::size_t sibling = node ^ 1;
        if (search.enters(search.distance_to_box(nodes_[sibling]), nodes_[sibling].lowest_index))
            descend(sibling, search);
    }
    return search.found;
}

}  // namespace htvm::internal
