// The synthetic capture as its users see it.
#include "synth/synth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "synth/body.h"
#include "synth/motion.h"

namespace htvm {
namespace {

bool same(const SynthFrame& a, const SynthFrame& b) {
    return a.mesh.positions == b.mesh.positions && a.mesh.triangles == b.mesh.triangles &&
           a.mesh.colours == b.mesh.colours && a.mesh.normals == b.mesh.normals && a.pose.joints == b.pose.joints &&
           a.true_pose.joints == b.true_pose.joints;
}

SynthOptions small(int vertices = 1500) {
    SynthOptions options;
    options.vertices = vertices;
    return options;
}

// Whether each directed edge appears once, and its opposite once too.
bool closed_manifold_edges(const Mesh& mesh) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t c = 0; c < 3; ++c)
            if (!edges.emplace(t[c], t[(c + 1) % 3]).second) return false;
    return std::ranges::all_of(edges, [&](const auto& edge) { return edges.contains({edge.second, edge.first}); });
}

double volume(const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        sum += a[0] * (double{b[1]} * c[2] - double{b[2]} * c[1]) - a[1] * (double{b[0]} * c[2] - double{b[2]} * c[0]) +
               a[2] * (double{b[0]} * c[1] - double{b[1]} * c[0]);
    }
    return sum / 6;
}

// The number of vertices on the edges and diagonals of an axis-aligned grid through the origin.
std::size_t vertices_on_grid(const Mesh& mesh, double cell) {
    std::size_t count = 0;
    for (const auto& p : mesh.positions) {
        std::vector<double> shares;
        for (const float coordinate : p) {
            const double share = coordinate / cell - std::floor(coordinate / cell);
            if (share > 1e-3 && share < 1 - 1e-3) shares.push_back(share);
        }
        const auto [low, high] = std::ranges::minmax_element(shares);
        if (shares.empty() || *high - *low < 2e-3) ++count;
    }
    return count;
}

TEST(Synth, SameOptionsGiveTheSameFrame) {
    SynthOptions options = small();
    options.normals = true;
    for (const int frame : {0, 31, 200}) EXPECT_TRUE(same(synth_frame(options, frame), synth_frame(options, frame)));
}

TEST(Synth, AFrameDoesNotDependOnTheNumberOfThreads) {
    SynthOptions options = small(6000);
    options.normals = true;
    const SynthFrame one = synth_frame(options, 17);
    for (const unsigned threads : {2u, 3u, 8u})
        EXPECT_TRUE(same(one, synth_frame(options, 17, internal::ThreadPool(threads))));
}

TEST(Synth, AnotherSeedChangesMeshAndNoiseButNotTheMotion) {
    SynthOptions a = small(), b = small();
    b.seed = 2;
    const SynthFrame one = synth_frame(a, 20), other = synth_frame(b, 20);
    EXPECT_EQ(one.true_pose.joints, other.true_pose.joints);
    EXPECT_NE(one.pose.joints, other.pose.joints);
    EXPECT_NE(one.mesh.positions, other.mesh.positions);
    EXPECT_NE(one.mesh.triangles, other.mesh.triangles);
}

TEST(Synth, VertexCountsAreWithinThreePercentOfTheCountAskedFor) {
    for (const int vertices : {150, 500, 4000, 35000})
        for (const int frame : {0, 45, 150}) {
            const auto found = static_cast<double>(synth_frame(small(vertices), frame).mesh.positions.size());
            EXPECT_NEAR(found, vertices, 0.03 * vertices + 1) << "frame " << frame;
        }
}

TEST(Synth, EveryFrameIsMeshedAnew) {
    std::set<std::size_t> counts;
    for (int frame = 0; frame < 6; ++frame) counts.insert(synth_frame(small(4000), frame).mesh.positions.size());
    EXPECT_GE(counts.size(), 5u);
}

TEST(Synth, MeshesAreClosedManifoldsOfTheVolumeOfAPerson) {
    for (const int vertices : {500, 6000})
        for (const int frame : {0, 10, 60, 115, 170, 222}) {
            const Mesh mesh = synth_frame(small(vertices), frame).mesh;
            for (const auto& t : mesh.triangles)
                for (const auto v : t) ASSERT_LT(v, mesh.positions.size());
            EXPECT_TRUE(closed_manifold_edges(mesh)) << vertices << " vertices, frame " << frame;
            EXPECT_GT(volume(mesh), 60e6) << "mm^3, frame " << frame;
            EXPECT_LT(volume(mesh), 110e6) << "mm^3, frame " << frame;
        }
}

