#include "surface/tracked_registration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "surface/kept_vertices.h"
#include "surface/limb_starts.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;
using Surface = std::pair<std::vector<Point3f>, std::vector<Triangle>>;

Point3f point(const Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
Vector3d vector(const Point3f& p) { return {p[0], p[1], p[2]}; }

// As the product has them, on a lattice of whole millimetres.
DeformationOptions in_millimetres() { return {.scale = {.units = 1}}; }

// A grid of rows x columns vertices, closed in the columns.
Surface sweep(std::uint32_t rows, std::uint32_t columns, const std::function<Vector3d(double, double)>& place) {
    Surface out;
    for (std::uint32_t r = 0; r < rows; ++r)
        for (std::uint32_t c = 0; c < columns; ++c)
            out.first.push_back(point(place(static_cast<double>(r) / (rows - 1), static_cast<double>(c) / columns)));
    for (std::uint32_t r = 0; r + 1 < rows; ++r)
        for (std::uint32_t c = 0; c < columns; ++c) {
            const std::uint32_t a = r * columns + c, b = r * columns + (c + 1) % columns;
            out.second.push_back({a, b, a + columns});
            out.second.push_back({b, b + columns, a + columns});
        }
    return out;
}

// A tube along x with an oval section (80 by 50 mm) and round ends, 600 mm long.
Vector3d arm(double u, double v) {
    const double x = 600 * u;
    const double end = std::min({x, 600 - x, 40.0}) / 40;
    const double size = std::max(0.02, std::sqrt(1 - (1 - end) * (1 - end)));
    const double a = 2 * std::numbers::pi * v;
    return {x, 40 * size * std::cos(a), 25 * size * std::sin(a)};
}

Surface moved(Surface surface, const std::function<Vector3d(const Vector3d&)>& motion) {
    for (auto& p : surface.first) p = point(motion(vector(p)));
    return surface;
}

// Handles along the x axis; each vertex follows the two that it lies between.
DeformableMesh with_handles_along_x(const Surface& surface, double first, double last, std::size_t count,
                                    const DeformationOptions& options, std::span<const Colour> colours = {}) {
    std::vector<Vector3d> handles;
    std::vector<HandlePair> pairs;
    const double apart = (last - first) / static_cast<double>(count - 1);
    for (std::size_t h = 0; h < count; ++h) {
        handles.emplace_back(first + apart * static_cast<double>(h), 0, 0);
        const auto here = static_cast<std::uint16_t>(h);
        if (h > 0)
            pairs.push_back({static_cast<std::uint16_t>(h - 1), here, 0.5 * (handles[h - 1] + handles[h]), 1, 0.3});
    }
    HandleWeights weights;
    for (const auto& p : surface.first) {
        const double at = std::clamp((static_cast<double>(p[0]) - first) / apart, 0.0, static_cast<double>(count - 1));
        const auto low = std::min(static_cast<std::size_t>(at), count - 2);
        const auto upper =
            static_cast<std::uint16_t>(std::lround((at - static_cast<double>(low)) * (1 << weight_bits)));
        VertexWeights w;
        w.handle = {static_cast<std::uint16_t>(low), static_cast<std::uint16_t>(low + 1)};
        w.weight = {static_cast<std::uint16_t>((1 << weight_bits) - upper), upper};
        if (upper > w.weight[0]) {
            std::swap(w.handle[0], w.handle[1]);
            std::swap(w.weight[0], w.weight[1]);
        }
        if (w.weight[1] == 0) w.handle[1] = 0;
        weights.push_back(w);
    }
    return make_deformable(surface.first, surface.second, std::move(weights), handles, std::move(pairs), options,
                           colours);
}

struct Rest {
    double rms = 0, largest = 0;  // of the remaining distances to the target points, for the vertices that have one
    double valid = 0;             // share of these vertices
};

Rest rest_after(const DeformableMesh& mesh, const SurfaceIndex& target, std::span<const RigidMotion> motions) {
    const auto now = deform(mesh, motions, {});
    const auto normals = points_of(vertex_normals(now, mesh.triangles));
    const auto targets = closest_facing(target, now, normals, {.reach = 60}, {});
    Rest out;
    for (std::size_t v = 0; v < now.size(); ++v) {
        if (!targets[v].found()) continue;
        const double d = (vector(targets[v].point) - vector(now[v])).norm();
        out.rms += d * d;
        out.largest = std::max(out.largest, d);
        out.valid += 1;
    }
    out.rms = std::sqrt(out.rms / std::max(out.valid, 1.0));
    out.valid /= static_cast<double>(now.size());
    return out;
}

SurfaceIndex target_of(const Surface& surface, const DeformationOptions& options) {
    return {surface.first, surface.second, {.cell = 20, .samples = options.back_samples}};
}

// Bent about z by a quarter circle per 600 mm.
Vector3d bent(const Vector3d& p, double angle) {
    const double radius = 600 / angle, at = p.x() / radius;
    return {(radius - p.y()) * std::sin(at), radius - (radius - p.y()) * std::cos(at), p.z()};
}

TEST(RegisterDeformation, LaysAStraightTubeOnABentOne) {
    const auto options = in_millimetres();
    const auto reference = sweep(121, 40, arm);
    const auto target = target_of(moved(sweep(97, 52, arm), [](const Vector3d& p) { return bent(p, 0.8); }), options);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, options);
    const auto rest = rest_after(mesh, target, register_deformation(mesh, target, {}, options));
    EXPECT_LT(rest.rms, 1.5);  // its tip moved 220 mm
    EXPECT_GT(rest.valid, 0.98);
}

