// What a stream says about its capture besides the meshes: the up axis, and texts.
#pragma once

#include <cstdint>
#include <string>

namespace htvm {

// The direction of the subject's head.
enum class UpAxis : std::uint8_t { unknown, plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };

// A pair of texts in UTF-8 without zero bytes. Players know the keys "title", "rights" and "timecode" (of the first
// frame, HH:MM:SS:FF); others are free. At most 255 entries, 255 bytes per key, 4095 per value, 16384 in total.
struct MetadataEntry {
    std::string key, value;
    bool operator==(const MetadataEntry&) const = default;
};

}  // namespace htvm
