// What the people and things of a synthetic capture do: moves in an order drawn from the seed, without end.
#pragma once

#include <cstdint>

#include "synth/scene.h"
#include "synth/synth.h"

namespace htvm::synth {

// The scene at a time (s, >= 0); depends on nothing but these arguments. Hands are laid on what they touch, and arms
// pushed out of what they would pass through.
PosedScene pose_scene(SynthMotion motion, int people, std::uint64_t seed, double seconds);

}  // namespace htvm::synth
