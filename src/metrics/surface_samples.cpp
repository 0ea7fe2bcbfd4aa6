#include "metrics/surface_samples.h"

#include <algorithm>
#include <cmath>

namespace htvm {
namespace {

// A reproducible number in [0, 1) for each sample and coordinate: an additive recurrence with the plastic number
// (Roberts 2018), which fills every triangle evenly.
double evenly(std::size_t sample, double step) {
    const double x = 0.5 + step * static_cast<double>(sample);
    return x - std::floor(x);
}

}  // namespace

std::vector<SurfaceSample> samples_on(const Mesh& mesh, double spacing) {
    std::vector<SurfaceSample> out;
    double area = 0;
    for (std::uint32_t number = 0; number < mesh.triangles.size(); ++number) {
        const Triangle& t = mesh.triangles[number];
        const Point3 a = to_point(mesh.positions[t[0]]);
        const Point3 ab = to_point(mesh.positions[t[1]]) - a, ac = to_point(mesh.positions[t[2]]) - a;
        area += length(cross(ab, ac)) / 2;
        while ((static_cast<double>(out.size()) + 0.5) * spacing * spacing < area) {
            double u = evenly(out.size(), 0.7548776662466927), v = evenly(out.size(), 0.5698402909980532);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            out.push_back({a + ab * u + ac * v, number});
        }
    }
    return out;
}

std::vector<SurfaceSample> so_many_samples_on(const Mesh& mesh, std::uint64_t count) {
    const double area = surface_area(mesh.positions, mesh.triangles);
    if (!(area > 0) || count == 0) return {};
    return samples_on(mesh, std::sqrt(area / static_cast<double>(count)));
}

}  // namespace htvm