TEST(RegisterDeformation, FollowsASphereThatMovesFiveCentimetres) {
    const auto options = in_millimetres();
    auto ball = [](double u, double v) {
        const double a = std::numbers::pi * (0.01 + 0.98 * u), b = 2 * std::numbers::pi * v;
        return Vector3d(-150 * std::cos(a), 150 * std::sin(a) * std::cos(b), 150 * std::sin(a) * std::sin(b));
    };
    const Vector3d shift(30, 0, 40);
    const auto reference = sweep(60, 70, ball);
    const auto target = target_of(moved(sweep(71, 61, ball), [&](const Vector3d& p) { return p + shift; }), options);
    const auto mesh = with_handles_along_x(reference, -150, 150, 4, options);
    const auto motions = register_deformation(mesh, target, {}, options);
    EXPECT_LT(rest_after(mesh, target, motions).rms, 0.3);
    for (std::size_t h = 0; h < motions.size(); ++h)  // a ball may turn, but its centre must follow
        EXPECT_LT((motions[h](Vector3d::Zero()) - shift).norm(), 3);
}

TEST(RegisterDeformation, TurnsATwistedArm) {
    const auto options = in_millimetres();
    const auto reference = sweep(121, 40, arm);
    auto twist = [](const Vector3d& p) {
        return Vector3d(Eigen::AngleAxisd(0.9 * p.x() / 600, Vector3d::UnitX()) * p);
    };
    const auto target = target_of(moved(sweep(111, 44, arm), twist), options);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, options);
    const auto motions = register_deformation(mesh, target, {}, options);
    EXPECT_LT(rest_after(mesh, target, motions).rms, 0.8);
    const Eigen::AngleAxisd tip(motions.back().rotation);
    EXPECT_NEAR(tip.angle(), 0.9, 0.15);
}

// RMS distance of the target's vertices from the deformed reference's triangles.
double rms_from_triangles(const DeformableMesh& mesh, const SurfaceIndex& target,
                          std::span<const RigidMotion> motions) {
    const auto now = deform(mesh, motions, {});
    const SurfaceIndex reference(now, mesh.triangles);
    double squares = 0;
    for (const auto& p : target.positions) squares += static_cast<double>(reference.closest(p).squared_distance);
    return std::sqrt(squares / static_cast<double>(target.positions.size()));
}

TEST(RegisterDeformation, LaysTheTrianglesOfACoarseReferenceOnTheSurface) {
    auto options = in_millimetres();
    const auto reference = sweep(25, 8, arm);  // sides up to 50 mm long, on a tube 80 by 50 mm thick
    const auto target = target_of(moved(sweep(97, 52, arm), [](const Vector3d& p) { return bent(p, 0.5); }), options);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, options);
    const auto to_triangles = register_deformation(mesh, target, {}, options);
    options.surface_rounds = 0;
    const auto to_vertices = register_deformation(mesh, target, {}, options);
    EXPECT_LT(rms_from_triangles(mesh, target, to_triangles), 0.97 * rms_from_triangles(mesh, target, to_vertices));
}

