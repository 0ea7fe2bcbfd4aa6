// Fine relief and colour of the synthetic person's body, as functions of rest coordinates (mm, T-pose), so that they
// move with the limbs.
#pragma once

#include <Eigen/Core>

#include "htvm/mesh.hpp"

namespace htvm::synth {

// An upper bound of the magnitude of the relief, mm.
inline constexpr double relief_bound = 17.0;

// How far the dressed surface stands out from the smooth shape of the body, mm: folds of shirt and trousers, their
// hems, hair, brows, eyes and lips.
double surface_relief(const Eigen::Vector3d& rest);

// Skin, hair, a patterned shirt, trousers, shoes, a face.
Colour surface_colour(const Eigen::Vector3d& rest);

}  // namespace htvm::synth
