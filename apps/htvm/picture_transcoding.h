// The pictures of a stream, coded anew by another coder, while all else stays as it is.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "h264_pictures.h"
#include "htvm/packet.hpp"
#include "htvm/picture_decoder.hpp"
#include "htvm/picture_encoder.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

struct PictureTranscodingOptions {
    PictureCoder coder = PictureCoder::h264;
    // How coarse pictures are: 0..63 of AV1 and VP9, 0..51 of H.264.
    double quantiser = 26;
    double frames_per_second = 30;
    std::string ffmpeg = "ffmpeg";  // for H.264
};

// Takes the packets of a stream in order, and gives those of the new one. Key pictures are where they were. Pictures
// have the sizes that they had, but for odd sides, which H.264 does not have: they become one pixel longer.
class PictureTranscoding {
public:
    explicit PictureTranscoding(PictureTranscodingOptions options);
    // unsupported: a picture is an image file, or its planes are not those of BT.709 in limited range.
    Result<std::vector<Packet>> take(Packet packet);
    Result<std::vector<Packet>> finish();
    struct Totals {
        std::size_t pictures = 0;
        std::uint64_t bytes_before = 0, bytes = 0;  // of packets
    };
    const Totals& totals() const { return totals_; }

private:
    struct Held {
        Packet packet;
        std::optional<TexturePicture> picture = {};  // that is being coded; none: the packet is another
    };
    Result<void> code(Held& held);
    Result<void> begin(std::uint32_t width, std::uint32_t height);
    Result<void> end();
    void take_coded();
    std::vector<Packet> give_ready();

    PictureTranscodingOptions options_;
    PictureDecoder decoder_;
    std::variant<std::monostate, PictureEncoder, H264Pictures> encoder_;
    std::uint32_t width_ = 0, height_ = 0;  // the encoder's
    std::deque<Held> held_;
    std::uint32_t last_ = 0;  // the frame of the picture that was coded last
    Totals totals_;
};

}  // namespace htvm::app
