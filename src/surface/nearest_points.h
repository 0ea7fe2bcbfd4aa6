// Nearest neighbours among points, by nanoflann's k-d tree. Encoder side: ties may fall either way.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/lattice.h"

namespace htvm::internal {

using Point3f = std::array<float, 3>;

// A lattice point as the searches take it.
inline Point3f point_of(LatticePoint p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

inline std::vector<Point3f> points_of(std::span<const LatticePoint> positions) {
    std::vector<Point3f> out;
    out.reserve(positions.size());
    for (const auto p : positions) out.push_back(point_of(p));
    return out;
}

struct Neighbour {
    std::uint32_t index = 0;
    float squared_distance = 0;
};

class NearestPoints {
public:
    // Copies the points.
    explicit NearestPoints(std::span<const Point3f> points);
    NearestPoints(NearestPoints&&) noexcept;
    NearestPoints& operator=(NearestPoints&&) noexcept;
    ~NearestPoints();
    // There must be at least one point.
    Neighbour nearest(const Point3f& query) const;
    std::size_t size() const;
    const Point3f& point(std::size_t index) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

}  // namespace htvm::internal
