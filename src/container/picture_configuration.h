// What a track says of pictures of AV1, VP9 and H.264 before the first one: the records av1C ("AV1 Codec ISO Media File
// Format Binding"), vpcC ("VP Codec ISO Media File Format Binding") and avcC (ISO/IEC 14496-15), made of a key picture.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "htvm/texture.hpp"

namespace htvm {

// The inside of the box av1C, vpcC or avcC. Nothing if the picture is no video, or its bytes are not those of a key
// picture as docs/bitstream.md, 14, has it.
std::optional<std::vector<std::uint8_t>> picture_configuration(const TexturePicture& key);

// What the sample entry of a coder's pictures, the box of its record, and the coder are called. H.264's has parameter
// sets in samples as well as in the record.
struct VideoEntry {
    std::uint32_t type = 0, record = 0;
    const char* name = "";
};
VideoEntry video_entry_of(PictureCoder coder);

// Whether a sample entry is of pictures of a stream.
bool is_picture_entry(std::uint32_t sample_entry);

// How many bytes at the picture's beginning are no part of a sample: a temporal delimiter of AV1.
std::size_t delimiter_bytes(const TexturePicture& picture);

}  // namespace htvm
