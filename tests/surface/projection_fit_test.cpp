// One camera's projection, found in pairs of position and texture coordinates; and not found where there is none.
#include "surface/projection_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace htvm::internal {
namespace {

struct Pairs {
    std::vector<Eigen::Vector3d> positions;
    std::vector<Vector2f> texcoords;
    FilmPairs view() const { return {positions, texcoords, 640, 480}; }
};

// A camera at 0.8 m from a surface in relief, turned so that no axis is its own, and far from the origin.
ProjectionMatrix any_camera() {
    const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, 3).normalized());
    ProjectionMatrix out;
    out.leftCols<3>() = turn.toRotationMatrix();
    out.col(3) = out.leftCols<3>() * -Eigen::Vector3d(300, -900, 1500) + Eigen::Vector3d(0, 0, 800);
    Eigen::Matrix3d film;
    film << 1.1, 0, 0.5, 0, 1.4, 0.5, 0, 0, 1;
    return film * out;
}

Pairs seen_by(const ProjectionMatrix& camera, double noise = 0, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> across(-250, 250);
    std::normal_distribution<double> error(0, 1);
    const Eigen::Matrix3d back = camera.leftCols<3>().inverse();
    Pairs out;
    for (int i = 0; i < 3000; ++i) {
        const double x = across(random), y = across(random);
        const double depth = 800 + 60 * std::sin(x / 50) * std::cos(y / 70);
        const double u = 0.5 + 1.1 * x / 800, v = 0.5 + 1.4 * y / 800;
        out.positions.push_back(back * (depth * Eigen::Vector3d(u, v, 1) - camera.col(3)));
        out.texcoords.push_back(
            {static_cast<float>(u + noise * error(random) / 640), static_cast<float>(v + noise * error(random) / 480)});
    }
    return out;
}

// The largest distance between where two projections put the points, pixels.
double apart(const ProjectionMatrix& a, const ProjectionMatrix& b, const Pairs& pairs) {
    double out = 0;
    for (const auto& p : pairs.positions) {
        const Eigen::Vector3d at = a * p.homogeneous(), other = b * p.homogeneous();
        out = std::max({out, 640 * std::abs(at[0] / at[2] - other[0] / other[2]),
                        480 * std::abs(at[1] / at[2] - other[1] / other[2])});
    }
    return out;
}

TEST(ProjectionFit, FindsTheCameraToWhatSinglePrecisionLeaves) {
    const auto pairs = seen_by(any_camera());
    const auto found = fit_projection(pairs.view());
    ASSERT_TRUE(found);
    EXPECT_LT(apart(*found, any_camera(), pairs), 0.001);
    EXPECT_GT((found->row(2) * pairs.positions[0].homogeneous())(0), 0) << "what was seen is before the camera";
}

TEST(ProjectionFit, AveragesWhatCoordinatesAreRoundedTo) {
    const auto pairs = seen_by(any_camera(), 0.2);
    const auto found = fit_projection(pairs.view());
    ASSERT_TRUE(found);
    EXPECT_LT(apart(*found, any_camera(), pairs), 0.06);
}

TEST(ProjectionFit, IsNotMovedByOneInThirtyThatLiesElsewhere) {
    auto pairs = seen_by(any_camera());
    for (std::size_t i = 0; i < pairs.texcoords.size(); i += 30) pairs.texcoords[i] = {0.3f, 0.9f};
    const auto found = fit_projection(pairs.view());
    ASSERT_TRUE(found);
    EXPECT_LT(apart(*found, any_camera(), pairs), 0.001);
}

TEST(ProjectionFit, PassesOverCoordinatesThatWereCutOffAtTheBorderHoweverMany) {
    auto pairs = seen_by(any_camera());
    for (std::size_t i = 0; i < pairs.texcoords.size(); i += 3) pairs.texcoords[i][1] = 1;
    const auto found = fit_projection(pairs.view());
    ASSERT_TRUE(found);
    EXPECT_LT(apart(*found, any_camera(), pairs), 0.001);
}

TEST(ProjectionFit, TakesNoAtlasForAProjection) {
    // Two charts, each a projection of its own.
    auto atlas = seen_by(any_camera());
    for (std::size_t i = 0; i < atlas.texcoords.size(); i += 2)
        atlas.texcoords[i] = {1 - atlas.texcoords[i][1], atlas.texcoords[i][0]};
    EXPECT_FALSE(fit_projection(atlas.view()));
    auto bent = seen_by(any_camera());
    for (auto& t : bent.texcoords) t[0] *= t[0];
    EXPECT_FALSE(fit_projection(bent.view()));
}

TEST(ProjectionFit, FindsNothingInTooFewPairsOrInOnesThatAreAllCutOff) {
    auto pairs = seen_by(any_camera());
    for (auto& t : pairs.texcoords) t[0] = 0;
    EXPECT_FALSE(fit_projection(pairs.view()));
    pairs = seen_by(any_camera());
    pairs.positions.resize(20);
    pairs.texcoords.resize(20);
    EXPECT_FALSE(fit_projection(pairs.view()));
    EXPECT_FALSE(fit_projection({}));
}

TEST(ProjectionFit, KeepsTheOneBeforeWhileThatIsAsGoodAndFollowsACameraThatMoves) {
    const auto first = seen_by(any_camera(), 0.2, 1), second = seen_by(any_camera(), 0.2, 2);
    const auto found = fit_projection(first.view());
    ASSERT_TRUE(found);
    const auto kept = follow_projection(*found, second.view());
    ASSERT_TRUE(kept);
    EXPECT_EQ(*kept, *found);
    auto moved_camera = any_camera();
    moved_camera(0, 3) += 10;
    const auto moved = seen_by(moved_camera, 0.2, 3);
    const auto followed = follow_projection(*found, moved.view());
    ASSERT_TRUE(followed);
    EXPECT_LT(apart(*followed, moved_camera, moved), 0.06);
}

}  // namespace
}  // namespace htvm::internal
