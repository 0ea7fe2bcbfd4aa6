#include "metrics/region_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "core/parallel.h"
#include "metrics/percentile.h"
#include "metrics/surface_samples.h"
#include "metrics/triangle_index.h"

namespace htvm {

using namespace internal;
namespace {

// The point of the surface that is nearest to each sample.
std::vector<Point3> nearest_on(const Mesh& mesh, const TriangleIndex& index, const std::vector<SurfaceSample>& samples,
                               Threads threads) {
    std::vector<Point3> out(samples.size());
    parallel_for(samples.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0;
        for (std::size_t i = begin; i < end; ++i) {
            hint = index.closest(samples[i].place, hint).triangle;
            const Triangle& t = mesh.triangles[hint];
            out[i] = closest_point_of(samples[i].place, to_point(mesh.positions[t[0]]), to_point(mesh.positions[t[1]]),
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

// For each region, of the pairs whose place on the original lies within it.
std::vector<Sums> sums_by_region(const Centres& centres, std::span<const PlacePair> pairs) {
    std::vector<Sums> sums(centres.places().size());
    for (const PlacePair& pair : pairs) {
        const Point3 away = pair.original - pair.decoded;
        centres.visit_around(pair.original, [&](std::size_t region) {
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
    const auto captured = TriangleIndex::build(original, options.threads);
    if (!captured) return tl::unexpected(captured.error());
    const auto shown = TriangleIndex::build(decoded, options.threads);
    if (!shown) return tl::unexpected(shown.error());
    const auto of_original = samples_on(original, options.spacing), of_decoded = samples_on(decoded, options.spacing);
    const auto beside_original = nearest_on(decoded, *shown, of_original, options.threads),
               beside_decoded = nearest_on(original, *captured, of_decoded, options.threads);
    std::vector<PlacePair> forward, backward;
    for (std::size_t i = 0; i < of_original.size(); ++i) forward.push_back({of_original[i].place, beside_original[i]});
    for (std::size_t i = 0; i < of_decoded.size(); ++i) backward.push_back({beside_decoded[i], of_decoded[i].place});
    return worst_region_among(forward, backward, options);
}

RegionError worst_region_among(std::span<const PlacePair> forward, std::span<const PlacePair> backward,
                               const RegionErrorOptions& options) {
    RegionError out;
    Centres centres(options.radius);
    for (const PlacePair& pair : forward) centres.add_unless_covered(pair.original);
    const auto of_original = sums_by_region(centres, forward), of_decoded = sums_by_region(centres, backward);
    for (std::size_t region = 0; region < of_original.size(); ++region) {
        if (of_original[region].samples < options.fewest_samples) continue;
        ++out.regions;
        const bool both = of_decoded[region].samples >= options.fewest_decoded;
        const double error = std::max(of_original[region].rms(), both ? of_decoded[region].rms() : 0);
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
