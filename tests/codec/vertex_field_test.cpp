#include "codec/tracked/vertex_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>

#include "codec/hostile_bytes.h"
#include "codec/intra_test_meshes.h"
#include "codec/tracked/vertex_field_walk.h"
#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm::internal {
namespace {

VertexHierarchy hierarchy_of(const intra_test::Connectivity& mesh, unsigned seed = 1) {
    return build_vertex_hierarchy(intra_test::points(mesh.vertex_count, seed), mesh.triangles).value();
}

// Waves over the vertices, with noise for every second seed; for every seventh only noise, up to the limit.
std::vector<std::int32_t> field(std::size_t vertices, std::size_t components, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::int32_t> values(vertices * components);
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t c = 0; c < components; ++c) {
            const double wave = 200.0 * std::sin(0.02 * static_cast<double>(v) + static_cast<double>(c));
            std::int32_t& value = values[v * components + c];
            value = static_cast<std::int32_t>(wave);
            if (seed % 2) value += test::between(random, -20, 20);
            if (seed % 7 == 6) value = test::between(random, -field_limit, field_limit);
        }
    return values;
}

TEST(LevelPrediction, IsTheSameForSmallAndLargeDifferences) {
    std::mt19937 random(1);
    for (const std::int32_t most : {0, 3, 1000, (1 << 24) - 1, 1 << 24, 2 * most_mean}) {
        std::vector<std::int32_t> now, slope_before;
        LevelPrediction prediction;
        for (int p = 0; p < 37; ++p) {
            now.push_back(p == 0 ? -most : test::between(random, -most, most));
            slope_before.push_back(p == 0 ? most : test::between(random, -most, most));
            prediction.before.push_back(p == 0 ? -most : test::between(random, -most, most));
        }
        prediction.now = now;
        prediction.slope_before = slope_before;
        for (std::uint32_t slope = 0; slope < 8; ++slope)
            for (std::uint32_t before = 0; before <= 4; ++before) {
                const LevelMode mode{.coded = true, .slope = slope, .before = before};
                prediction.choose(mode);
                for (std::size_t p = 0; p < now.size(); ++p) EXPECT_EQ(prediction.chosen[p], prediction.of(p, mode));
            }
    }
}

TEST(SplitMeans, StayWithinTheirLimits) {
    constexpr std::int64_t most = most_mean, far = std::int64_t{1} << 55;
    for (const std::int64_t mean : {-most, std::int64_t{-1}, std::int64_t{0}, most})
        for (const std::int64_t difference : {-far, -2 * most - 1, -2 * most, std::int64_t{-3}, 2 * most, far})
            for (const std::uint32_t share : {0u, 1u << (share_bits - 1), (1u << share_bits) - 1}) {
                const std::int64_t kept = std::clamp(difference, -2 * most, 2 * most);
                const std::int64_t first =
                    mean + ((kept * share + (std::int64_t{1} << (share_bits - 1))) >> share_bits);
                const auto means = split_mean(static_cast<std::int32_t>(mean), difference, share);
                EXPECT_EQ(means.first, std::clamp(first, -most, most));
                EXPECT_EQ(means.second, std::clamp(first - kept, -most, most));
            }
}

FieldOptions options_of(double step, double lambda) { return {.step = {step, step, step}, .lambda = lambda}; }

double largest_difference(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(1.0 * a[i] - b[i]));
    return largest;
}

void expect_same(const FieldHistory& a, const FieldHistory& b) {
    EXPECT_EQ(a.turned, b.turned);
    ASSERT_EQ(a.planes.size(), b.planes.size());
    for (std::size_t c = 0; c < a.planes.size(); ++c) {
        EXPECT_EQ(a.planes[c].mean, b.planes[c].mean);
        EXPECT_EQ(a.planes[c].slope, b.planes[c].slope);
        EXPECT_EQ(a.planes[c].magnitude, b.planes[c].magnitude);
    }
}

Result<DecodedField> decoded_from(std::span<const std::uint8_t> run, const FieldSteps& steps,
                                  const VertexHierarchy& hierarchy, std::size_t components,
                                  const FieldHistory* before = nullptr) {
    RangeDecoder decoder(run);
    return decode_field(decoder, steps, hierarchy, components, before);
}

