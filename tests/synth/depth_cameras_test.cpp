// The synthetic person as depth cameras deliver it.
#include "synth/depth_cameras.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "core/disjoint_sets.h"

namespace htvm {
namespace {

using Eigen::Vector3d;

struct Shot {
    SynthOptions options;
    DepthCameraOptions cameras;
    SynthFrame made;
    DepthCapture capture;
};

// Coarse, so that it is quick.
Shot shoot(int cameras, int frame = 0, double noise = 1, DepthSensor sensor = DepthSensor::kinect) {
    Shot shot;
    shot.options.motion = SynthMotion::calm;
    shot.options.vertices = 6000;
    shot.cameras.cameras = cameras;
    shot.cameras.sensor = sensor;
    shot.cameras.vertices = 3000 * cameras;
    shot.cameras.noise = noise;
    shot.made = synth_frame(shot.options, frame);
    shot.capture = capture_depth(shot.options, shot.cameras, shot.made, frame);
    return shot;
}

Vector3d at(const Vector3f& p) { return {p[0], p[1], p[2]}; }

// Of a point before a camera: its depth, and where it is in the image.
struct Projected {
    double depth, x, y;
};
Projected project(const DepthCamera& camera, const Vector3f& point) {
    const Vector3d offset = at(point) - camera.position;
    const double depth = -camera.backward.dot(offset);
    return {depth, 0.5 * camera.width + camera.focal * camera.right.dot(offset) / depth,
            0.5 * camera.height - camera.focal * camera.up.dot(offset) / depth};
}

// Depths by pixel of a capture with one camera.
std::map<std::pair<int, int>, double> depths_of(const Shot& shot) {
    std::map<std::pair<int, int>, double> out;
    for (const auto& p : shot.capture.mesh.positions) {
        const auto [depth, x, y] = project(shot.capture.cameras[0], p);
        out[{static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y))}] = depth;
    }
    return out;
}

// How many of its directed edges a mesh has both ways, and how many there are.
std::pair<std::size_t, std::size_t> paired_edges(const Mesh& mesh) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t c = 0; c < 3; ++c) edges.emplace(t[c], t[(c + 1) % 3]);
    return {static_cast<std::size_t>(std::ranges::count_if(edges,
                                                           [&](const auto& edge) {
                                                               return edges.contains({edge.second, edge.first});
                                                           })),
            edges.size()};
}

bool same(const Mesh& a, const Mesh& b) {
    return a.positions == b.positions && a.triangles == b.triangles && a.colours == b.colours;
}

TEST(DepthCameras, TheSameOptionsGiveTheSameFrameForAnyNumberOfThreads) {
    const Shot one = shoot(3, 5), other = shoot(3, 5);
    EXPECT_TRUE(same(one.capture.mesh, other.capture.mesh));
    const auto threaded = capture_depth(one.options, one.cameras, one.made, 5, internal::ThreadPool(3));
    EXPECT_TRUE(same(one.capture.mesh, threaded.mesh));
    EXPECT_EQ(one.capture.seen, threaded.seen);
}

TEST(DepthCameras, NoiseIsNewInEveryFrameAndForEverySeed) {
    const Shot shot = shoot(1, 5);
    EXPECT_FALSE(same(shot.capture.mesh, capture_depth(shot.options, shot.cameras, shot.made, 6).mesh));
    SynthOptions reseeded = shot.options;
    reseeded.seed = 2;
    // The same body before the same camera.
    EXPECT_FALSE(same(shot.capture.mesh, capture_depth(reseeded, shot.cameras, shot.made, 5).mesh));
}

