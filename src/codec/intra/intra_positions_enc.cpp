#include <cmath>
#include <memory>

#include "codec/intra/intra_position_walk.h"
#include "codec/intra/intra_positions.h"
#include "core/bytes.h"
#include "entropy/range_encoder.h"

namespace htvm::internal {

namespace {

using Matrix = std::array<std::array<double, weight_count + 1>, weight_count>;  // normal equations, right side last

// Solves the normal equations by elimination; a direction that the data leave open gets the weight 0.
std::array<double, weight_count> solve(Matrix m) {
    std::array<double, weight_count> scale{};
    for (std::size_t i = 0; i < weight_count; ++i) scale[i] = m[i][i];
    std::array<bool, weight_count> open{};
    for (std::size_t i = 0; i < weight_count; ++i) {
        open[i] = !(m[i][i] > 1e-9 * (scale[i] + 1));
        if (open[i]) continue;
        for (std::size_t row = 0; row < weight_count; ++row) {
            if (row == i) continue;
            const double factor = m[row][i] / m[i][i];
            for (std::size_t column = 0; column <= weight_count; ++column) m[row][column] -= factor * m[i][column];
        }
    }
    std::array<double, weight_count> weights{};
    for (std::size_t i = 0; i < weight_count; ++i) weights[i] = open[i] ? 0.0 : m[i][weight_count] / m[i][i];
    return weights;
}

// Least squares over the frame, each vertex weighted by the inverse square of its surroundings' extent and of how far
// the usual weights leave it, so that neither large triangles nor outliers rule; pulled towards the usual weights,
// those of most captures, which decide where there are few vertices.
PositionWeights fit_weights(std::span<const LatticePoint> q, const Neighbours& neighbours) {
    constexpr std::array<std::array<double, weight_count>, 2> usual{{{0.5, 0.0, -0.4}, {0.46, 0.21, -0.2}}};
    std::array<Matrix, 2> equations{};
    PositionHistory history(q.size());
    for (std::size_t rank = 0; rank < q.size(); ++rank) {
        const PositionFeatures f = position_features(q, neighbours, rank, history);
        if (f.parallelograms == 0) continue;
        const LatticePoint p = q[neighbours.order[rank]];
        const std::array<double, 3> actual{16.0 * p.x, 16.0 * p.y, 16.0 * p.z};
        std::array<std::array<double, weight_count>, 3> feature{};
        double extent = 256;
        for (std::size_t c = 0; c < 3; ++c) {
            feature[c] = {static_cast<double>(f.across[c]), static_cast<double>(f.ending[c]),
                          static_cast<double>(f.outer[c])};
            extent += 0.25 * (feature[c][0] * feature[c][0] + feature[c][1] * feature[c][1]);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            double left = actual[c] - static_cast<double>(f.mean[c]);
            for (std::size_t i = 0; i < weight_count; ++i) left -= usual[f.has_ending][i] * feature[c][i];
            extent += left * left;
        }
        Matrix& m = equations[f.has_ending];
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < weight_count; ++i) {
                const double scaled = feature[c][i] / extent;
                for (std::size_t j = 0; j < weight_count; ++j) m[i][j] += scaled * feature[c][j];
                m[i][weight_count] += scaled * (actual[c] - static_cast<double>(f.mean[c]));
            }
    }
    PositionWeights weights{};
    for (std::size_t set = 0; set < 2; ++set) {
        for (std::size_t i = 0; i < weight_count; ++i) {
            constexpr double pull = 4;
            equations[set][i][i] += pull;
            equations[set][i][weight_count] += pull * usual[set][i];
        }
        const auto fitted = solve(equations[set]);
        for (std::size_t i = 0; i < weight_count; ++i)
            weights[set][i] = static_cast<std::int8_t>(std::lround(std::clamp(fitted[i] * 64, -127.0, 127.0)));
    }
    return weights;
}

}  // namespace

std::vector<std::uint8_t> encode_intra_positions(std::span<const LatticePoint> q, const Neighbours& neighbours) {
    if (q.empty()) return {};
    const PositionWeights weights = fit_weights(q, neighbours);
    ByteWriter writer;
    for (const auto& set : weights)
        for (const std::int8_t weight : set) writer.u8(static_cast<std::uint8_t>(weight));
    RangeEncoder encoder;
    PositionHistory history(q.size());
    const auto contexts = std::make_unique<PositionContexts>();
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t residual) {
        encode_residual(encoder, a, b, mantissa, residual);
        return residual;
    };
    std::vector<LatticePoint> points(q.begin(), q.end());
    for (std::size_t rank = 0; rank < q.size(); ++rank) {
        const PositionFeatures features = position_features(points, neighbours, rank, history);
        code_position(points, neighbours, rank, features, weights, history, *contexts, code);
    }
    writer.bytes(encoder.finish());
    return writer.take();
}

}  // namespace htvm::internal