TEST(VertexField, DecodesToWhatTheEncoderSawWhateverTheMesh) {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const std::size_t components = 1 + seed % 3;
        const VertexHierarchy hierarchy = hierarchy_of(mesh, seed);
        FieldOptions options = options_of(seed % 5 ? 3.0 * (1 + seed % 11) : 0.01, seed % 3 * 0.1);
        options.turned = components == 3 && seed % 4 == 1;
        std::optional<FieldHistory> sent, received;
        for (unsigned frame = 0; frame < 3; ++frame) {
            const auto values = field(mesh.vertex_count, components, seed + (seed % 2 ? frame : 0));
            const auto encoded = encode_field(hierarchy, values, components, options, sent ? &*sent : nullptr);
            ASSERT_TRUE(encoded) << encoded.error().message;
            const auto decoded = decoded_from(encoded->decisions.run(), encoded->steps, hierarchy, components,
                                              received ? &*received : nullptr);
            ASSERT_TRUE(decoded) << decoded.error().message;
            EXPECT_EQ(decoded->values, encoded->values);
            expect_same(decoded->history, encoded->history);
            sent = encoded->history;
            received = decoded->history;
        }
        ++seed;
    }
}

// The largest error of a vertex, in the values' unit, that lambda 0 can leave before values are rounded to whole
// numbers, in a component that is not turned and has this step: about 1.3 steps on meshes of some 30,000 vertices, as
// the errors of a vertex's differences add up. Where it is below 0.5 the coding is lossless.
double field_error_bound(const VertexHierarchy& hierarchy, double step) {
    const auto quantised = static_cast<std::uint32_t>(std::clamp(step, 0.0, 1048576.0) * field_one + 0.5);
    std::vector<double> bound(1, static_cast<double>(root_step(quantised, hierarchy.vertex_count)) / 2 + 0.5);
    for (std::size_t k = hierarchy.levels.size(); k-- > 0;) {
        const HierarchyLevel& level = hierarchy.levels[k];
        const std::size_t finer = k > 0 ? hierarchy.levels[k - 1].size() : hierarchy.vertex_count;
        std::vector<double> below(finer);
        for (std::size_t p = 0; p < level.size(); ++p) {
            below[level.first[p]] = bound[p];
            if (level.second[p] == no_node) continue;
            constexpr double rounding = 2.5;  // of the means in the encoder, of the difference's share and its own
            const double own = static_cast<double>(split_step(quantised, level.split_scale[p])) / 2;
            const double share = static_cast<double>(level.second_share[p]) / (1 << share_bits);
            below[level.first[p]] += own * share + rounding;
            below[level.second[p]] = bound[p] + own * (1 - share) + rounding;
        }
        bound = std::move(below);
    }
    double largest = 0;
    for (const double b : bound) largest = std::max(largest, b);
    return largest / field_one;
}

TEST(VertexField, WithoutLambdaNoVertexIsFurtherOffThanTheBound) {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const VertexHierarchy hierarchy = hierarchy_of(mesh, seed);
        for (const double step : {0.1, 1.0, 7.5, 100.0}) {
            const auto values = field(mesh.vertex_count, 2, seed);
            const auto encoded = encode_field(hierarchy, values, 2, options_of(step, 0));
            ASSERT_TRUE(encoded) << encoded.error().message;
            EXPECT_LE(largest_difference(values, encoded->values), field_error_bound(hierarchy, step) + 0.5);
        }
        ++seed;
    }
}

TEST(VertexField, IsLosslessWhereTheBoundIsBelowAHalf) {
    const auto mesh = intra_test::grid(20);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    constexpr double step = 0.125;
    ASSERT_LT(field_error_bound(hierarchy, step), 0.5);
    for (unsigned seed = 0; seed < 8; ++seed) {
        const auto values = field(mesh.vertex_count, 3, seed);
        EXPECT_EQ(encode_field(hierarchy, values, 3, options_of(step, 0))->values, values);
    }
}

TEST(VertexField, TheBoundGrowsWithTheStepAndStaysAFewSteps) {
    const auto mesh = intra_test::grid(63);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    EXPECT_LT(field_error_bound(hierarchy, 4), field_error_bound(hierarchy, 8));
    EXPECT_LT(field_error_bound(hierarchy, 32), 3 * 32);
    EXPECT_GT(field_error_bound(hierarchy, 32), 16);
}

