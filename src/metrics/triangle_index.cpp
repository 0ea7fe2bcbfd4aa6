#include "metrics/triangle_index.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "core/parallel.h"

namespace htvm {

using namespace internal;

struct TriangleIndex::Impl {
    const Mesh* mesh = nullptr;
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    double largest = 0;  // largest absolute coordinate
    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }
};

namespace {

// How far to search the hierarchy to be sure to find everything within `distance`: float coordinates, boxes and
// distances are each off by a few units in the last place.
float search_radius(double distance, double largest) {
    return static_cast<float>(distance * (1 + 4e-6) + largest * 1e-6);
}

double largest_component(const Point3& p) { return std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}); }

struct ClosestSearch {
    const Mesh* mesh;
    Point3 p;
    double largest;
    ClosestTriangle best;
};

bool consider(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<ClosestSearch*>(arguments->userPtr);
    const double d = squared_distance_to(*search.mesh, arguments->primID, search.p);
    if (d > search.best.squared_distance) return false;
    if (d == search.best.squared_distance) {
        search.best.triangle = std::min(search.best.triangle, arguments->primID);
        return false;
    }
    search.best = {d, arguments->primID};
    arguments->query->radius = std::min(arguments->query->radius, search_radius(std::sqrt(d), search.largest));
    return true;
}

struct NearSearch {
    const std::function<bool(std::uint32_t)>* visit;
    bool done = false;
};

bool visit_one(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<NearSearch*>(arguments->userPtr);
    if (search.done || (*search.visit)(arguments->primID)) return false;
    search.done = true;
    arguments->query->radius = 0;
    return true;
}

RTCPointQuery query_at(const Point3& p, float radius) {
    RTCPointQuery query;
    query.x = static_cast<float>(p[0]);
    query.y = static_cast<float>(p[1]);
    query.z = static_cast<float>(p[2]);
    query.time = 0;
    query.radius = radius;
    return query;
}

bool fill_scene(RTCDevice device, RTCScene scene, const Mesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vector3f),
                                              mesh.positions.size());
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle),
                                              mesh.triangles.size());
    if (positions && triangles) {
        std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(Vector3f));
        std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcCommitScene(scene);
    }
    rtcReleaseGeometry(geometry);
    return positions && triangles && rtcGetDeviceError(device) == RTC_ERROR_NONE;
}

}  // namespace

Result<TriangleIndex> TriangleIndex::build(const Mesh& mesh, Threads threads) {
    if (mesh.triangles.empty()) return fail(ErrorKind::bad_input, "A mesh without triangles has no surface to index.");
    auto impl = std::make_shared<Impl>();
    impl->mesh = &mesh;
    impl->device = rtcNewDevice(("threads=" + std::to_string(threads.count)).c_str());
    impl->scene = impl->device ? rtcNewScene(impl->device) : nullptr;
    if (!impl->scene) return fail(ErrorKind::limit, "Embree could not start: no memory or threads left.");
    rtcSetSceneFlags(impl->scene, RTC_SCENE_FLAG_ROBUST);
    if (!fill_scene(impl->device, impl->scene, mesh))
        return fail(ErrorKind::limit, "Embree could not index a mesh of " + std::to_string(mesh.triangles.size()) +
                                          " triangles: not enough memory.");
    for (const auto& p : mesh.positions) impl->largest = std::max(impl->largest, largest_component(to_point(p)));
    TriangleIndex index;
    index.impl_ = std::move(impl);
    return index;
}

ClosestTriangle TriangleIndex::closest(const Point3& p, std::uint32_t hint) const {
    const double largest = std::max(impl_->largest, largest_component(p));
    ClosestSearch search{impl_->mesh, p, largest, {squared_distance_to(*impl_->mesh, hint, p), hint}};
    RTCPointQuery query = query_at(p, search_radius(std::sqrt(search.best.squared_distance), largest));
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(impl_->scene, &query, &context, consider, &search);
    return search.best;
}

void TriangleIndex::visit_near(const Point3& p, double radius, const std::function<bool(std::uint32_t)>& visit) const {
    NearSearch search{&visit};
    RTCPointQuery query = query_at(p, search_radius(radius, std::max(impl_->largest, largest_component(p))));
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(impl_->scene, &query, &context, visit_one, &search);
}

}  // namespace htvm
