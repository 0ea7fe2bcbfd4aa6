#include "metrics/truth_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "metrics/mesh_measures.h"

namespace htvm {

using namespace internal;
namespace {

// The nearest place on a surface of each sample; infinitely far on an empty one.
std::vector<NearestPlace> nearest_of(const std::vector<SurfaceSample>& samples, const SearchedSurface& surface,
                                     Threads threads) {
    std::vector<NearestPlace> out(samples.size());
    if (surface.is_empty()) {
        for (auto& at : out) at.distance = std::numeric_limits<double>::infinity();
        return out;
    }
    parallel_for(samples.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0;
        for (std::size_t i = begin; i < end; ++i) out[i] = surface.nearest(samples[i].place, hint);
    });
    return out;
}

// Which of the places on the truth a camera sees.
std::vector<bool> seen_at(const std::vector<NearestPlace>& places, const SearchedSurface& captured,
                          std::span<const std::uint8_t> seen, const CoverageOptions& options) {
    std::vector<bool> out;
    out.reserve(places.size());
    if (!seen.empty()) {
        for (const auto& at : places) out.push_back(seen[at.triangle] != 0);
        return out;
    }
    std::vector<SurfaceSample> on_truth;
    for (const auto& at : places) on_truth.push_back({at.place, at.triangle});
    for (const auto& at : nearest_of(on_truth, captured, options.threads)) out.push_back(at.distance <= options.within);
    return out;
}

void add_areas(TruthCoverage& out, const SearchedSurface& captured, const SearchedSurface& shown, const Mesh& truth,
               const CoverageOptions& options) {
    const auto samples = so_many_samples_on(truth, options.samples);
    const auto of_captured = nearest_of(samples, captured, options.threads),
               of_shown = nearest_of(samples, shown, options.threads);
    out.area = surface_area(truth.positions, truth.triangles);
    const double each = out.area / static_cast<double>(std::max<std::size_t>(samples.size(), 1));
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const bool by_captured = of_captured[i].distance <= options.within,
                   by_shown = of_shown[i].distance <= options.within;
        if (by_captured) out.captured += each;
        if (by_shown) out.shown += each;
        if (by_shown && !by_captured) out.filled += each;
        if (by_captured && !by_shown) out.lost += each;
    }
}

double rms(double squared, std::uint64_t samples) {
    return samples > 0 ? std::sqrt(squared / static_cast<double>(samples)) : 0;
}

}  // namespace

Result<TruthCoverage> truth_coverage(const Mesh& captured, const Mesh& shown, const Mesh& truth,
                                     std::span<const std::uint8_t> seen, const CoverageOptions& options) {
    if (truth.triangles.empty()) return fail(ErrorKind::bad_input, "The true surface has no triangles.");
    if (!seen.empty() && seen.size() != truth.triangles.size())
        return fail(ErrorKind::bad_input, "What is seen of the truth is not told for each of its triangles.");
    const auto of_captured = SearchedSurface::build(captured, options.threads);
    if (!of_captured) return tl::unexpected(of_captured.error());
    const auto of_shown = SearchedSurface::build(shown, options.threads);
    if (!of_shown) return tl::unexpected(of_shown.error());
    const auto of_truth = SearchedSurface::build(truth, options.threads);
    if (!of_truth) return tl::unexpected(of_truth.error());
    TruthCoverage out;
    add_areas(out, *of_captured, *of_shown, truth, options);
    for (const auto& at : nearest_of(so_many_samples_on(captured, options.samples), *of_truth, options.threads)) {
        ++out.captured_samples;
        out.captured_squared += at.distance * at.distance;
    }
    const auto places = nearest_of(so_many_samples_on(shown, options.samples), *of_truth, options.threads);
    const auto is_seen = seen_at(places, *of_captured, seen, options);
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (!is_seen[i]) continue;
        ++out.shown_samples;
        out.shown_squared += places[i].distance * places[i].distance;
    }
    return out;
}

TruthCoverage& operator+=(TruthCoverage& sums, const TruthCoverage& frame) {
    sums.captured_samples += frame.captured_samples;
    sums.shown_samples += frame.shown_samples;
    sums.captured_squared += frame.captured_squared;
    sums.shown_squared += frame.shown_squared;
    sums.area += frame.area;
    sums.captured += frame.captured;
    sums.shown += frame.shown;
    sums.filled += frame.filled;
    sums.lost += frame.lost;
    return sums;
}

double captured_to_truth_rms(const TruthCoverage& sums) { return rms(sums.captured_squared, sums.captured_samples); }
double shown_to_truth_rms(const TruthCoverage& sums) { return rms(sums.shown_squared, sums.shown_samples); }

double truth_share(const TruthCoverage& sums, double TruthCoverage::*area) {
    return sums.area > 0 ? sums.*area / sums.area : 0;
}

}  // namespace htvm
