// The synthetic capture: a dressed person who moves, with another and with things in some motions, re-meshed in every
// frame as a reconstruction would be, with the skeleton that a tracker would report. Any frame can be generated on its
// own, and is the same for any number of threads.
#pragma once

#include <array>
#include <cstdint>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"

namespace htvm {

enum class SynthMotion : std::uint8_t {
    tour,      // from a T-pose: walks, waves, turns and jumps in a cycle of 8 s, whatever the seed
    calm,      // stands and gestures; hands touch each other, the chin, the hips, an arm
    everyday,  // walks, sits down on a chair and gets up, hands in pockets, picks up a ball; somebody comes in at times
    fast,      // dances: kicks, jumps, spins, claps; limbs move 30 cm and more in a thirtieth of a second
};

// How a motion is called on command lines.
struct SynthMotionName {
    SynthMotion motion;
    const char* name;
};
inline constexpr std::array synth_motions = {
    SynthMotionName{SynthMotion::tour, "tour"},
    SynthMotionName{SynthMotion::calm, "calm"},
    SynthMotionName{SynthMotion::everyday, "everyday"},
    SynthMotionName{SynthMotion::fast, "fast"},
};

struct SynthOptions {
    std::uint64_t seed = 1;  // for everything random: sampling, noise, and which moves follow which; the tour does not
                             // depend on it
    SynthMotion motion = SynthMotion::tour;
    int people = 1;        // 2: a second person moves beside from the start on (not in the tour)
    int vertices = 35000;  // approximate number per frame, 150 to 2,000,000; each frame is within 3 % of it
    double fps = 30;       // frames per second, > 0
    double surface_noise_power = 2.25;  // mm^2, mean square of the reconstruction noise along the normal; different in
                                        // every frame
    double joint_noise_power = 25;      // mm^2, variance of each joint coordinate's Gaussian noise (paper, Fig. 20)
    bool lattice = false;  // keep the vertices on the edges and diagonals of one fixed, axis-aligned grid; the
                           // number of vertices then varies with the pose, and is at least about 1,000
    bool colours = true;   // give vertices colours
    bool normals = false;  // give vertices normals
};

struct SynthFrame {
    Mesh mesh;                             // closed and manifold; mm, y up, the ground at y = 0
    std::vector<Vector3f> true_positions;  // of the mesh's vertices, before the noise moved them
    Pose pose;       // the pose of the (first) person that a tracker would report: true_pose with noise
    Pose true_pose;  // without noise
};

// 15 joints and 14 bones, as in the paper's Fig. 3; bones in the same order as the joints' chains.
Skeleton synth_skeleton();

// The side length of the lattice's cells, mm: a lattice vertex is at cell * (i, j, k) + share * cell * d, with integers
// i, j, k, d one of the seven offsets {0, 1}^3 other than zero, and share in (0, 1).
double synth_lattice_cell(const SynthOptions& options);

// Fails (bad_input) with what is wrong with the options, if anything.
Result<void> check_synth_options(const SynthOptions& options);

// The frame at frame / fps seconds. Frame 0 of the tour is a T-pose that faces +z; negative frames have the pose of
// frame 0. Options out of range are clamped.
SynthFrame synth_frame(const SynthOptions& options, int frame, internal::Threads threads = {});

}  // namespace htvm