TEST(RegisterDeformation, MovesNothingWhereNothingMoved) {
    const auto options = in_millimetres();
    const auto surface = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 9, options);
    const auto target = target_of(surface, options);
    const auto rest = rest_after(mesh, target, register_deformation(mesh, target, {}, options));
    EXPECT_LT(rest.rms, 0.05);
    EXPECT_LT(rest.largest, 0.4);
}

TEST(RegisterDeformation, IsTheSameForAnyNumberOfThreads) {
    auto options = in_millimetres();
    const auto mesh = with_handles_along_x(sweep(121, 40, arm), 0, 600, 9, options);
    const auto bent_arm = moved(sweep(97, 52, arm), [](const Vector3d& p) { return bent(p, 0.5); });
    const auto one = register_deformation(mesh, target_of(bent_arm, options), {}, options);
    for (const unsigned threads : {2u, 3u, 7u}) {
        const ThreadPool pool(threads);
        options.threads = pool;
        const SurfaceIndex target(bent_arm.first, bent_arm.second,
                                  {.cell = 20, .samples = options.back_samples, .threads = pool});
        const auto many = register_deformation(mesh, target, {}, options);
        for (std::size_t h = 0; h < one.size(); ++h) {
            EXPECT_EQ(one[h].rotation, many[h].rotation);
            EXPECT_EQ(one[h].shift, many[h].shift);
        }
    }
}

TEST(RegisterDeformation, WorksInLatticeUnitsAsInMillimetres) {
    auto options = in_millimetres();
    auto target = moved(sweep(97, 52, arm), [](const Vector3d& p) { return bent(p, 0.5); });
    const auto reference = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, options);
    const auto in_mm = register_deformation(mesh, target_of(target, options), {}, options);
    auto scale = [](const Vector3d& p) { return Vector3d(16 * p); };
    options.scale = {.units = 16};
    const auto finer = with_handles_along_x(moved(reference, scale), 0, 9600, 9, options);
    target = moved(target, scale);
    const auto on_lattice = register_deformation(
        finer, SurfaceIndex(target.first, target.second, {.cell = 320, .samples = options.back_samples}), {}, options);
    for (std::size_t h = 0; h < in_mm.size(); ++h) EXPECT_LT((in_mm[h].shift - on_lattice[h].shift / 16).norm(), 0.5);
}

TEST(RegisterDeformation, EmptyMeshesKeepTheStart) {
    const auto options = in_millimetres();
    const auto surface = sweep(21, 10, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 3, options);
    const std::vector<RigidMotion> start(3, RigidMotion{Eigen::Matrix3d::Identity(), Vector3d(1, 2, 3)});
    const auto nothing = target_of({}, options);
    const auto kept = register_deformation(mesh, nothing, start, options);
    EXPECT_EQ(kept[2].shift, start[2].shift);
    EXPECT_EQ(deformation_error(mesh, nothing, start, options), 0);
    const auto no_mesh = make_deformable({}, {}, {}, {}, {}, options);
    EXPECT_TRUE(register_deformation(no_mesh, target_of(surface, options), {}, options).empty());
    EXPECT_TRUE(deform(no_mesh, {}, {}).empty());
}

TEST(RegisterDeformation, SoupsOfTrianglesGiveFiniteMotions) {
    const auto options = in_millimetres();
    Surface soup;
    std::uint32_t state = 1;
    auto next = [&] { return state = state * 1664525 + 1013904223, static_cast<float>(state >> 8) / (1 << 15); };
    for (std::uint32_t v = 0; v < 600; ++v) soup.first.push_back({next(), next() / 4, next() / 4});
    for (std::uint32_t v = 0; v + 2 < 600; ++v) soup.second.push_back({v, (v * 7) % 600, (v * 31) % 600});
    const auto mesh = with_handles_along_x(soup, 0, 512, 5, options);
    const auto arm_target = target_of(sweep(31, 20, arm), options);
    for (const auto& motion : register_deformation(mesh, arm_target, {}, options)) {
        EXPECT_TRUE(motion.rotation.allFinite());
        EXPECT_TRUE(motion.shift.allFinite());
        EXPECT_NEAR(motion.rotation.determinant(), 1, 1e-6);
    }
}

// A round sleeve along x, 600 mm long, 80 mm wide: its shape does not tell how far it has turned about its axis.
Vector3d sleeve(double u, double v) {
    const Vector3d p = arm(u, v);
    return {p.x(), p.y(), p.z() * 40 / 25};
}

