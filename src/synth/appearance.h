// What is fixed to the synthetic person's body: fine relief and colour, as functions of rest coordinates (mm, T-pose),
// so that both move with the limbs.
#pragma once

#include <Eigen/Core>

#include "htvm/mesh.hpp"

namespace htvm::synth {

// No relief is further from zero than this, mm.
inline constexpr double relief_bound = 17.0;

// How far the dressed surface stands out from the body's smooth shape, mm: folds of shirt and trousers, their hems,
// hair, brows, eyes and lips.
double surface_relief(const Eigen::Vector3d& rest);

// Skin, hair, a patterned shirt, trousers, shoes, a face.
Colour surface_colour(const Eigen::Vector3d& rest);

}  // namespace htvm::synth
