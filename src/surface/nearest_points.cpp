#include "surface/nearest_points.h"

#include <nanoflann.hpp>
#include <vector>

namespace htvm::internal {

struct NearestPoints::Tree {
    explicit Tree(std::span<const Point3f> given) : points(given.begin(), given.end()) {
        if (!points.empty()) index = std::make_unique<Index>(3, *this, nanoflann::KDTreeSingleIndexAdaptorParams(12));
    }
    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
    using Index =
        nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Tree>, Tree, 3, std::uint32_t>;
    std::vector<Point3f> points;
    std::unique_ptr<Index> index;
};

NearestPoints::NearestPoints(std::span<const Point3f> points) : tree_(std::make_unique<Tree>(points)) {}
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;
NearestPoints::~NearestPoints() = default;

Neighbour NearestPoints::nearest(const Point3f& query) const {
    Neighbour out;
    tree_->index->knnSearch(query.data(), 1, &out.index, &out.squared_distance);
    return out;
}

std::size_t NearestPoints::size() const { return tree_->points.size(); }
const Point3f& NearestPoints::point(std::size_t index) const { return tree_->points[index]; }

}  // namespace htvm::internal