// Four stripes along the sleeve, soft and between 30 and 230, as they lie once it has turned by `angle`.
std::vector<Colour> striped(const Surface& surface, double angle) {
    std::vector<Colour> out;
    for (const auto& p : surface.first) {
        const double around = std::atan2(static_cast<double>(p[2]), static_cast<double>(p[1])) - angle;
        const auto level = static_cast<std::uint8_t>(std::lround(130 + 100 * std::sin(4 * around)));
        out.push_back({level, level, 60});
    }
    return out;
}

// The mean turn about the axis, radians, that is found if the sleeve is captured so; `shown` are its colours.
double turn_found(const std::vector<Colour>& shown, const std::vector<Colour>& reference_colours) {
    const auto options = in_millimetres();
    const auto reference = sweep(121, 40, sleeve);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, options, reference_colours);
    auto target = target_of(sweep(97, 52, sleeve), options);
    target.colours = shown;
    double turn = 0;
    const auto motions = register_deformation(mesh, target, {}, options);
    for (const auto& motion : motions) turn += std::atan2(motion.rotation(2, 1), motion.rotation(1, 1));
    return turn / static_cast<double>(motions.size());
}

constexpr double turn_of_sleeve = 0.12;  // 5 mm at its surface

TEST(RegisterDeformation, StripesOnASleeveThatTurnsAboutItsAxisTurnTheMesh) {
    const auto reference = striped(sweep(121, 40, sleeve), 0);
    const auto shown = striped(sweep(97, 52, sleeve), turn_of_sleeve);
    EXPECT_NEAR(turn_found(shown, reference), turn_of_sleeve, 0.01);
    EXPECT_NEAR(turn_found({}, reference), 0, 0.01);  // without the colours of either it stays as it lies
    EXPECT_NEAR(turn_found(shown, {}), 0, 0.01);
}

TEST(RegisterDeformation, StripesAreFollowedInAnotherLightAndPastAShadow) {
    const auto captured = sweep(97, 52, sleeve);
    auto shown = striped(captured, turn_of_sleeve);
    for (std::size_t v = 0; v < shown.size(); ++v) {
        const bool in_shadow = captured.first[v][0] > 250 && captured.first[v][0] < 330 && captured.first[v][1] > 0;
        for (auto& level : shown[v]) level = static_cast<std::uint8_t>(in_shadow ? level / 4 : level + 25);
    }
    EXPECT_NEAR(turn_found(shown, striped(sweep(121, 40, sleeve), 0)), turn_of_sleeve, 0.02);
}

TEST(RegisterDeformation, ColoursWithoutAPatternChangeNothing) {
    const auto captured = sweep(97, 52, sleeve);
    const std::vector<Colour> shown = striped(captured, 0.1), plain(sweep(121, 40, sleeve).first.size(), {90, 120, 60});
    EXPECT_EQ(turn_found(shown, plain), turn_found(shown, {}));
    std::vector<Colour> chance;
    std::uint32_t state = 1;
    for (std::size_t v = 0; v < plain.size(); ++v) {
        state = state * 1664525 + 1013904223;
        chance.push_back({static_cast<std::uint8_t>(100 + (state >> 28)), 120, 60});
    }
    EXPECT_NEAR(turn_found(shown, chance), 0, 0.01);
}

TEST(MovedOn, RepeatsTheLastStepOfEachHandle) {
    const auto options = in_millimetres();
    const auto mesh = with_handles_along_x(sweep(21, 10, arm), 0, 600, 2, options);
    const auto step = [](double angle, double shift) {
        return RigidMotion{Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(), Vector3d(shift, 0, 0)};
    };
    const std::vector<RigidMotion> before = {step(0.1, 10), step(0, 5)}, last = {step(0.3, 30), step(0, 4)};
    const auto next = moved_on(mesh, before, last);
    EXPECT_LT((next[0].rotation - step(0.5, 0).rotation).norm(), 1e-9);
    EXPECT_LT((next[0].shift - Vector3d(50, 0, 0)).norm(), 1e-9);
    EXPECT_LT((next[1].shift - Vector3d(3, 0, 0)).norm(), 1e-9);
}

