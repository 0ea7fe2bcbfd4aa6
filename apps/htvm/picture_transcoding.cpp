#include "picture_transcoding.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/image.h"
#include "texture/foreseeing_av1.h"

namespace htvm::app {
namespace {

// VP9 at its finest takes little; AV1 with foresight would take ten times as long as to encode the meshes.
int speed_of(PictureCoder coder) { return coder == PictureCoder::vp9 ? 5 : 8; }

}  // namespace

PictureTranscoding::PictureTranscoding(PictureTranscodingOptions options)
    : options_(std::move(options)), decoder_(PictureDecoderOptions{.threads = 0}) {}

Result<std::vector<Packet>> PictureTranscoding::take(Packet packet) {
    held_.push_back({std::move(packet)});
    if (held_.back().packet.kind == PacketKind::texture)
        if (auto coded = code(held_.back()); !coded) return tl::unexpected(coded.error());
    return give_ready();
}

Result<void> PictureTranscoding::code(Held& held) {
    const auto& packet = held.packet;
    const auto read = read_texture_picture(packet);
    if (!read) return tl::unexpected(read.error());
    if (!is_video(read->coder))
        return fail(ErrorKind::unsupported,
                    "its pictures are image files, which every browser shows, and are not coded anew");
    if (auto decoded = decoder_.decode(packet); !decoded) return decoded;
    const auto& planes = *decoder_.planes();
    if (planes.matrix != ColourMatrix::bt709 || planes.full_range)
        return fail(ErrorKind::unsupported, "its pictures are not of BT.709 in limited range, and are not coded anew");
    const bool even = options_.coder == PictureCoder::h264;
    const auto width = even ? planes.width + planes.width % 2 : planes.width;
    const auto height = even ? planes.height + planes.height % 2 : planes.height;
    const bool key = is_key_picture(packet);
    if (width != width_ || height != height_)
        if (auto begun = begin(width, height); !begun) return begun;
    held.picture.emplace(*read);
    held.picture->coder = options_.coder;
    held.picture->width = width;
    held.picture->height = height;
    held.picture->coded = {};
    ++totals_.pictures;
    totals_.bytes_before += packet.payload.size() + packet_overhead;
    std::optional<OwnPlanes> resampled;
    if (width != planes.width || height != planes.height)
        resampled.emplace(resized(image_of(planes), static_cast<int>(width), static_cast<int>(height)));
    const auto view = resampled ? resampled->view() : planes;
    if (auto* h264 = std::get_if<H264Pictures>(&encoder_)) return h264->push(view, key);
    return std::get<PictureEncoder>(encoder_).push(view, key);
}

Result<void> PictureTranscoding::begin(std::uint32_t width, std::uint32_t height) {
    if (auto ended = end(); !ended) return ended;
    take_coded();
    width_ = width;
    height_ = height;
    const double frames_per_second = std::clamp(options_.frames_per_second, 0.001, 1000.0);
    if (options_.coder == PictureCoder::h264) {
        encoder_.emplace<H264Pictures>(
            H264Options{options_.ffmpeg, width, height, frames_per_second, options_.quantiser});
        return {};
    }
    PictureEncoderOptions options;
    options.coder = options_.coder;
    options.width = width;
    options.height = height;
    options.frames_per_second = frames_per_second;
    options.quantiser = static_cast<int>(std::clamp(std::lround(options_.quantiser), 1L, 63L));
    options.speed = speed_of(options_.coder);
    options.foresight = options_.coder == PictureCoder::av1 && can_foresee(width, height);
    auto encoder = PictureEncoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    encoder_.emplace<PictureEncoder>(std::move(*encoder));
    return {};
}

Result<void> PictureTranscoding::end() {
    if (auto* h264 = std::get_if<H264Pictures>(&encoder_)) return h264->finish();
    if (auto* encoder = std::get_if<PictureEncoder>(&encoder_)) return encoder->finish();
    return {};
}

// What is coded by now goes into the packets that wait for it, in order.
void PictureTranscoding::take_coded() {
    const auto pull = [&]() -> std::optional<CodedPicture> {
        if (auto* h264 = std::get_if<H264Pictures>(&encoder_)) return h264->pull();
        if (auto* encoder = std::get_if<PictureEncoder>(&encoder_)) return encoder->pull();
        return std::nullopt;
    };
    for (auto& [packet, picture] : held_) {
        if (!picture) continue;
        const auto coded = pull();
        if (!coded) return;
        auto written = *std::exchange(picture, std::nullopt);
        written.coded = coded->bytes;
        const auto reference = coded->key ? packet.frame : last_;
        last_ = packet.frame;
        packet = write_texture_picture(written, {packet.frame, reference, packet.timestamp_us, /*referred=*/true});
        totals_.bytes += packet.payload.size() + packet_overhead;
    }
}

std::vector<Packet> PictureTranscoding::give_ready() {
    take_coded();
    std::vector<Packet> out;
    for (; !held_.empty() && !held_.front().picture; held_.pop_front()) out.push_back(std::move(held_.front().packet));
    return out;
}

Result<std::vector<Packet>> PictureTranscoding::finish() {
    if (auto ended = end(); !ended) return tl::unexpected(ended.error());
    auto out = give_ready();
    if (!held_.empty()) return fail(ErrorKind::bad_input, "pictures: the coder gave nothing for a picture");
    return out;
}

}  // namespace htvm::app
