// What a stream says about its capture besides the meshes: the up axis, bounds, and texts.
//
// Threads and lifetimes. Plain values: copies are independent.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "htvm/mesh.hpp"

namespace htvm {

// The direction of the subject's head.
enum class UpAxis : std::uint8_t { unknown, plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };

// A pair of texts in UTF-8 without zero bytes. Players know the keys "title", "rights", "timecode" (of the first frame,
// HH:MM:SS:FF) and "front" (docs/bitstream.md); others are free. At most 255 entries, 255 bytes per key, 4095 per
// value, 16384 in total.
struct MetadataEntry {
    std::string key, value;
    bool operator==(const MetadataEntry&) const = default;
};

// What was taken off a capture's coordinates, in whole millimetres, before they became floats: surveys give people
// coordinates of hundreds of kilometres, which floats do not hold. Added to decoded positions, as doubles, it gives the
// capture's own back; players do without. Each at most 2^53 - 1 either way.
using GlobalShift = std::array<std::int64_t, 3>;
inline constexpr std::int64_t most_global_shift = (std::int64_t{1} << 53) - 1;

// The smallest and the largest x, y, z, mm.
struct SpaceBounds {
    std::array<float, 3> low, high;
    bool operator==(const SpaceBounds&) const = default;
};
// Extends `all` so that it contains `more`, if there is any.
void extend(std::optional<SpaceBounds>& all, const std::optional<SpaceBounds>& more);
// Nothing if there are no positions.
std::optional<SpaceBounds> bounds_of(std::span<const Vector3f> positions);

}  // namespace htvm
