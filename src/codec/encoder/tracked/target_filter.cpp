#include "codec/encoder/tracked/target_filter.h"

#include <algorithm>
#include <cmath>

namespace htvm::internal {
namespace {

constexpr std::size_t components = 4, fields = 2;
// Tuned on synthetic captures, whose true surface is known: docs/experiments/noise.md has figures.
constexpr int rounds = 4;               // of smoothing: detail is what is left beyond them, 20 mm or so
constexpr float longest_memory = 12;    // frames over which noise is averaged
constexpr float usual_counts = 4;       // frames that the whole surface's noise counts beside that of a place
constexpr float explained = 1.5F;       // squared distance from the estimate that noise alone may make, in variances
constexpr float least_change = 0.03F;   // of the surface itself from frame to frame, in variances of the noise
constexpr float largest_product = 1e3;  // of two changes, in medians of the squared changes
// Re-meshing makes noise even where the surface has none: of this many mean edges of the capture, and half of the
// colours', as they are resampled at every edge between two.
constexpr float of_meshing = 0.03F, of_resampling = 0.5F;

// Means over the mesh.
class Surroundings {
public:
    Surroundings(std::span<const Triangle> triangles, std::size_t vertices)
        : triangles_(triangles), weight_(vertices, own) {
        for (const auto& t : triangles)
            for (const auto v : t) weight_[v] += 2;
        for (auto& w : weight_) w = 1 / w;
    }

    // Each round, every value becomes the mean of itself and its neighbours'.
    void smooth(std::vector<TargetDetail>& values) const {
        std::vector<TargetDetail> sums(values.size());
        for (int round = 0; round < rounds; ++round) {
            for (std::size_t v = 0; v < values.size(); ++v)
                for (std::size_t c = 0; c < components; ++c) sums[v][c] = own * values[v][c];
            for (const auto& t : triangles_) {
                const auto &a = values[t[0]], &b = values[t[1]], &c = values[t[2]];
                auto &to_a = sums[t[0]], &to_b = sums[t[1]], &to_c = sums[t[2]];
                for (std::size_t i = 0; i < components; ++i) {
                    to_a[i] += b[i] + c[i];
                    to_b[i] += c[i] + a[i];
                    to_c[i] += a[i] + b[i];
                }
            }
            for (std::size_t v = 0; v < values.size(); ++v)
                for (std::size_t c = 0; c < components; ++c) values[v][c] = sums[v][c] * weight_[v];
        }
    }

private:
    static constexpr float own = 2;  // a neighbour counts twice, too: in both triangles of the edge to it
    std::span<const Triangle> triangles_;
    std::vector<float> weight_;
};

std::vector<TargetDetail> values_of(const TrackedTargets& targets) {
    std::vector<TargetDetail> out(targets.displacement.size());
    for (std::size_t v = 0; v < out.size(); ++v) {
        out[v][0] = static_cast<float>(targets.displacement[v]);
        if (targets.colours.empty()) continue;
        for (std::size_t c = 0; c < 3; ++c) out[v][1 + c] = static_cast<float>(targets.colours[3 * v + c]);
    }
    return out;
}

TargetDetail difference(const TargetDetail& a, const TargetDetail& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]};
}

TargetVariance product(const TargetDetail& a, const TargetDetail& b) {
    return {a[0] * b[0], (a[1] * b[1] + a[2] * b[2] + a[3] * b[3]) / 3};
}

TargetVariance median_square(std::span<const TargetDetail> details) {
    TargetVariance out{};
    if (details.empty()) return out;
    std::vector<float> squares(details.size());
    for (std::size_t f = 0; f < fields; ++f) {
        for (std::size_t v = 0; v < details.size(); ++v) squares[v] = product(details[v], details[v])[f];
        const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
        std::nth_element(squares.begin(), middle, squares.end());
        out[f] = *middle;
    }
    return out;
}

// The variance of what the reference is off by because it is coded.
TargetVariance coded_variance(const TargetFilterOptions& options) {
    const auto of_step = [](double step) { return static_cast<float>(step * step / 12); };
    return {of_step(options.geometry_step.value), of_step(options.colour_step)};
}

// What one frame tells at a vertex, its neighbours' mixed in.
struct Evidence {
    TargetVariance undone;  // minus the product of two changes in a row: of noise, its variance
    TargetVariance apart;   // squared distance from the estimate
};

// change_before: empty where there is none.
std::vector<Evidence> evidence_of(const TargetHistory& now, std::span<const TargetDetail> change_before,
                                  const Surroundings& surroundings) {
    const auto median = median_square(now.change);
    std::vector<TargetDetail> mixed(now.seen.size());
    for (std::size_t v = 0; v < mixed.size(); ++v) {
        const auto apart = difference(now.seen[v], now.estimate[v]);
        const auto squares = product(apart, apart);
        mixed[v] = {0, 0, squares[0], squares[1]};
        if (change_before.empty()) continue;
        const auto products = product(now.change[v], change_before[v]);
        for (std::size_t f = 0; f < fields; ++f) {
            const float most = largest_product * median[f];
            mixed[v][f] = std::clamp(-products[f], -most, most);
        }
    }
    surroundings.smooth(mixed);
    std::vector<Evidence> out;
    out.reserve(mixed.size());
    for (const auto& m : mixed) out.push_back({{m[0], m[1]}, {m[2], m[3]}});
    return out;
}

