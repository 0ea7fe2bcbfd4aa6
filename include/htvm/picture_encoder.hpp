// Codes the pictures of a textured stream as video: AV1 by libaom, VP9 by libvpx. Each picture is coded as it comes,
// without those that follow it, so that a live stream waits for nothing; or, for files, AV1 by SVT-AV1 once those that
// follow are there, for a quarter fewer bits and more: what stays is then told from the noise of single pictures.
//
// Part of the library htvm::texture, which needs libaom, libvpx, libdav1d and SVT-AV1.
//
// Threads and lifetimes. One object is used by one thread at a time. What it gives is the caller's.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "htvm/picture_planes.hpp"
#include "htvm/result.hpp"
#include "htvm/texture.hpp"

namespace htvm {

struct PictureEncoderOptions {
    PictureCoder coder = PictureCoder::av1;  // or vp9
    std::uint32_t width = 0, height = 0;     // pixels, 16..most_picture_side
    double frames_per_second = 30;
    int quantiser = 32;          // 0..63, where no rate is given: how coarse pictures are, the same for all
    double bits_per_second = 0;  // 0: by the quantiser. Otherwise the rate is kept to, over the buffer
    double buffer_seconds = 1;   // of the receiver
    int speed = 8;           // 5..9: 9 takes half the time of 8, with foresight, and some 8 % more bits; without, half
                             // the time of 5, and some 5 % more bits
    bool foresight = false;  // pictures that follow are waited for, some 30 of them, before one is coded, where
                             // sides are even and of 64 pixels or more: for AV1 by the quantiser
    unsigned threads = 0;    // 0: one per core. The bytes are the same for any number
};

struct CodedPicture {
    std::vector<std::uint8_t> bytes;  // as TexturePicture::coded
    bool key = false;
};

class PictureEncoder {
public:
    // bad_input: an option is out of its range; unsupported: the coder codes no video.
    static Result<PictureEncoder> create(const PictureEncoderOptions& options);
    PictureEncoder(PictureEncoder&&) noexcept;
    PictureEncoder& operator=(PictureEncoder&&) noexcept;
    ~PictureEncoder();

    // Takes the next picture, of the size in the options. The first is a key picture, and so is one that is asked to
    // be. The samples are copied where they are needed longer.
    Result<void> push(const PicturePlanes& picture, bool key = false);
    // No more pictures come: all that wait are coded.
    Result<void> finish();
    // The next picture that is coded, in the order in which they came; nothing while more have to follow.
    std::optional<CodedPicture> pull();
    // Both at once, where there is no foresight: the picture, coded.
    Result<CodedPicture> encode(const PicturePlanes& picture, bool key = false);
    // Set the quantiser or the rate from the next picture on; with foresight, from the next key picture on. bad_input:
    // out of its range, or the options chose the other of the two.
    Result<void> set_quantiser(int quantiser);
    Result<void> set_bitrate(double bits_per_second);

private:
    struct State;
    explicit PictureEncoder(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