TEST(MovedOn, HandlesOfAPatchedMeshRepeatTheStepOfThoseThatWereThere) {
    const auto options = in_millimetres();
    const auto mesh = with_handles_along_x(sweep(21, 10, arm), 0, 600, 2, options);
    const auto shift = [](double x, double y) { return RigidMotion{Eigen::Matrix3d::Identity(), Vector3d(x, y, 0)}; };
    const std::vector<RigidMotion> before = {shift(0, 10), shift(0, 0)}, last = {shift(0, 30), shift(0, -5)};
    const std::vector<Vector3d> handles = {{590, 0, 0}, {20, 30, 0}, {0, 20, 0}};  // of the mesh as it lies at `last`
    const auto next = moved_on(mesh, before, last, handles);
    ASSERT_EQ(next.size(), 3u);
    EXPECT_LT((next[0](handles[0]) - Vector3d(590, -5, 0)).norm(), 1e-9);
    EXPECT_LT((next[1](handles[1]) - Vector3d(20, 50, 0)).norm(), 1e-9);
    EXPECT_LT((next[2](handles[2]) - Vector3d(0, 40, 0)).norm(), 1e-9);
    EXPECT_TRUE(moved_on(mesh, {}, {}, handles).empty());
}

TEST(RegisterDeformation, FromAnotherStartEndsOnceItLeadsToWhatIsKnown) {
    const auto options = in_millimetres();
    const auto surface = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 9, options);
    const auto target = target_of(surface, options);
    const std::vector<RigidMotion> start(9, RigidMotion{Eigen::Matrix3d::Identity(), Vector3d(0, 40, 0)});
    auto known = register_deformation(mesh, target, {}, options);
    const auto same = register_deformation(mesh, target, start, options, nullptr, known);
    for (std::size_t h = 0; h < known.size(); ++h) EXPECT_EQ(same[h].shift, known[h].shift) << h;
    for (const std::size_t h : {6, 7, 8}) known[h].shift += Vector3d(0, 50, 0);  // a limb that was lost
    const auto other = register_deformation(mesh, target, start, options, nullptr, known);
    EXPECT_LT((other[8](mesh.handles[8]) - mesh.handles[8]).norm(), 5);
}

TEST(RegisterDeformation, InVainMakesNoRounds) {
    auto options = in_millimetres();
    const std::atomic<bool> yes = true, no = false;
    const auto surface = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 9, options);
    const auto target = target_of(surface, options);
    const std::vector<RigidMotion> start(9, RigidMotion{Eigen::Matrix3d::Identity(), Vector3d(0, 30, 0)});
    options.in_vain = &yes;
    EXPECT_LT((register_deformation(mesh, target, start, options)[4].shift - start[4].shift).norm(), 1e-3);
    options.in_vain = &no;
    EXPECT_LT(rest_after(mesh, target, register_deformation(mesh, target, start, options)).rms, 0.3);
}

TEST(TakeNearerLimbs, TakesThePartThatLiesNearerAndLeavesTheRest) {
    const auto options = in_millimetres();
    const auto surface = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 9, options);
    const auto target = target_of(surface, options);
    const RigidMotion away{Eigen::Matrix3d::Identity(), Vector3d(0, 50, 0)};
    std::vector<RigidMotion> motions(9), other(9);
    motions[7] = motions[8] = away;         // this has lost one end,
    other[0] = other[1] = other[2] = away;  // this the other
    EXPECT_TRUE(follow_nearer_limbs(mesh, target, other, options, motions));
    EXPECT_LT(rest_after(mesh, target, motions).rms, 0.3);
    for (std::size_t h = 0; h < motions.size(); ++h)
        EXPECT_LT((motions[h](mesh.handles[h]) - mesh.handles[h]).norm(), 5) << h;
    const auto settled = motions;
    EXPECT_FALSE(follow_nearer_limbs(mesh, target, other, options, motions));
    EXPECT_EQ(motions[0].shift, settled[0].shift);
}

// A tube along x, 1.2 m long.
Vector3d long_arm(double u, double v) {
    const Vector3d p = arm(u, v);
    return {2 * p.x(), p.y(), p.z()};
}

// Turns what lies beyond x = 800 about there to +y, within a bend of a hand's breadth.
Vector3d folded(const Vector3d& p, double angle) {
    const double share = std::clamp((p.x() - 750) / 100, 0.0, 1.0);
    const Vector3d joint(800, 0, 0);
    return joint + Eigen::AngleAxisd(angle * share, Vector3d::UnitZ()) * (p - joint);
}

