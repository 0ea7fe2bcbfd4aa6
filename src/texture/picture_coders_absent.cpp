// In place of picture_encoder.cpp, picture_decoder.cpp and what these need where there are no coders of AV1 and VP9.
#include "htvm/picture_decoder.hpp"
#include "htvm/picture_encoder.hpp"
#include "texture/foreseeing_av1.h"

namespace htvm {
namespace {

tl::unexpected<Error> without_coders(const char* what) {
    return fail(ErrorKind::unsupported,
                std::string("this htvm was built without pictures of textures (AV1, VP9), so it cannot ") + what);
}

}  // namespace

bool can_foresee(std::uint32_t, std::uint32_t) { return false; }

struct PictureEncoder::State {};
PictureEncoder::PictureEncoder(PictureEncoder&&) noexcept = default;
PictureEncoder& PictureEncoder::operator=(PictureEncoder&&) noexcept = default;
PictureEncoder::~PictureEncoder() = default;
Result<PictureEncoder> PictureEncoder::create(const PictureEncoderOptions&) { return without_coders("make them"); }
Result<void> PictureEncoder::push(const PicturePlanes&, bool) { return without_coders("make them"); }
Result<void> PictureEncoder::finish() { return without_coders("make them"); }
std::optional<CodedPicture> PictureEncoder::pull() { return std::nullopt; }
Result<CodedPicture> PictureEncoder::encode(const PicturePlanes&, bool) { return without_coders("make them"); }
Result<void> PictureEncoder::set_quantiser(int) { return without_coders("make them"); }
Result<void> PictureEncoder::set_bitrate(double) { return without_coders("make them"); }

struct PictureDecoder::State {
    TexturePicture picture;
};
PictureDecoder::PictureDecoder(PictureDecoderOptions) : state_(std::make_unique<State>()) {}
PictureDecoder::PictureDecoder(PictureDecoder&&) noexcept = default;
PictureDecoder& PictureDecoder::operator=(PictureDecoder&&) noexcept = default;
PictureDecoder::~PictureDecoder() = default;
Result<void> PictureDecoder::decode(const Packet&) { return without_coders("show them"); }
void PictureDecoder::reset() {}
std::shared_ptr<const Image> PictureDecoder::image() { return nullptr; }
const PicturePlanes* PictureDecoder::planes() const { return nullptr; }
const TexturePicture& PictureDecoder::picture() const { return state_->picture; }
std::uint32_t PictureDecoder::frame() const { return 0; }

}  // namespace htvm