TEST(VertexField, AFieldOfZerosCostsAboutAByteALevel) {
    const auto mesh = intra_test::grid(63);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const std::vector<std::int32_t> values(mesh.vertex_count, 0);
    const auto encoded = encode_field(hierarchy, values, 1);
    EXPECT_EQ(encoded->values, values);
    EXPECT_LE(encoded->decisions.run().size(), 12u);
}

TEST(VertexField, NoiseBelowTheStepCostsNextToNothing) {
    const auto mesh = intra_test::grid(100);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    std::mt19937 random(1);
    std::vector<std::int32_t> values(mesh.vertex_count);
    for (auto& value : values) value = test::between(random, -12, 12);
    const auto encoded = encode_field(hierarchy, values, 1, options_of(32, 0.15));
    EXPECT_LT(encoded->decisions.bits(), 0.01 * static_cast<double>(mesh.vertex_count));
}

TEST(VertexField, AHigherLambdaSparesBits) {
    const auto mesh = intra_test::grid(63);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const auto values = field(mesh.vertex_count, 1, 1);
    const auto exact = encode_field(hierarchy, values, 1, options_of(16, 0));
    const auto spared = encode_field(hierarchy, values, 1, options_of(16, 0.2));
    EXPECT_LT(spared->decisions.bits(), exact->decisions.bits());
}

TEST(VertexField, ARepeatedFrameCostsNextToNothing) {
    const auto mesh = intra_test::grid(63);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const auto values = field(mesh.vertex_count, 1, 1);
    const auto first = encode_field(hierarchy, values, 1, options_of(8, 0.1));
    const auto second = encode_field(hierarchy, values, 1, options_of(8, 0.1), &first->history);
    EXPECT_LT(second->decisions.bits() * 10, first->decisions.bits());
}

TEST(VertexField, HasTheSameDecisionsFromTwoThreadsAndDoesTheOtherWorkBesideOnce) {
    const auto mesh = intra_test::grid(40);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    for (std::size_t components = 1; components <= 3; ++components)
        for (const double middle : {6.0, 0.0}) {
            const FieldOptions options{.step = {6, middle, 6}};
            const auto first = encode_field(hierarchy, field(mesh.vertex_count, components, 1), components, options);
            const auto values = field(mesh.vertex_count, components, 3);
            const auto alone = encode_field(hierarchy, values, components, options, &first->history);
            for (const unsigned threads : {1u, 2u, 4u}) {
                int beside = 0;
                const auto both = encode_field(hierarchy, values, components, options, &first->history,
                                               ThreadPool(threads), [&] { ++beside; });
                EXPECT_EQ(both->decisions.run(), alone->decisions.run());
                expect_same(both->history, alone->history);
                EXPECT_EQ(beside, 1);
            }
        }
}

TEST(VertexField, HandsOnWhatTheOtherWorkThrows) {
    const auto mesh = intra_test::grid(10);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const auto values = field(mesh.vertex_count, 3, 1);
    for (const unsigned threads : {1u, 2u})
        EXPECT_THROW(static_cast<void>(encode_field(hierarchy, values, 3, {}, nullptr, ThreadPool(threads),
                                                    [] { throw std::runtime_error("other work"); })),
                     std::runtime_error);
}

TEST(VertexField, AComponentOfStepZeroIsNotCoded) {
    const auto mesh = intra_test::grid(10);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const auto values = field(mesh.vertex_count, 2, 1);
    const auto encoded = encode_field(hierarchy, values, 2, {.step = {4, 0, 0}, .lambda = 0});
    for (std::size_t v = 0; v < mesh.vertex_count; ++v) EXPECT_EQ(encoded->values[v * 2 + 1], 0);
    EXPECT_LE(largest_difference(values, encoded->values), 300);
}

TEST(VertexField, NoVerticesTakeNothing) {
    const VertexHierarchy hierarchy;
    const auto encoded = encode_field(hierarchy, {}, 3);
    ASSERT_TRUE(encoded);
    EXPECT_TRUE(encoded->decisions.run().empty());
    RangeDecoder nothing({});
    EXPECT_TRUE(decode_field(nothing, encoded->steps, hierarchy, 3)->values.empty());
}

