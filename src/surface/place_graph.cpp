#include "surface/place_graph.h"

#include <functional>
#include <queue>
#include <utility>

namespace htvm::internal {

std::vector<double> distances_from(const PlaceGraph& graph, std::uint32_t start, double reach) {
    std::vector<double> out(graph.places.size(), unreachable);
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> heap;
    out[start] = 0;
    heap.emplace(0, start);
    while (!heap.empty()) {
        const auto [distance, place] = heap.top();
        heap.pop();
        if (distance > out[place]) continue;
        for (const auto other : graph.beside[place]) {
            const double there = distance + (graph.places[other] - graph.places[place]).norm();
            if (there > reach || there >= out[other]) continue;
            out[other] = there;
            heap.emplace(there, other);
        }
    }
    return out;
}

}  // namespace htvm::internal