TEST(DepthCameras, OneCameraSeesTheFrontAndNoBack) {
    const Shot shot = shoot(1);
    const Vector3d camera = shot.capture.cameras[0].position;
    EXPECT_GT(camera.z(), 2000) << "the person faces +z";
    std::size_t facing = 0;
    for (const auto& t : shot.capture.mesh.triangles) {
        const auto& p = shot.capture.mesh.positions;
        const Vector3d normal = (at(p[t[1]]) - at(p[t[0]])).cross(at(p[t[2]]) - at(p[t[0]]));
        facing += normal.dot(camera - at(p[t[0]])) > 0 ? 1 : 0;
    }
    EXPECT_EQ(facing, shot.capture.mesh.triangles.size()) << "triangles are wound as seen from the camera";
    std::size_t seen = 0, behind = 0;
    for (std::size_t t = 0; t < shot.capture.seen.size(); ++t) {
        if (!shot.capture.seen[t]) continue;
        ++seen;
        const Triangle& corners = shot.made.mesh.triangles[t];
        const auto& p = shot.made.true_positions;
        const Vector3d normal = (at(p[corners[1]]) - at(p[corners[0]])).cross(at(p[corners[2]]) - at(p[corners[0]]));
        behind += normal.dot(camera - at(p[corners[0]])) <= 0 ? 1 : 0;
    }
    EXPECT_GT(seen, shot.capture.seen.size() / 4);
    EXPECT_LT(seen, shot.capture.seen.size() / 2);
    EXPECT_LT(behind, seen / 200);
}

TEST(DepthCameras, CamerasStandEvenlyAroundAtTheirDistanceAndLookAtOneAnother) {
    SynthOptions options;
    options.motion = SynthMotion::fast;
    DepthCameraOptions cameras;
    cameras.cameras = 2;
    const auto two = depth_cameras(options, cameras, 0);
    ASSERT_EQ(two.size(), 2u);
    EXPECT_NEAR((two[0].position - two[1].position).norm(), 2 * camera_distance(options, cameras), 1e-6);
    EXPECT_NEAR(two[0].backward.dot(two[1].backward), -1, 1e-12);
    for (const auto& camera : two) EXPECT_NEAR(camera.right.cross(camera.up).dot(camera.backward), 1, 1e-12);
    cameras.distance = 1500;
    const auto nearer = depth_cameras(options, cameras, 0);
    EXPECT_NEAR((nearer[0].position - nearer[1].position).norm(), 3000, 1e-6);
}

TEST(DepthCameras, AKinectStandsStillAndAPhoneStaysBeforeTheFace) {
    SynthOptions options;  // the tour: the person walks
    DepthCameraOptions kinect, phone;
    phone.sensor = DepthSensor::phone;
    EXPECT_EQ(depth_cameras(options, kinect, 0)[0].position, depth_cameras(options, kinect, 60)[0].position);
    for (const int frame : {0, 60, 90}) {
        const auto camera = depth_cameras(options, phone, frame)[0];
        const auto head = synth_frame({.vertices = 150}, frame).true_pose.joints[0];
        EXPECT_LT((camera.position - Vector3d(head[0], head[1], head[2])).norm(), 700) << frame;
    }
}

TEST(DepthCameras, APhoneSeesHeadAndShouldersFinerThanAKinect) {
    SynthOptions options;
    options.motion = SynthMotion::calm;
    options.vertices = 6000;
    const SynthFrame made = synth_frame(options, 0);
    DepthCameraOptions kinect, phone;
    phone.sensor = DepthSensor::phone;
    const auto extent = [](const Mesh& mesh) {
        const auto [low, high] = std::ranges::minmax(mesh.positions, {}, [](const Vector3f& p) { return p[1]; });
        return high[1] - low[1];
    };
    const Mesh person = capture_depth(options, kinect, made, 0).mesh,
               head = capture_depth(options, phone, made, 0).mesh;
    EXPECT_GT(extent(person), 1650);
    EXPECT_GT(person.positions.size(), 10000u);
    EXPECT_LT(person.positions.size(), 25000u);
    EXPECT_GT(extent(head), 360);
    EXPECT_LT(extent(head), 550);
    EXPECT_GT(head.positions.size(), person.positions.size());
}

