#include "codec/reference/transforms.h"

#include <gtest/gtest.h>

#include <random>

#include "codec/hostile_bytes.h"
#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

QuantisedRotation random_rotation(std::mt19937& random) {
    QuantisedRotation out;
    out.largest = static_cast<std::uint8_t>(random() % 4);
    const auto reach = static_cast<std::int32_t>(1u << (random() % (rotation_bits + 1)));
    for (auto& c : out.others) c = static_cast<std::int16_t>(test::between(random, -reach, reach));
    return out;
}

LatticePoint random_point(std::int32_t reach, std::mt19937& random) {
    const auto c = [&] { return test::between(random, -reach, reach); };
    return {c(), c(), c()};
}

std::vector<QuantisedTransform> random_transforms(std::size_t bones, std::mt19937& random) {
    std::vector<QuantisedTransform> out(bones);
    for (auto& t : out)
        if (random() % 4 > 0) t = {random_rotation(random), random_point(1 << random() % 25, random)};
    return out;
}

CodedPose random_pose(std::size_t joints, std::size_t bones, std::mt19937& random) {
    CodedPose out;
    for (std::size_t k = 0; k < joints; ++k) out.joints.push_back(random_point(1 << random() % 25, random));
    for (std::size_t i = 0; i < bones; ++i) out.orientations.push_back(random_rotation(random));
    return out;
}

TEST(Transforms, ComeBack) {
    std::mt19937 random(1);
    for (const std::size_t bones : {0u, 1u, 14u, 1024u})
        for (int i = 0; i < 20; ++i) {
            const auto transforms = random_transforms(bones, random);
            const auto decoded = decode_transforms(encode_transforms(transforms), bones);
            ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
            EXPECT_EQ(*decoded, transforms);
        }
}

TEST(Transforms, ExtremesComeBack) {
    constexpr std::int16_t most = 1 << rotation_bits;
    const std::vector<QuantisedTransform> transforms = {
        {{3, {most, -most, most}}, {lattice_limit, -lattice_limit, lattice_limit}},
        {},
        {{0, {0, 0, 0}}, {0, 0, 1}},
        {{0, {-most, -most, -most}}, {-lattice_limit, -lattice_limit, -lattice_limit}}};
    EXPECT_EQ(*decode_transforms(encode_transforms(transforms), transforms.size()), transforms);
}

TEST(Transforms, AStandingBodyCostsAByteOrTwo) {
    EXPECT_LE(encode_transforms(std::vector<QuantisedTransform>(14)).size(), 2u);
}

TEST(Transforms, DamageGivesAnErrorOrTransformsInRange) {
    std::mt19937 random(2);
    const auto transforms = random_transforms(14, random);
    hostile::try_everything(encode_transforms(transforms), [](const std::vector<std::uint8_t>& bytes) {
        const auto decoded = decode_transforms(bytes, 14);
        if (!decoded) {
            EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
            return;
        }
        ASSERT_EQ(decoded->size(), 14u);
        for (const auto& t : *decoded) {
            EXPECT_LT(t.rotation.largest, 4);
            for (const auto c : t.rotation.others) EXPECT_LE(std::abs(c), 1 << rotation_bits);
            for (const auto c : {t.shift.x, t.shift.y, t.shift.z}) EXPECT_LE(std::abs(c), 2 * lattice_limit);
        }
    });
}

TEST(BlendedMove, IsTheWeightedMeanOfWhatEachTransformDoesExactly) {
    std::mt19937 random(1);
    for (int round = 0; round < 2000; ++round) {
        const auto transforms = random_transforms(handles_per_vertex, random);
        const std::int32_t reach = 1 << random() % 25;
        std::vector<LatticePoint> pivots;
        for (std::size_t i = 0; i < transforms.size(); ++i) pivots.push_back(random_point(reach, random));
        VertexWeights weights;
        int left = 1 << weight_bits;
        for (std::size_t i = 0; i < handles_per_vertex; ++i) {
            weights.handle[i] = static_cast<std::uint16_t>(i);
            const int weight = i + 1 == handles_per_vertex ? left : test::between(random, 0, left);
            weights.weight[i] = static_cast<std::uint16_t>(weight);
            left -= weight;
            if (weight == 0) break;
        }
        weights.weight[0] = static_cast<std::uint16_t>(weights.weight[0] + left);
        const auto point = random_point(reach, random);
        std::array<std::int64_t, 3> sum{};
        for (std::size_t i = 0; i < handles_per_vertex && weights.weight[i] > 0; ++i) {
            const auto m = rotation_matrix(transforms[i].rotation);
            const LatticePoint from = point - pivots[i], to = pivots[i] + transforms[i].shift;
            const std::array<std::int32_t, 3> place{to.x, to.y, to.z};
            for (std::size_t c = 0; c < 3; ++c)
                sum[c] += weights.weight[i] * ((std::int64_t{place[c]} << matrix_bits) + m[3 * c] * from.x +
                                               m[3 * c + 1] * from.y + m[3 * c + 2] * from.z);
        }
        constexpr int bits = matrix_bits + weight_bits;
        const auto rounded = [&](std::size_t c) {
            return within_lattice((sum[c] + (std::int64_t{1} << (bits - 1))) >> bits);
        };
        EXPECT_EQ(blended_move(point, weights, point_moves(transforms, pivots)),
                  (LatticePoint{rounded(0), rounded(1), rounded(2)}));
    }
}

TEST(CodedPose, ComesBack) {
    std::mt19937 random(3);
    for (const auto& [joints, bones] :
         std::vector<std::pair<std::size_t, std::size_t>>{{0, 0}, {2, 1}, {15, 14}, {1, 5}, {1024, 1024}}) {
        const auto pose = random_pose(joints, bones, random);
        const auto decoded = decode_pose(encode_pose(pose), joints, bones);
        ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
        EXPECT_EQ(decoded->joints, pose.joints);
        EXPECT_EQ(decoded->orientations, pose.orientations);
    }
}

TEST(CodedPose, JointsAtOppositeCornersOfTheLatticeComeBack) {
    CodedPose pose;
    for (int i = 0; i < 4; ++i) {
        const std::int32_t c = i % 2 ? lattice_limit : -lattice_limit;
        pose.joints.push_back({c, -c, c});
    }
    EXPECT_EQ(decode_pose(encode_pose(pose), 4, 0)->joints, pose.joints);
}

TEST(CodedPose, DamageGivesAnErrorOrJointsOnTheLattice) {
    std::mt19937 random(4);
    const auto pose = random_pose(15, 14, random);
    hostile::try_everything(encode_pose(pose), [](const std::vector<std::uint8_t>& bytes) {
        const auto decoded = decode_pose(bytes, 15, 14);
        if (!decoded) {
            EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
            return;
        }
        ASSERT_EQ(decoded->joints.size(), 15u);
        ASSERT_EQ(decoded->orientations.size(), 14u);
        for (const auto joint : decoded->joints) EXPECT_TRUE(on_lattice(joint));
    });
}

}  // namespace
}  // namespace htvm::internal