TEST(ReachedForExtremities, FindsALimbThatClosestPointsLose) {
    const auto options = in_millimetres();
    const auto reference = sweep(121, 40, long_arm);
    const auto mesh = with_handles_along_x(reference, 0, 1200, 17, options);
    const auto fold = [](const Vector3d& p) { return folded(p, 1.9); };
    const auto target = target_of(moved(sweep(141, 36, long_arm), fold), options);
    auto motions = register_deformation(mesh, target, {}, options);
    EXPECT_GT(rms_from_triangles(mesh, target, motions), 30);
    const auto reached = reached_for_extremities(mesh, target, motions, {}, {.scale = options.scale});
    ASSERT_EQ(reached.size(), mesh.handles.size());
    EXPECT_LT((reached[16](mesh.handles[16]) - fold(mesh.handles[16])).norm(), 60);
    auto near = options;
    near.coarse_rounds = 0;
    const auto other = register_deformation(mesh, target, reached, near);
    EXPECT_TRUE(follow_nearer_limbs(mesh, target, other, options, motions));
    EXPECT_LT(rms_from_triangles(mesh, target, motions), 6);
}

TEST(ReachedForExtremities, IsNothingWhereEveryLimbEndsAtOne) {
    const auto options = in_millimetres();
    const auto mesh = with_handles_along_x(sweep(121, 40, long_arm), 0, 1200, 17, options);
    const auto bow = [](const Vector3d& p) { return Vector3d(p + Vector3d(0, 60 * std::sin(p.x() / 400), 0)); };
    const auto target = target_of(moved(sweep(141, 36, long_arm), bow), options);
    EXPECT_TRUE(
        reached_for_extremities(mesh, target, std::vector<RigidMotion>(17), {}, {.scale = options.scale}).empty());
}

TEST(DeformationError, IsSmallerForTheBetterMotion) {
    const auto options = in_millimetres();
    const auto surface = sweep(121, 40, arm);
    const auto mesh = with_handles_along_x(surface, 0, 600, 9, options);
    const auto target =
        target_of(moved(surface, [](const Vector3d& p) { return Vector3d(p + Vector3d(0, 30, 0)); }), options);
    const std::vector<RigidMotion> still(9), right(9, RigidMotion{Eigen::Matrix3d::Identity(), Vector3d(0, 30, 0)});
    EXPECT_LT(deformation_error(mesh, target, right, options), 1);
    EXPECT_GT(deformation_error(mesh, target, still, options), 5);
}

TEST(SurfaceTargets, AreTheClosestPointsThatFaceTheSameWay) {
    // Two sheets 10 mm apart, facing away from each other.
    Surface sheets;
    for (const float z : {0.0f, 10.0f})
        for (int i = 0; i < 4; ++i)
            sheets.first.push_back({static_cast<float>(i % 2) * 100, static_cast<float>(i / 2) * 100, z});
    sheets.second = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}};
    const SurfaceIndex target(sheets.first, sheets.second, {.cell = 20, .samples = 8});
    const std::vector<Point3f> at = {{20, 20, 2}, {20, 20, 2}, {20, 20, 2}, {20, 20, 900}};
    const std::vector<Point3f> normals = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 0, 1}};
    const auto found = closest_facing(target, at, normals, {.reach = 150}, {});
    ASSERT_TRUE(found[0].found() && found[1].found());
    EXPECT_EQ(found[0].point, (Point3f{20, 20, 10}));
    EXPECT_EQ(found[1].point, (Point3f{20, 20, 0}));
    EXPECT_LT(found[1].triangle, 2u);  // of the sheet that faces down
    EXPECT_FALSE(found[2].found());
    EXPECT_FALSE(found[3].found());
}