TEST(DepthCameras, EachCameraHasASheetOfItsOwn) {
    const Shot shot = shoot(3);
    ASSERT_EQ(shot.capture.sheets.size(), 3u);
    std::vector<std::size_t> owner;
    for (std::size_t sheet = 0; sheet < 3; ++sheet) owner.insert(owner.end(), shot.capture.sheets[sheet], sheet);
    ASSERT_EQ(owner.size(), shot.capture.mesh.positions.size());
    for (const auto& t : shot.capture.mesh.triangles)
        EXPECT_TRUE(owner[t[0]] == owner[t[1]] && owner[t[1]] == owner[t[2]]);
    for (std::size_t v = 0; v < owner.size(); ++v) {  // each vertex is the middle of one of its camera's pixels
        const auto place = project(shot.capture.cameras[owner[v]], shot.capture.mesh.positions[v]);
        EXPECT_NEAR(place.x - std::floor(place.x), 0.5, 2e-3);
        EXPECT_NEAR(place.y - std::floor(place.y), 0.5, 2e-3);
    }
}

TEST(DepthCameras, EveryVertexHasATriangleAndAColour) {
    const Mesh mesh = shoot(2).capture.mesh;
    std::set<std::uint32_t> used;
    for (const auto& t : mesh.triangles) used.insert(t.begin(), t.end());
    EXPECT_EQ(used.size(), mesh.positions.size());
    EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
}

TEST(DepthCameras, NoEdgeGoesOverAStepOfDepth) {
    const Shot shot = shoot(1, 20);
    const auto& camera = shot.capture.cameras[0];
    for (const auto& t : shot.capture.mesh.triangles)
        for (std::size_t c = 0; c < 3; ++c) {
            const auto a = project(camera, shot.capture.mesh.positions[t[c]]),
                       b = project(camera, shot.capture.mesh.positions[t[(c + 1) % 3]]);
            EXPECT_LE(std::abs(a.depth - b.depth), step_limit(camera, shot.cameras, std::min(a.depth, b.depth)) + 1e-3);
            EXPECT_LE(std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)), 1.01);
        }
}

TEST(DepthCameras, WithoutNoiseDepthsAreThoseOfTheTrueSurface) {
    const Shot shot = shoot(1, 12, 0);
    // Vertices of the true surface that are seen lie between the depths of the pixels around.
    const auto depths = depths_of(shot);
    const Mesh seen = seen_surface(shot.made, shot.capture);
    double squares = 0, count = 0;
    for (const auto& p : seen.positions) {
        const auto place = project(shot.capture.cameras[0], p);
        const auto found = depths.find({static_cast<int>(std::floor(place.x)), static_cast<int>(std::floor(place.y))});
        if (found == depths.end()) continue;
        const double error = std::min(std::abs(found->second - place.depth), 50.0);
        squares += error * error;
        ++count;
    }
    EXPECT_GT(count, 1500);
    EXPECT_LT(std::sqrt(squares / count), 12) << "less than a pixel, which is 14 mm wide";
}

TEST(DepthCameras, NoiseIsAlongThePixelsRaysAndOfTheSensorsSize) {
    const auto exact = depths_of(shoot(1, 12, 0)), noisy = depths_of(shoot(1, 12, 1));
    std::vector<double> errors;
    for (const auto& [pixel, depth] : noisy)
        if (const auto truth = exact.find(pixel); truth != exact.end())
            errors.push_back(std::abs(depth - truth->second));
    ASSERT_GT(errors.size(), 2000u);
    std::ranges::sort(errors);
    EXPECT_NEAR(errors[errors.size() / 2], 2, 1);
}

