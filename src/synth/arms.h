// Where the arms of a posed person end up: hands on what they hold on to, and nothing of an arm inside another part.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "synth/scene.h"

namespace htvm::synth {

// A hand laid on a part: its middle over `place`, with the palm towards the part along `inwards`.
struct Hold {
    std::size_t part = 0;     // of the scene
    Eigen::Vector3d place;    // rest coordinates of the part; its depth does not matter, the hand goes to the surface
    Eigen::Vector3d inwards;  // unit vector in rest coordinates
    Eigen::Vector3d fingers =
        Eigen::Vector3d::Zero();  // where they point, rest coordinates; zero: as the forearm leads
    double clearance = 16;        // mm from the part's surface to the middle of the hand; negative: inside
    double weight = 0;            // 0: not at all, 1: there
};

// Two holds for each hand: of the move that ends and of the one that begins. `first_part`: 0 or second_person.
using Holds = std::array<std::array<Hold, 2>, 2>;

// Bends the arms of a person (all other parts are placed). in_pocket: how far each hand is in a
// pocket, 0 to 1, where it may be inside the leg.
void reach(PosedScene& scene, std::size_t first_part, const Holds& holds, const std::array<double, 2>& in_pocket);

}  // namespace htvm::synth
