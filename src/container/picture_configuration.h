// What a track says of pictures of AV1 and VP9 before the first one: the records av1C ("AV1 Codec ISO Media File Format
// Binding") and vpcC ("VP Codec ISO Media File Format Binding"), made of a key picture.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "htvm/texture.hpp"

namespace htvm {

// The inside of the box av1C or vpcC. Nothing if the picture is no video, or its bytes are not those of a key picture
// as docs/bitstream.md, 14, has it.
std::optional<std::vector<std::uint8_t>> picture_configuration(const TexturePicture& key);

// How many bytes at the picture's beginning are no part of a sample: a temporal delimiter of AV1.
std::size_t delimiter_bytes(const TexturePicture& picture);

}  // namespace htvm
