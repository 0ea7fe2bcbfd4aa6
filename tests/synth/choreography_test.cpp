// The motions of the synthetic scene: calm, everyday, fast.
#include "synth/choreography.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <string>

#include "synth/body.h"
#include "synth/posture.h"
#include "synth/truth.h"

namespace htvm::synth {
namespace {

constexpr std::array motions = {SynthMotion::calm, SynthMotion::everyday, SynthMotion::fast};

SynthOptions with_motion(SynthMotion motion, std::uint64_t seed = 1, double fps = 30) {
    SynthOptions options;
    options.motion = motion;
    options.seed = seed;
    options.fps = fps;
    return options;
}

// The longest way of any joint within a frame at 30 fps, mm.
double fastest_step(SynthMotion motion, double seconds) {
    double fastest = 0;
    PosedScene before = pose_scene(motion, 1, 1, 0);
    for (double t = 1.0 / 30; t < seconds; t += 1.0 / 30) {
        const PosedScene now = pose_scene(motion, 1, 1, t);
        for (std::size_t j = 0; j < joint_count; ++j)
            fastest = std::max(fastest, (now.joints[j] - before.joints[j]).norm());
        before = now;
    }
    return fastest;
}

TEST(Choreography, TheTourIsTheSameForAllSeeds) {
    const PosedBody body = pose_body(3.3);
    for (const std::uint64_t seed : {1, 2}) {
        const PosedScene scene = pose_scene(SynthMotion::tour, 1, seed, 3.3);
        EXPECT_EQ(scene.joints, body.joints);
        EXPECT_EQ(scene.present, person_parts);
    }
}

TEST(Choreography, TheSameSeedGivesTheSamePoseAndAnotherSeedAnotherOne) {
    for (const SynthMotion motion : motions) {
        EXPECT_EQ(pose_scene(motion, 1, 5, 21.7).joints, pose_scene(motion, 1, 5, 21.7).joints);
        EXPECT_NE(pose_scene(motion, 1, 5, 21.7).joints, pose_scene(motion, 1, 6, 21.7).joints);
    }
}

TEST(Choreography, CalmIsSlowAndLimbsOfFastMoveThirtyCentimetresInAFrame) {
    EXPECT_LT(fastest_step(SynthMotion::calm, 30), 80);
    EXPECT_GT(fastest_step(SynthMotion::fast, 20), 300);
    EXPECT_LT(fastest_step(SynthMotion::fast, 20), 600);  // 18 m/s: as fast as limbs of people are
}

TEST(Choreography, NothingJumps) {
    constexpr double step = 1.0 / 120;
    constexpr std::array limits = {6000.0, 14000.0, 28000.0};  // mm/s; elbows give way quickly
    for (std::size_t i = 0; i < motions.size(); ++i) {
        PosedScene before = pose_scene(motions[i], 1, 3, 0);
        for (double t = step; t < 15; t += step) {
            const PosedScene now = pose_scene(motions[i], 1, 3, t);
            for (std::size_t j = 0; j < joint_count; ++j)
                ASSERT_LT((now.joints[j] - before.joints[j]).norm() / step, limits[i])
                    << "mm/s, joint " << j << " at " << t << " of motion " << i;
            before = now;
        }
    }
}

TEST(Choreography, LimbsKeepTheirLength) {
    constexpr std::array<std::pair<std::size_t, std::size_t>, 8> rigid = {
        {{3, 4}, {4, 5}, {6, 7}, {7, 8}, {9, 10}, {10, 11}, {12, 13}, {13, 14}}};
    const auto& rest = rest_joints();
    for (const SynthMotion motion : motions)
        for (double t = 0; t < 40; t += 0.3) {
            const PosedScene scene = pose_scene(motion, 1, 2, t);
            for (const auto& [a, b] : rigid)
                EXPECT_NEAR((scene.joints[a] - scene.joints[b]).norm(), (rest[a] - rest[b]).norm(), 1e-6) << t;
        }
}

TEST(Choreography, MovesDoNotComeAgainInTheSameOrder) {
    // Where the hands are in a second of a minute is not where they are in the minutes after it.
    for (const SynthMotion motion : motions)
        for (const double later : {60.0, 120.0, 300.0}) {
            double apart = 0;
            for (double t = 0; t < 60; t += 1)
                apart += (pose_scene(motion, 1, 1, t).joints[5] - pose_scene(motion, 1, 1, t + later).joints[5]).norm();
            EXPECT_GT(apart / 60, 60) << "mm";
        }
}

Eigen::Vector3d to_rest(const PartFrame& frame, const Eigen::Vector3d& world) {
    return frame.rotation.transpose() * (world - frame.pivot) + frame.rest_pivot;
}

// Whether the part is a hand or a forearm of the person, and the place in its pocket.
bool is_in_pocket(const PosedScene& scene, std::size_t part, const Eigen::Vector3d& world) {
    if (part < index_of(Part::left_forearm) || part > index_of(Part::right_hand)) return false;
    const std::size_t pocket = left_pocket + (part & 1);
    return (scene.present & part_bit(pocket)) && part_distance(pocket, to_rest(scene.parts[pocket], world)) < 40;
}

struct Penetration {
    double depth = 0;  // mm
    std::string what;  // which part, and into which
};

// How far anything reaches into a part that it does not hang on, where it does not in the T-pose. Hands in pockets are
// left out.
Penetration deepest_penetration(const PosedScene& scene, std::span<const SurfaceMark> marks) {
    Penetration deepest;
    for (const auto& [part, at] : marks) {
        if (part >= 2 * part_count || !(scene.present & part_bit(part))) continue;
        const PartSet others = scene.present & ~joined_parts(part) & ~part_bit(left_pocket) & ~part_bit(right_pocket);
        const Eigen::Vector3d mark(at[0], at[1], at[2]), world = carry(scene.parts[part], mark);
        for (std::size_t other = 0; other < scene_part_count; ++other) {
            if (!(others & part_bit(other))) continue;
            const double depth = -part_distance(other, to_rest(scene.parts[other], world));
            if (depth <= deepest.depth) continue;
            // Neighbours but one touch at rest as well, and flesh between them folds.
            const bool same_person = other < 2 * part_count && other / part_count == part / part_count;
            if (same_person && part_distance(other, mark) < 40) continue;
            if (is_in_pocket(scene, part, world) || is_in_pocket(scene, other, world)) continue;
            deepest = {depth, figure_name(part) + " " + part_name(part) + " into " + part_name(other)};
        }
    }
    return deepest;
}

TEST(Choreography, LimbsDoNotPassThroughTheBody) {
    constexpr std::size_t all = 1000000, every = 8;
    for (const SynthMotion motion : motions) {
        const SynthOptions options = with_motion(motion, 4, 2);
        const std::size_t known = surface_marks(options, all).size();
        const auto marks = surface_marks(options, known / every);
        for (int frame = 0; frame < 50; ++frame) {
            const auto scene = pose_scene(motion, options.people, options.seed, frame / options.fps);
            const auto deepest = deepest_penetration(scene, marks);
            EXPECT_LT(deepest.depth, 30) << deepest.what << ", frame " << frame;
        }
    }
}

TEST(Choreography, EverydayHasAChairThatIsSatOnABallThatIsLiftedPocketsAndAVisitor) {
    double lowest_pelvis = 1e9, highest_ball = 0, deepest_pocket = 0;
    std::set<bool> visitor;
    for (double t = 0; t < 60; t += 0.1) {
        const PosedScene scene = pose_scene(SynthMotion::everyday, 1, 1, t);
        EXPECT_TRUE(scene.present & part_bit(chair_seat));
        lowest_pelvis = std::min(lowest_pelvis, scene.joints[2].y());
        highest_ball = std::max(highest_ball, scene.parts[ball_part].pivot.y());
        visitor.insert((scene.present & part_bit(second_person)) != 0);
        const Eigen::Vector3d hand = carry(scene.parts[index_of(Part::left_hand)], {800, 1394, 0});
        const Eigen::Vector3d pocket = carry(scene.parts[left_pocket], {159, 822, 33});
        deepest_pocket = std::max(deepest_pocket, 1 / (1 + (hand - pocket).norm()));
    }
    EXPECT_LT(lowest_pelvis, 700);
    EXPECT_GT(highest_ball, 900);
    EXPECT_GT(deepest_pocket, 1.0 / 40);  // the hand within 4 cm of the pocket's middle
    EXPECT_EQ(visitor.size(), 2u);
}

TEST(Choreography, TwoPeopleAreThereFromTheStart) {
    for (const SynthMotion motion : motions) EXPECT_TRUE(pose_scene(motion, 2, 1, 0).present & part_bit(second_person));
    SynthOptions tour;
    tour.people = 2;
    EXPECT_FALSE(check_synth_options(tour).has_value());
}

}  // namespace
}  // namespace htvm::synth
