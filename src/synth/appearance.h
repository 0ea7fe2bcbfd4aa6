// Fine relief and colour of the synthetic people and things, as functions of rest coordinates (mm, T-pose), so that
// they move with the limbs.
#pragma once

#include <Eigen/Core>

#include "htvm/mesh.hpp"
#include "synth/scene.h"

namespace htvm::synth {

// An upper bound of the magnitude of the relief, mm.
inline constexpr double relief_bound = 17.0;

// How far the dressed surface stands out from the smooth shape of the body, mm: folds of shirt and trousers, their
// hems, hair, brows, eyes and lips. Things have none.
double surface_relief(Figure figure, const Eigen::Vector3d& rest);

// Skin, hair, a patterned shirt, trousers, shoes, a face; the second person's clothes have other colours. A wooden
// chair, a ball in two colours.
Colour surface_colour(Figure figure, const Eigen::Vector3d& rest);

}  // namespace htvm::synth