void measure_noise(TargetHistory& now, std::span<const Evidence> evidence) {
    const float newest = 1 / std::min(static_cast<float>(++now.measured), longest_memory);
    for (std::size_t f = 0; f < fields; ++f) {
        double sum = 0;
        for (std::size_t v = 0; v < evidence.size(); ++v) {
            sum += evidence[v].undone[f];
            now.noise[v][f] += newest * (evidence[v].undone[f] - now.noise[v][f]);
        }
        const auto mean = static_cast<float>(sum / static_cast<double>(evidence.size()));
        now.usual_noise[f] += newest * (mean - now.usual_noise[f]);
    }
}

// The part of the way from the estimate to what is seen that the estimate goes, and how unsure it is then.
float gain(float apart, float noise, float& unsure) {
    if (noise <= 0) {
        unsure = 0;
        return 1;
    }
    unsure = std::max(unsure, 0.0F);
    unsure += std::max(apart - explained * (unsure + noise), least_change * noise);
    const float out = unsure / (unsure + noise);
    unsure = out * noise;
    return out;
}

}  // namespace

TargetHistory filter_targets(TrackedTargets& targets, std::span<const Triangle> triangles, const TargetHistory& before,
                             const TargetFilterOptions& options) {
    const std::size_t vertices = targets.displacement.size();
    if (vertices == 0) return before;
    const bool first = before.seen.empty();
    const Surroundings surroundings(triangles, vertices);
    TargetHistory out = first ? on_new_reference(before, {}, vertices, options) : before;
    auto smooth = values_of(targets);
    const auto whole = smooth;
    surroundings.smooth(smooth);
    out.change.resize(vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
        const auto detail = difference(whole[v], smooth[v]);
        out.change[v] = difference(detail, out.seen[v]);
        out.seen[v] = detail;
    }
    const auto evidence = evidence_of(out, before.change, surroundings);
    if (!before.change.empty()) {
        measure_noise(out, evidence);
        // The first frames were taken as they are, noise and all.
        if (before.measured == 0) out.unsure = out.noise;
    }

    const auto edges = of_meshing * static_cast<float>(options.captured_edge.value);
    const float known = std::min(static_cast<float>(out.measured), longest_memory);
    double left_out = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        TargetVariance gains{};
        for (std::size_t f = 0; f < fields; ++f) {
            const float noise = (known * out.noise[v][f] + usual_counts * out.usual_noise[f]) / (known + usual_counts);
            const float of_capture = f == 0 ? noise - edges * edges : (1 - of_resampling) * noise;
            gains[f] = gain(evidence[v].apart[f], of_capture, out.unsure[v][f]);
        }
        left_out += 1 - gains[0];
        for (std::size_t c = 0; c < components; ++c)
            out.estimate[v][c] += gains[c > 0] * (out.seen[v][c] - out.estimate[v][c]);
        const auto filtered = [&](std::size_t c) {
            constexpr float most = field_limit;
            return static_cast<std::int32_t>(std::lround(std::clamp(smooth[v][c] + out.estimate[v][c], -most, most)));
        };
        targets.displacement[v] = filtered(0);
        for (std::size_t c = 0; c < 3 && !targets.colours.empty(); ++c) targets.colours[3 * v + c] = filtered(1 + c);
    }
    out.calm = left_out / static_cast<double>(vertices);
    return out;
}

double price_of_bits(const TargetHistory& filtered, LatticeUnits step) {
    constexpr double fine = 1.5;  // steps up to which, in deviations of the noise, what is left out is small anyway
    constexpr double least = 0.2;
    const double noise = std::sqrt(std::max(0.0, static_cast<double>(filtered.usual_noise[0])));
    return 1 - filtered.calm * (1 - std::clamp(fine * noise / step.value, least, 1.0));
}

TargetHistory on_new_reference(const TargetHistory& before, std::span<const std::uint32_t> kept, std::size_t vertices,
                               const TargetFilterOptions& options) {
    TargetHistory out;
    out.usual_noise = before.usual_noise;
    out.measured = before.measured;
    // Nothing has been seen of it but itself, with the noise of its capture.
    out.seen.assign(vertices, {});
    out.estimate.assign(vertices, {});
    out.noise.assign(vertices, out.usual_noise);
    out.unsure = out.noise;
    for (std::size_t v = 0; v < kept.size(); ++v) {
        out.noise[v] = before.noise[kept[v]];
        out.unsure[v] = before.unsure[kept[v]];
    }
    const auto coded = coded_variance(options);
    for (auto& unsure : out.unsure)
        for (std::size_t f = 0; f < fields; ++f) unsure[f] = std::max(unsure[f], 0.0F) + coded[f];
    return out;
}

}  // namespace htvm::internal