TEST(Synth, EveryVertexIsUsedAndEveryAttributeIsAsLongAsThePositions) {
    SynthOptions options = small();
    options.normals = true;
    const Mesh mesh = synth_frame(options, 12).mesh;
    std::set<std::uint32_t> used;
    for (const auto& t : mesh.triangles) used.insert(t.begin(), t.end());
    EXPECT_EQ(used.size(), mesh.positions.size());
    EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const auto& n : mesh.normals) EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1.0, 1e-5);
    options.normals = options.colours = false;
    const Mesh bare = synth_frame(options, 12).mesh;
    EXPECT_TRUE(bare.colours.empty() && bare.normals.empty());
    EXPECT_EQ(bare.positions, mesh.positions);
}

TEST(Synth, TrianglesAreWellShapedWithSixAtAVertex) {
    const Mesh mesh = synth_frame(small(6000), 30).mesh;
    const double valence =
        3.0 * static_cast<double>(mesh.triangles.size()) / static_cast<double>(mesh.positions.size());
    EXPECT_NEAR(valence, 6.0, 0.02);
    double lengths = 0, squares = 0;
    for (const auto& t : mesh.triangles)
        for (std::size_t c = 0; c < 3; ++c) {
            const auto &a = mesh.positions[t[c]], &b = mesh.positions[t[(c + 1) % 3]];
            const double length = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
            lengths += length;
            squares += length * length;
        }
    const double count = 3.0 * static_cast<double>(mesh.triangles.size()), mean = lengths / count;
    EXPECT_LT(std::sqrt(squares / count - mean * mean), 0.3 * mean);
}

TEST(Synth, TheFirstFrameIsATPose) {
    const Pose pose = synth_frame(small(), 0).true_pose;
    const auto& j = pose.joints;
    ASSERT_EQ(j.size(), synth_skeleton().joint_names.size());
    for (const std::size_t arm : {4, 5, 7, 8}) EXPECT_NEAR(j[arm][1], j[3][1], 5.0);  // arms level with the shoulder
    EXPECT_GT(j[5][0], 650);  // the left hand far to the left, at +x
    EXPECT_LT(j[8][0], -650);
    EXPECT_NEAR(j[10][0], j[9][0], 10);  // legs straight down
    EXPECT_NEAR(j[11][1], 85, 10);
    EXPECT_GT(j[0][1], 1600);
}

TEST(Synth, ThePersonIsAsTallAsAnAdultAndStandsOnTheGround) {
    SynthOptions options = small(6000);
    options.surface_noise_power = 0;
    const Mesh mesh = synth_frame(options, 0).mesh;
    float low = std::numeric_limits<float>::max(), high = -low;
    for (const auto& p : mesh.positions) {
        low = std::min(low, p[1]);
        high = std::max(high, p[1]);
    }
    EXPECT_NEAR(high, 1750, 15);
    EXPECT_NEAR(low, 0, 6);
}

TEST(Synth, TheSkeletonHasFifteenJointsAndFourteenBonesThatJoinThem) {
    const Skeleton skeleton = synth_skeleton();
    EXPECT_EQ(skeleton.joint_names.size(), 15u);
    EXPECT_EQ(skeleton.bones.size(), 14u);
    std::set<std::uint16_t> reached;
    for (const auto& bone : skeleton.bones) reached.insert({bone.first, bone.second});
    EXPECT_EQ(reached.size(), 15u);
}

TEST(Synth, JointNoiseHasThePowerAskedForInEveryCoordinate) {
    for (const double power : {25.0, 80.0}) {
        SynthOptions options = small(150);
        options.joint_noise_power = power;
        double sum = 0, squares = 0, count = 0;
        for (int frame = 0; frame < 40; ++frame) {
            const SynthFrame made = synth_frame(options, frame);
            for (std::size_t j = 0; j < made.pose.joints.size(); ++j)
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const double error = made.pose.joints[j][axis] - made.true_pose.joints[j][axis];
                    sum += error;
                    squares += error * error;
                    ++count;
                }
        }
        EXPECT_NEAR(squares / count, power, 0.12 * power);
        EXPECT_NEAR(sum / count, 0, 4 * std::sqrt(power / count));
    }
}

TEST(Synth, SurfaceNoiseHasThePowerAskedForAndIsNewInEveryFrame) {
    SynthOptions noisy = small(4000), exact = noisy;
    noisy.surface_noise_power = 4.0;
    exact.surface_noise_power = 0.0;
    const Mesh a = synth_frame(noisy, 3).mesh, b = synth_frame(exact, 3).mesh;
    ASSERT_EQ(a.triangles, b.triangles);
    double squares = 0;
    for (std::size_t v = 0; v < a.positions.size(); ++v)
        for (std::size_t axis = 0; axis < 3; ++axis)
            squares += std::pow(a.positions[v][axis] - b.positions[v][axis], 2);
    EXPECT_NEAR(squares / static_cast<double>(a.positions.size()), 4.0, 0.01);
}

