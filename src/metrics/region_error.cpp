#include "metrics/region_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "core/parallel.h"
#include "metrics/percentile.h"
#include "metrics/surface_index.h"

namespace htvm {

using namespace internal;
namespace {

// A reproducible number in [0, 1) for each sample and coordinate: an additive recurrence with the plastic number
// (Roberts 2018), which fills every triangle evenly.
double evenly(std::size_t sample, double step) {
    const double x = 0.5 + step * static_cast<double>(sample);
    return x - std::floor(x);
}

// Points on the triangles, one for each squared spacing of area.
std::vector<Point3> samples_on(const Mesh& mesh, double spacing) {
    std::vector<Point3> out;
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Point3 a = to_point(mesh.positions[t[0]]);
        const Point3 ab = to_point(mesh.positions[t[1]]) - a, ac = to_point(mesh.positions[t[2]]) - a;
        area += length(cross(ab, ac)) / 2;
        while ((static_cast<double>(out.size()) + 0.5) * spacing * spacing < area) {
            double u = evenly(out.size(), 0.7548776662466927), v = evenly(out.size(), 0.5698402909980532);
            if (u + v > 1) u = 1 - u, v = 1 - v;
            out.push_back(a + ab * u + ac * v);
        }
    }
    return out;
}

// The point of the surface that is nearest to each point.
std::vector<Point3> nearest_on(const Mesh& mesh, const SurfaceIndex& index, const std::vector<Point3>& points,
                               Threads threads) {
    std::vector<Point3> out(points.size());
    parallel_for(points.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0;
        for (std::size_t i = begin; i < end; ++i) {
            hint = index.closest(points[i], hint).triangle;
            const Triangle& t = mesh.triangles[hint];
            out[i] = closest_point_of(points[i], to_point(mesh.positions[t[0]]), to_point(mesh.positions[t[1]]),
                                      to_point(mesh.positions[t[2]]));
        }
    });
    return out;
}

// The centres of regions, found by the cell that they lie in; cells have the regions' radius.
class Centres {
public:
    explicit Centres(double radius) : radius_(radius) {}
    void add_unless_covered(const Point3& point) {
        bool covered = false;
        visit_around(point, [&](std::size_t) { covered = true; });
        if (covered) return;
        cells_[key_of(cell_of(point))].push_back(places_.size());
        places_.push_back(point);
    }
    // Calls visit with the number of every region that has the point.
    template <class Visit>
    void visit_around(const Point3& point, const Visit& visit) const {
        const auto middle = cell_of(point);
        for (int n = 0; n < 27; ++n) {
            const auto cell =
                cells_.find(key_of({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1}));
            if (cell == cells_.end()) continue;
            for (const std::size_t number : cell->second)
                if (length(places_[number] - point) <= radius_) visit(number);
        }
    }
    const std::vector<Point3>& places() const { return places_; }

private:
    using Cell = std::array<std::int64_t, 3>;
    Cell cell_of(const Point3& point) const {
        Cell out{};
        for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<std::int64_t>(std::floor(point[i] / radius_));
        return out;
    }
    // Cells that share a key by chance are told apart by the distance.
    static std::uint64_t key_of(const Cell& cell) {
        std::uint64_t key = 0;
        for (const std::int64_t c : cell) key = key * 0x9E3779B97F4A7C15ull + static_cast<std::uint64_t>(c);
        return key;
    }
    double radius_;
    std::vector<Point3> places_;
    std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

struct Sums {
    std::size_t samples = 0;
    double squared = 0;
    double rms() const { return samples > 0 ? std::sqrt(squared / static_cast<double>(samples)) : 0; }
};

// For each region, of the pairs of points whose `place` lies within it.
std::vector<Sums> sums_by_region(const Centres& centres, const std::vector<Point3>& places,
                                 const std::vector<Point3>& others) {
    std::vector<Sums> sums(centres.places().size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Point3 away = places[i] - others[i];
        centres.visit_around(places[i], [&](std::size_t region) {
            ++sums[region].samples;
            sums[region].squared += dot(away, away);
        });
    }
    return sums;
}

}  // namespace

Result<RegionError> worst_region(const Mesh& original, const Mesh& decoded, const RegionErrorOptions& options) {
    RegionError out;
    if (original.triangles.empty()) return out;
    if (decoded.triangles.empty()) {
        out.worst_mm = std::numeric_limits<double>::infinity();
        return out;
    }
    const auto captured = SurfaceIndex::build(original, options.threads);
    if (!captured) return tl::unexpected(captured.error());
    const auto shown = SurfaceIndex::build(decoded, options.threads);
    if (!shown) return tl::unexpected(shown.error());
    const auto of_original = samples_on(original, options.spacing), of_decoded = samples_on(decoded, options.spacing);
    Centres centres(options.radius);
    for (const Point3& point : of_original) centres.add_unless_covered(point);
    const auto forward =
        sums_by_region(centres, of_original, nearest_on(decoded, *shown, of_original, options.threads));
    const auto backward =
        sums_by_region(centres, nearest_on(original, *captured, of_decoded, options.threads), of_decoded);
    for (std::size_t region = 0; region < forward.size(); ++region) {
        if (forward[region].samples < options.fewest_samples) continue;
        ++out.regions;
        const double error = std::max(forward[region].rms(), backward[region].rms());
        if (error <= out.worst_mm) continue;
        out.worst_mm = error;
        out.centre = centres.places()[region];
    }
    return out;
}

RegionErrorSummary summarise(std::vector<double> worst_mm) {
    RegionErrorSummary out;
    out.frames = worst_mm.size();
    if (worst_mm.empty()) return out;
    std::ranges::sort(worst_mm);
    out.median_mm = percentile(worst_mm, 50);
    out.p99_mm = percentile(worst_mm, 99);
    out.largest_mm = worst_mm.back();
    return out;
}

}  // namespace htvm
