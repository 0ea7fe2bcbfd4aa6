// The transforms layer: one quantised rigid transform a bone (paper, section IV-B), and the pose of an I-frame.
//
// Each transform is coded as whether it does nothing, the largest quaternion component (2 bits), the other three and
// the shift as adaptive signed numbers, one model for each of rotation and shift.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/rigid_transform.h"
#include "htvm/result.hpp"

namespace htvm::internal {

std::vector<std::uint8_t> encode_transforms(std::span<const QuantisedTransform> transforms);
Result<std::vector<QuantisedTransform>> decode_transforms(std::span<const std::uint8_t> bytes, std::size_t bones);

// S_I: the joints of the I-frame's pose, on the lattice, and the orientation T_I of each bone.
struct CodedPose {
    std::vector<LatticePoint> joints;
    std::vector<QuantisedRotation> orientations;
};
std::vector<std::uint8_t> encode_pose(const CodedPose& pose);
Result<CodedPose> decode_pose(std::span<const std::uint8_t> bytes, std::size_t joints, std::size_t bones);

}  // namespace htvm::internal