TEST(Solve, FindsTheSolutionOfASystemOfBlocks) {
    const auto pattern = make_pattern(5, {{0, 1}, {2, 1}, {3, 2}, {3, 4}, {0, 4}, {1, 1}, {1, 2}});
    ASSERT_EQ(pattern.place.size(), 5u);
    EXPECT_EQ(pattern.find(1, 2), 2u);
    BlockSystem system(pattern);
    std::srand(1);
    for (auto& block : system.diagonal) block = 20 * Matrix6::Identity();
    for (auto& block : system.above) block = Matrix6::Random();
    std::vector<Vector6> truth;
    for (int h = 0; h < 5; ++h) truth.push_back(Vector6::Random());
    for (std::size_t h = 0; h < 5; ++h) system.right[h] = system.diagonal[h] * truth[h];
    for (std::size_t i = 0; i < pattern.place.size(); ++i) {
        const auto [row, column] = pattern.place[i];
        system.right[row] += system.above[i] * truth[column];
        system.right[column] += system.above[i].transpose() * truth[row];
    }
    const auto x = solve(pattern, system, 60, 1e-12);
    for (std::size_t h = 0; h < 5; ++h) EXPECT_LT((x[h] - truth[h]).norm(), 1e-8);
}

// ---- Captures that keep their vertices ------------------------------------------------------------------------------

// Turned by 150 degrees about z, and bent.
Vector3d thrown(const Vector3d& p) {
    return Eigen::AngleAxisd(2.6, Vector3d::UnitZ()) * bent(p, 1.2) + Vector3d(100, 200, 50);
}

// All its vertices are known again, in their order.
struct KeptSurface {
    std::vector<std::uint32_t> again;
    KeptVertices vertices;
};
KeptSurface kept(const Surface& before, const Surface& now) {
    KeptSurface out{std::vector<std::uint32_t>(before.first.size()), {}};
    std::iota(out.again.begin(), out.again.end(), 0U);
    out.vertices = {before.first, now.first, before.second, out.again};
    return out;
}

TEST(CarriedByVertices, LayATubeWhereItsVerticesHaveGone) {
    const auto reference = sweep(121, 40, arm), captured = sweep(97, 52, arm);
    const auto now = moved(captured, thrown);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, in_millimetres());
    const auto motions = carried_by_vertices(mesh, {}, kept(captured, now).vertices, {.scale = {.units = 1}});
    const auto moved_reference = deform(mesh, motions, {});
    for (std::size_t v = 0; v < moved_reference.size(); ++v)
        EXPECT_LT((vector(moved_reference[v]) - thrown(vector(reference.first[v]))).norm(), 6) << v;
}

TEST(CarriedByVertices, GoOnFromWhereTheReferenceWasLast) {
    const auto reference = sweep(121, 40, arm);
    const RigidMotion last{Eigen::AngleAxisd(1, Vector3d::UnitY()).toRotationMatrix(), Vector3d(300, 0, 0)};
    const auto before = moved(sweep(97, 52, arm), last), now = moved(before, thrown);
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, in_millimetres());
    const std::vector<RigidMotion> lasts(mesh.handles.size(), last);
    const auto motions = carried_by_vertices(mesh, lasts, kept(before, now).vertices, {.scale = {.units = 1}});
    for (std::size_t h = 0; h < motions.size(); ++h)
        EXPECT_LT((motions[h](mesh.handles[h]) - thrown(last(mesh.handles[h]))).norm(), 30) << h;
}

TEST(CarriedByVertices, TakeHandlesWithoutVerticesAlong) {
    const auto reference = sweep(121, 40, arm);
    auto captured = sweep(97, 52, arm);
    std::erase_if(captured.second, [&](const Triangle& t) { return captured.first[t[0]][0] > 300; });
    for (auto& p : captured.first)
        if (p[0] > 320) p = {10000, 0, 0};
    const Vector3d shift(0, 900, 0);
    const auto now = moved(captured, [&](const Vector3d& p) -> Vector3d { return p + shift; });
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, in_millimetres());
    const auto motions = carried_by_vertices(mesh, {}, kept(captured, now).vertices, {.scale = {.units = 1}});
    ASSERT_EQ(motions.size(), mesh.handles.size());
    for (const auto& motion : motions) EXPECT_LT((motion.shift - shift).norm(), 0.1);
}

TEST(CarriedByVertices, AreNoneWhereNoVertexIsBesideTheReference) {
    const auto reference = sweep(121, 40, arm);
    const auto far = moved(sweep(97, 52, arm), [](const Vector3d& p) -> Vector3d { return p + Vector3d(0, 0, 5000); });
    const auto mesh = with_handles_along_x(reference, 0, 600, 9, in_millimetres());
    EXPECT_TRUE(carried_by_vertices(mesh, {}, kept(far, far).vertices, {.scale = {.units = 1}}).empty());
}

}  // namespace
}  // namespace htvm::internal
