#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "metrics/front.h"
#include "metrics/render.h"

namespace htvm {
namespace {

// The volume that the box sweeps as it turns about the vertical axis: a cylinder that encloses it.
struct Cylinder {
    double radius, half_height;
};

Cylinder enclosing_cylinder(const Box& box, const Point3& up) {
    const Point3 half = (box.high - box.low) * 0.5;
    const double half_height = std::abs(dot(half, up));
    const double radius = std::sqrt(std::max(0.0, dot(half, half) - half_height * half_height));
    if (radius == 0 && half_height == 0) return {0.5, 0.5};
    return {radius, half_height};
}

// The half extents in the picture plane and in depth of a cylinder that is seen from `elevation` above.
struct Extents {
    double across, upright, deep;
};

Extents seen_from(const Cylinder& body, double elevation) {
    const double c = std::abs(std::cos(elevation)), s = std::abs(std::sin(elevation));
    return {body.radius, body.half_height * c + body.radius * s, body.radius * c + body.half_height * s};
}

Result<void> check(const ViewOptions& o) {
    if (o.views < 1 || o.views > 1000) return fail(ErrorKind::bad_input, "The number of views must be 1 to 1000.");
    if (o.width < 1 || o.width > 16384 || o.height < 1 || o.height > 16384)
        return fail(ErrorKind::bad_input, "A picture must be 1 to 16384 pixels wide and high.");
    if (!(std::abs(o.elevation) <= 80)) return fail(ErrorKind::bad_input, "The elevation must be -80 to 80 degrees.");
    if (!(o.field_of_view >= 1 && o.field_of_view <= 120))
        return fail(ErrorKind::bad_input, "The field of view must be 1 to 120 degrees.");
    if (!(o.margin >= 0 && o.margin <= 0.4)) return fail(ErrorKind::bad_input, "The margin must be 0 to 0.4.");
    if (!std::isfinite(o.first_azimuth)) return fail(ErrorKind::bad_input, "The first azimuth must be a number.");
    return {};
}

}  // namespace

Result<std::vector<Camera>> cameras_round(const Box& box, const ViewOptions& options) {
    if (const auto ok = check(options); !ok) return tl::unexpected(ok.error());
    const double degree = std::numbers::pi / 180;
    const ViewAxes axes = view_axes(options.up);
    const Point3 centre = (box.low + box.high) * 0.5;
    const Extents extents = seen_from(enclosing_cylinder(box, axes.up), options.elevation * degree);
    const double free = 1 - 2 * options.margin;
    const double half_width = options.width * free / 2, half_height = options.height * free / 2;  // pixels

    Camera camera;
    camera.width = options.width;
    camera.height = options.height;
    camera.orthographic = options.orthographic;
    double distance = extents.deep * 2 + 1;
    if (options.orthographic) {
        camera.scale =
            std::min(half_width / std::max(extents.across, 1e-9), half_height / std::max(extents.upright, 1e-9));
    } else {
        // The corner nearest to the camera limits the scale: its offset at depth (distance - deep) must stay in the
        // picture.
        camera.scale = options.height / 2.0 / std::tan(options.field_of_view * degree / 2);
        distance = extents.deep + camera.scale * std::max(extents.across / half_width, extents.upright / half_height);
    }

    std::vector<Camera> cameras;
    for (int i = 0; i < options.views; ++i) {
        const double azimuth = options.first_azimuth * degree + 2 * std::numbers::pi * i / options.views;
        const double elevation = options.elevation * degree;
        const Point3 level = axes.front * std::cos(azimuth) + axes.right * std::sin(azimuth);
        camera.backward = normalised(level * std::cos(elevation) + axes.up * std::sin(elevation));
        camera.right = normalised(cross(axes.up, camera.backward));
        camera.up = cross(camera.backward, camera.right);
        camera.position = centre + camera.backward * distance;
        cameras.push_back(camera);
    }
    return cameras;
}

}  // namespace htvm
