#include "metrics/drift.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "metrics/triangle_index.h"

namespace htvm {
namespace {

FrameDrift summary_of(std::vector<float> slid, std::uint32_t age) {
    FrameDrift drift;
    drift.age = age;
    drift.marks = slid.size();
    if (slid.empty()) return drift;
    double sum = 0;
    for (const float value : slid) sum += value;
    drift.mean_mm = sum / static_cast<double>(slid.size());
    const auto place = slid.begin() + static_cast<std::ptrdiff_t>((slid.size() - 1) * 95 / 100);
    std::ranges::nth_element(slid, place);
    drift.p95_mm = *place;
    return drift;
}

bool on_surface(const Mesh& marks, std::size_t mark) {
    const Point3 normal = to_point(marks.normals[mark]);
    return dot(normal, normal) > 0.25;
}

constexpr std::uint32_t nowhere = std::numeric_limits<std::uint32_t>::max();

// Where a frame has the reference's vertices: at their own places if it shows all.
class PlacesInFrame {
public:
    explicit PlacesInFrame(const ShownVertices& shown) : shows_all_(shown.places.empty()) {
        if (shows_all_) return;
        place_of_.assign(std::size_t{shown.places.back()} + 1, nowhere);
        for (std::size_t v = 0; v < shown.places.size(); ++v)
            place_of_[shown.places[v]] = static_cast<std::uint32_t>(v);
    }
    std::uint32_t operator[](std::uint32_t vertex) const {
        if (shows_all_) return vertex;
        return vertex < place_of_.size() ? place_of_[vertex] : nowhere;
    }

private:
    bool shows_all_;
    std::vector<std::uint32_t> place_of_;
};

bool are_places(const std::vector<std::uint32_t>& places, std::size_t vertices) {
    return places.empty() || (places.size() == vertices && std::ranges::is_sorted(places) && places.back() != nowhere);
}

}  // namespace

bool DriftMeter::is_of_reference(const Mesh& decoded, const ShownVertices& shown) const {
    if (shown.reference != 0 && shown.reference == reference_) return true;
    return shows_all_ && shown.places.empty() && decoded.triangles == triangles_;
}

Result<void> DriftMeter::attach(const Mesh& marks, const Mesh& decoded, const ShownVertices& shown) {
    followed_.clear();
    age_ = 0;
    if (decoded.triangles.empty()) return {};
    const auto index = TriangleIndex::build(decoded);
    if (!index) return tl::unexpected(index.error());
    for (std::size_t mark = 0; mark < marks.positions.size(); ++mark) {
        if (!on_surface(marks, mark)) continue;
        const Point3 place = to_point(marks.positions[mark]);
        const ClosestTriangle closest = index->closest(place);
        if (closest.squared_distance > options_.reach * options_.reach) continue;
        const Triangle& t = decoded.triangles[closest.triangle];
        const Point3 a = to_point(decoded.positions[t[0]]), b = to_point(decoded.positions[t[1]]),
                     c = to_point(decoded.positions[t[2]]);
        const Point3 facing = normalised(cross(b - a, c - a));
        if (dot(facing, to_point(marks.normals[mark])) < options_.least_facing) continue;
        const auto nearest = internal::closest_on_triangle(place, a, b, c);
        std::array<std::uint32_t, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) corners[k] = shown.places.empty() ? t[k] : shown.places[t[k]];
        followed_.push_back({static_cast<std::uint32_t>(mark), corners, nearest.shares});
    }
    return {};
}

Result<FrameDrift> DriftMeter::add(const Mesh& marks, const Mesh& decoded, const ShownVertices& shown) {
    if (const auto ok = check_measurable(marks, "frame of marks"); !ok) return tl::unexpected(ok.error());
    if (const auto ok = check_measurable(decoded, "decoded mesh"); !ok) return tl::unexpected(ok.error());
    if (marks.normals.size() != marks.positions.size())
        return fail(ErrorKind::bad_input, "the marks of a true surface need normals");
    if (!are_places(shown.places, decoded.positions.size()))
        return fail(ErrorKind::bad_input, "the vertices shown need a place each, in ascending order");
    if (!slid_.empty() && mark_count_ != marks.positions.size())
        return fail(ErrorKind::bad_input, "a frame has " + std::to_string(marks.positions.size()) +
                                              " marks, the ones before " + std::to_string(mark_count_));
    mark_count_ = marks.positions.size();
    if (slid_.empty() || !is_of_reference(decoded, shown)) {
        if (const auto ok = attach(marks, decoded, shown); !ok) return tl::unexpected(ok.error());
    } else {
        ++age_;
    }
    reference_ = shown.reference;
    shows_all_ = shown.places.empty();
    triangles_ = decoded.triangles;
    const PlacesInFrame places(shown);
    std::vector<float> slid;
    for (const Followed& point : followed_) {
        if (!on_surface(marks, point.mark)) continue;
        std::array<Point3, 3> corners{};
        bool is_there = true;
        for (std::size_t k = 0; k < 3 && is_there; ++k) {
            const auto vertex = places[point.corners[k]];
            is_there = vertex < decoded.positions.size();
            if (is_there) corners[k] = to_point(decoded.positions[vertex]);
        }
        if (!is_there) continue;
        const Point3 now = internal::point_at(point.shares, corners[0], corners[1], corners[2]);
        const Point3 normal = normalised(to_point(marks.normals[point.mark]));
        const Point3 away = now - to_point(marks.positions[point.mark]);
        slid.push_back(static_cast<float>(length(away - normal * dot(away, normal))));
    }
    if (slid_.size() <= age_) slid_.resize(age_ + 1);
    slid_[age_].insert(slid_[age_].end(), slid.begin(), slid.end());
    return summary_of(std::move(slid), age_);
}

std::vector<FrameDrift> DriftMeter::by_age() const {
    std::vector<FrameDrift> out;
    for (std::size_t age = 0; age < slid_.size(); ++age)
        out.push_back(summary_of(slid_[age], static_cast<std::uint32_t>(age)));
    return out;
}

FrameDrift DriftMeter::overall() const {
    std::vector<float> all;
    for (std::size_t age = 1; age < slid_.size(); ++age) all.insert(all.end(), slid_[age].begin(), slid_[age].end());
    return summary_of(std::move(all), 0);
}

}  // namespace htvm
