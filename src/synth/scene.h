// What is captured in one frame: one or two people, a chair and a ball, as one list of rigid parts.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "synth/motion.h"

namespace htvm::synth {

// Parts of the scene: those of the person (Part), then those of a second person in the same order, then the cloth that
// covers the person's hands in the pockets, and the things.
inline constexpr std::size_t second_person = part_count, left_pocket = 2 * part_count, right_pocket = left_pocket + 1,
                             chair_seat = right_pocket + 1, chair_frame = chair_seat + 1, ball_part = chair_frame + 1,
                             scene_part_count = ball_part + 1;

// A set of parts, bit i for part i.
using PartSet = std::uint64_t;
constexpr PartSet part_bit(std::size_t part) { return PartSet{1} << part; }
inline constexpr PartSet person_parts = part_bit(part_count) - 1;

enum class Figure : std::uint8_t { person, other_person, chair, ball };
constexpr Figure figure_of(std::size_t part) {
    if (part < second_person || part == left_pocket || part == right_pocket) return Figure::person;
    if (part < left_pocket) return Figure::other_person;
    return part == ball_part ? Figure::ball : Figure::chair;
}

inline constexpr double chair_seat_height = 430, ball_radius = 110;  // mm

struct PosedScene {
    std::array<PartFrame, scene_part_count> parts;
    PartSet present = person_parts;
    std::array<Eigen::Vector3d, joint_count> joints;  // of the person, mm
    std::vector<Eigen::Vector3d> landmarks;           // no point of the surface is further than 260 mm from the box
                                                      // around these
    double border = std::numeric_limits<double>::infinity();  // nothing is captured at a larger x, mm
};

// The person alone.
PosedScene scene_of(const PosedBody& body);

// The scene that the rest coordinates are positions in: the person in the T-pose, and the things beside.
PosedScene rest_scene();

}  // namespace htvm::synth