TEST(DepthCameras, FlyingPixelsExistAndStayNearTheEdgesTheyFlyFrom) {
    std::size_t flying = 0;
    const double longest = synth::model_of(DepthSensor::kinect).longest_flight;
    for (const int frame : {0, 10, 20}) {
        const auto exact = depths_of(shoot(1, frame, 0)), noisy = depths_of(shoot(1, frame, 1));
        for (const auto& [pixel, depth] : noisy) {
            double gap = 1e9;  // to the nearest of the surface that the pixels around show
            for (int dy = -4; dy <= 4; ++dy)
                for (int dx = -4; dx <= 4; ++dx)
                    if (const auto near = exact.find({pixel.first + dx, pixel.second + dy}); near != exact.end())
                        gap = std::min(gap, std::abs(depth - near->second));
            EXPECT_LT(gap, longest + 40) << frame;
            flying += gap > 20 ? 1 : 0;
        }
    }
    EXPECT_GT(flying, 10u);
}

TEST(DepthCameras, NoiseMakesHolesThatMove) {
    const auto exact = depths_of(shoot(1, 0, 0)), first = depths_of(shoot(1, 0)), second = depths_of(shoot(1, 1));
    std::set<std::pair<int, int>> holes, others;
    for (const auto& [pixel, depth] : exact) {
        if (!first.contains(pixel)) holes.insert(pixel);
        if (!second.contains(pixel)) others.insert(pixel);
    }
    EXPECT_GT(holes.size(), exact.size() / 50);
    EXPECT_LT(holes.size(), exact.size() / 4);
    const auto stay = std::ranges::count_if(holes, [&](const auto& pixel) { return others.contains(pixel); });
    EXPECT_LT(stay, static_cast<std::ptrdiff_t>(holes.size() * 3 / 4));
}

TEST(DepthCameras, TheTrueSurfaceIsClosedAndWhatIsSeenOfItIsOpen) {
    const Shot shot = shoot(1);
    Mesh whole = shot.made.mesh;
    const auto [closed, all] = paired_edges(whole);
    EXPECT_EQ(closed, all);
    const Mesh seen = seen_surface(shot.made, shot.capture);
    const auto [paired, edges] = paired_edges(seen);
    EXPECT_LT(paired, edges);
    EXPECT_GT(paired, edges * 3 / 4);
    const std::set<Vector3f> known(shot.made.true_positions.begin(), shot.made.true_positions.end());
    for (const auto& p : seen.positions) EXPECT_TRUE(known.contains(p));
}

TEST(DepthCameras, MoreCamerasSeeMoreAndNeverLess) {
    const Shot one = shoot(1), three = shoot(3);
    std::size_t by_one = 0, by_three = 0;
    for (std::size_t t = 0; t < one.capture.seen.size(); ++t) {
        by_one += one.capture.seen[t];
        by_three += three.capture.seen[t];
        // The first camera is the same one, though the other two make its pixels no coarser.
        EXPECT_GE(three.capture.seen[t], one.capture.seen[t]);
    }
    EXPECT_GT(by_three, 2 * by_one - by_one / 4);
}

TEST(DepthCameras, VerticesAreAboutAsManyAsAskedFor) {
    for (const int cameras : {1, 2, 3}) {
        const auto found = static_cast<double>(shoot(cameras).capture.mesh.positions.size());
        EXPECT_NEAR(found, 3000 * cameras, 600 * cameras) << cameras;
    }
}

TEST(DepthCameras, OptionsOutOfRangeAreNamed) {
    EXPECT_TRUE(check_depth_cameras({}).has_value());
    std::vector<DepthCameraOptions> wrong(6);
    wrong[0].cameras = 0;
    wrong[1].cameras = 17;
    wrong[2].distance = 600;  // nearer than a Kinect measures people
    wrong[3].sensor = DepthSensor::phone;
    wrong[3].distance = 2500;
    wrong[4].vertices = 10;
    wrong[5].noise = -1;
    for (const auto& options : wrong) EXPECT_FALSE(check_depth_cameras(options).has_value());
}

}  // namespace
}  // namespace htvm
