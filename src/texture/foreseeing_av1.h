// AV1 by SVT-AV1, for files: a picture is coded once those that follow are there, so that what stays is told from the
// noise of single pictures. Coded are means of several pictures, which are not shown, and shown ones between them; each
// packet has those that its shown picture needs.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "htvm/picture_encoder.hpp"
#include "htvm/picture_planes.hpp"
#include "htvm/result.hpp"

namespace htvm {

// Whether pictures of this size can be coded so: SVT-AV1 takes none below 64 pixels, and no odd sides.
bool can_foresee(std::uint32_t width, std::uint32_t height);

// The pictures from one key picture to the next: the first is one, and no other.
class ForeseeingAv1 {
public:
    static Result<ForeseeingAv1> create(const PictureEncoderOptions& options);
    ForeseeingAv1(ForeseeingAv1&&) noexcept;
    ForeseeingAv1& operator=(ForeseeingAv1&&) noexcept;
    ~ForeseeingAv1();

    // Takes the next picture, and gives those that are coded by now, in the order in which they came.
    Result<std::vector<CodedPicture>> encode(const PicturePlanes& picture);
    // No more come: gives all that wait.
    Result<std::vector<CodedPicture>> finish();

private:
    struct State;
    explicit ForeseeingAv1(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace htvm
