// Places on a surface, and how far they are from each other along it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace htvm::internal {

// Places and which of them are beside each other; distances along the surface are sums of the straight ones.
struct PlaceGraph {
    std::vector<Eigen::Vector3d> places;
    std::vector<std::vector<std::uint32_t>> beside;  // for each place, both ways
};

inline constexpr double unreachable = std::numeric_limits<double>::infinity();

// How far each place is from one along the graph (Dijkstra); unreachable beyond `reach`.
std::vector<double> distances_from(const PlaceGraph& graph, std::uint32_t start, double reach = unreachable);

}  // namespace htvm::internal