TEST(Synth, WithoutNoiseEveryVertexIsOnTheSurface) {
    for (const int vertices : {4000, 35000}) {
        SynthOptions options = small(vertices);
        options.surface_noise_power = 0;
        const Mesh mesh = synth_frame(options, 12).mesh;
        const synth::PosedScene scene = synth::scene_of(synth::pose_body(12 / options.fps));
        std::size_t away = 0;
        for (const auto& p : mesh.positions) {
            const double distance = synth::evaluate_surface(scene, scene.present, {p[0], p[1], p[2]}).distance;
            EXPECT_LT(std::abs(distance), 8.0) << "mm";
            if (std::abs(distance) > 0.5) ++away;
        }
        EXPECT_LT(away, mesh.positions.size() / 50);
    }
}

TEST(Synth, WithoutNoisePoseAndTruePoseAgree) {
    SynthOptions options = small();
    options.joint_noise_power = 0;
    const SynthFrame frame = synth_frame(options, 50);
    EXPECT_EQ(frame.pose.joints, frame.true_pose.joints);
}

TEST(Synth, VerticesKeepToTheGridOnlyIfTheLatticeIsAskedFor) {
    SynthOptions options = small(5000);
    const double cell = synth_lattice_cell(options);
    for (const int frame : {0, 40}) {
        options.lattice = false;
        const Mesh free = synth_frame(options, frame).mesh;
        EXPECT_LT(vertices_on_grid(free, cell), free.positions.size() / 20);
        options.lattice = true;
        const Mesh lattice = synth_frame(options, frame).mesh;
        EXPECT_EQ(vertices_on_grid(lattice, cell), lattice.positions.size());
        EXPECT_NEAR(static_cast<double>(lattice.positions.size()), 5000, 500);
        EXPECT_TRUE(closed_manifold_edges(lattice));
    }
}

TEST(Synth, TheFrameRateChangesTheSpeedOfTheFramesNotOfTheMotion) {
    SynthOptions slow = small(150), fast = small(150);
    fast.fps = 60;
    EXPECT_EQ(synth_frame(slow, 20).true_pose.joints, synth_frame(fast, 40).true_pose.joints);
}

TEST(Synth, OptionsOutOfRangeAreNamedAndDoNotCrash) {
    EXPECT_TRUE(check_synth_options({}).has_value());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<SynthOptions> wrong(6);
    wrong[0].vertices = 0;
    wrong[1].vertices = std::numeric_limits<int>::max();
    wrong[2].fps = 0;
    wrong[3].fps = nan;
    wrong[4].surface_noise_power = -1;
    wrong[5].joint_noise_power = nan;
    for (auto& options : wrong) {
        const auto checked = check_synth_options(options);
        ASSERT_FALSE(checked.has_value());
        EXPECT_EQ(checked.error().kind, ErrorKind::bad_input);
    }
    wrong[1].vertices = -5;  // the count is clamped, but small
    for (auto& options : wrong) {
        options.vertices = std::min(options.vertices, 150);
        const Mesh mesh = synth_frame(options, -3).mesh;
        for (const auto& p : mesh.positions)
            ASSERT_TRUE(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]));
    }
}

// The colour of the vertex nearest to a point.
Colour colour_near(const Mesh& mesh, const Vector3d& point) {
    const auto distance = [&](const Vector3f& p) {
        return std::hypot(p[0] - point[0], p[1] - point[1], p[2] - point[2]);
    };
    const auto nearest = std::ranges::min_element(mesh.positions, {}, distance);
    return mesh.colours[static_cast<std::size_t>(nearest - mesh.positions.begin())];
}

TEST(Synth, ColoursAreThoseOfADressedPersonAndMoveWithTheLimbs) {
    for (const int frame : {0, 75, 100}) {
        const SynthFrame made = synth_frame(small(6000), frame);
        const auto& j = made.true_pose.joints;
        const Colour hair = colour_near(made.mesh, {j[0][0], j[0][1] + 120, j[0][2]});
        const Colour hand = colour_near(made.mesh, j[8]), knee = colour_near(made.mesh, j[10]);
        EXPECT_LT(hair[0], 110) << "dark hair, frame " << frame;
        EXPECT_GT(hand[0], 180) << "skin, frame " << frame;
        EXPECT_GT(hand[0], hand[2] + 40) << "skin, frame " << frame;
        EXPECT_LT(knee[0], 110) << "dark trousers, frame " << frame;
    }
}

}  // namespace
}  // namespace htvm
