// Nearest neighbours among points, by nanoflann's k-d tree. Encoder side: ties may fall either way.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

namespace htvm {

using Point3f = std::array<float, 3>;

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

}  // namespace htvm