TEST(VertexField, RefusesWhatDoesNotFit) {
    const auto mesh = intra_test::grid(4);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const std::vector<std::int32_t> values(mesh.vertex_count, 0), beyond(mesh.vertex_count, field_limit + 1);
    EXPECT_FALSE(encode_field(hierarchy, values, 0));
    EXPECT_FALSE(encode_field(hierarchy, values, 4));
    EXPECT_FALSE(encode_field(hierarchy, values, 2));
    EXPECT_FALSE(encode_field(hierarchy, beyond, 1));
    EXPECT_FALSE(encode_field(hierarchy, values, 1, {.turned = true}));
    EXPECT_FALSE(encode_field(hierarchy, values, 1, options_of(-1, 0)));
    EXPECT_FALSE(encode_field(hierarchy, values, 1, options_of(1e9, 0)));
    EXPECT_FALSE(encode_field(hierarchy, values, 1, options_of(std::nan(""), 0)));
    EXPECT_FALSE(encode_field(hierarchy, values, 1, options_of(1, -1)));
    const FieldHistory other;
    EXPECT_FALSE(encode_field(hierarchy, values, 1, {}, &other));
}

TEST(VertexField, AForeignFrameBeforeIsAnError) {
    const auto mesh = intra_test::grid(6);
    const VertexHierarchy hierarchy = hierarchy_of(mesh), other = hierarchy_of(intra_test::grid(7));
    const auto values = field(mesh.vertex_count, 1, 1);
    const auto first = encode_field(hierarchy, values, 1);
    const auto second = encode_field(hierarchy, values, 1, {}, &first->history);
    const auto foreign = encode_field(other, field(other.vertex_count, 1, 1), 1);
    const auto run = second->decisions.run();
    EXPECT_EQ(decoded_from(run, second->steps, hierarchy, 1, &foreign->history).error().kind, ErrorKind::bad_input);
}

TEST(VertexField, DamagedBytesGiveErrorsOrBoundedValues) {
    for (const std::size_t components : {1u, 3u}) {
        const auto mesh = intra_test::grid(15);
        const VertexHierarchy hierarchy = hierarchy_of(mesh);
        FieldOptions options = options_of(8, 0.1);
        options.turned = components == 3;
        const auto first = encode_field(hierarchy, field(mesh.vertex_count, components, 1), components, options);
        const auto second =
            encode_field(hierarchy, field(mesh.vertex_count, components, 3), components, options, &first->history);
        hostile::try_everything(second->decisions.run(), [&](const std::vector<std::uint8_t>& bytes) {
            const auto decoded = decoded_from(bytes, second->steps, hierarchy, components, &first->history);
            if (!decoded) return;
            for (const std::int32_t value : decoded->values) EXPECT_LE(std::abs(value), 4 * field_limit);
        });
    }
}

TEST(VertexField, DecodesToTheSameOnEveryMachine) {
    const auto mesh = intra_test::grid(30);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    std::uint32_t digest = 0;
    std::optional<FieldHistory> before;
    for (unsigned frame = 0; frame < 4; ++frame) {
        // Bytes that no encoder wrote but that form a field all the same.
        const FieldSteps steps{.turned = true, .step = {4096, 4096, 4096}};
        std::vector<std::uint8_t> bytes;
        std::mt19937 random(frame);
        for (int i = 0; i < 8000; ++i) bytes.push_back(static_cast<std::uint8_t>(random()));
        auto decoded = decoded_from(bytes, steps, hierarchy, 3, before ? &*before : nullptr);
        ASSERT_TRUE(decoded) << decoded.error().message;
        ByteWriter writer;
        writer.u32(digest);
        for (const std::int32_t value : decoded->values) writer.signed_varint(value);
        digest = crc32(writer.data());
        before = std::move(decoded->history);
    }
    EXPECT_EQ(digest, 2382717585u);
}

TEST(VertexField, AShortenedRunIsAnError) {
    const auto mesh = intra_test::grid(15);
    const VertexHierarchy hierarchy = hierarchy_of(mesh);
    const auto encoded = encode_field(hierarchy, field(mesh.vertex_count, 1, 1), 1, options_of(1, 0));
    auto half = encoded->decisions.run();
    half.resize(half.size() / 2);
    EXPECT_EQ(decoded_from(half, encoded->steps, hierarchy, 1).error().kind, ErrorKind::corrupt_stream);
    EXPECT_EQ(decoded_from({}, encoded->steps, hierarchy, 1).error().kind, ErrorKind::corrupt_stream);
}

}  // namespace
}  // namespace htvm::internal
