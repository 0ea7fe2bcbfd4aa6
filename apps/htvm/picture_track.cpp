#include "picture_track.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>

#include "htvm/decoder.hpp"

namespace htvm::app {
namespace {

constexpr const char* group = "Pictures of textures";

// Where who watches may start without the frames before: there pictures start too. But for I-frames that are many, as
// where they cost no more than EP-frames: key pictures always cost more.
bool is_start(const PacketHeader& frame, std::optional<std::uint32_t> last_key) {
    using namespace packet_flag;
    constexpr std::uint32_t apart = 30;
    const auto type = frame_type(frame.kind);
    if (!type || !frame.has(referred)) return false;
    if (*type == FrameType::intra) return !last_key || frame.frame - *last_key >= apart;
    return *type == FrameType::tracked && frame.has(access);
}

std::optional<PictureCoder> coder_of_file(const std::vector<std::uint8_t>& bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 12));
    if (text.starts_with("\x89PNG")) return PictureCoder::png;
    if (text.starts_with("\xff\xd8")) return PictureCoder::jpeg;
    if (text.starts_with("RIFF") && text.ends_with("WEBP")) return PictureCoder::webp;
    return std::nullopt;
}

}  // namespace

void add_texture_picture_options(CLI::App& command, TexturePictureOptions& options) {
    command
        .add_option("--texture-size", options.size,
                    "Pixels of the pictures' longer side (default: that of the capture's images)")
        ->check(CLI::Range(16, static_cast<int>(most_picture_side)))
        ->type_name("NUMBER")
        ->group(group);
    command
        .add_option("--texture-codec", options.codec,
                    "av1 (default) or vp9, which takes a fifth more bits, for players whose platform has no AV1")
        ->check(CLI::IsMember({"av1", "vp9"}))
        ->group(group);
    command
        .add_option("--texture-quality", options.quality,
                    "Of the pictures, 0 to 100 (default: -q, which balances them with the meshes)")
        ->check(CLI::Range(0.0, 100.0))
        ->type_name("NUMBER")
        ->group(group);
}

int quantiser_of(PictureCoder coder, double quality) {
    const double offset = coder == PictureCoder::vp9 ? -4 : 0;  // the same number is coarser
    return static_cast<int>(std::clamp(std::lround(62 - 0.55 * quality + offset), 1L, 63L));
}

Result<PictureTrack> PictureTrack::create(const Settings& settings) {
    PictureTrack out;
    if (settings.keep) return out;
    out.coder_ = settings.options.codec == "vp9" ? PictureCoder::vp9 : PictureCoder::av1;
    const int longer = std::max(settings.width, settings.height);
    const double scale = settings.options.size > 0 ? static_cast<double>(settings.options.size) / longer : 1;
    constexpr long least = 16;
    out.width_ = static_cast<std::uint32_t>(std::max(least, std::lround(scale * settings.width)));
    out.height_ = static_cast<std::uint32_t>(std::max(least, std::lround(scale * settings.height)));
    PictureEncoderOptions options;
    options.coder = out.coder_;
    options.width = out.width_;
    options.height = out.height_;
    options.frames_per_second = std::clamp(settings.frames_per_second, 0.001, 1000.0);
    options.quantiser = quantiser_of(out.coder_, settings.options.quality.value_or(settings.quality));
    options.bits_per_second = settings.bits_per_second > 0 ? (1 - share_of_meshes) * settings.bits_per_second : 0;
    out.frames_per_second_ = options.frames_per_second;
    out.bits_per_second_ = settings.bits_per_second;
    out.set_ = options.bits_per_second;
    options.buffer_seconds = settings.buffer_seconds;
    options.threads = settings.threads;
    auto encoder = PictureEncoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    out.encoder_.emplace(std::move(*encoder));
    return out;
}

void PictureTrack::add(std::int64_t timestamp_us, std::shared_ptr<const Image> image,
                       std::shared_ptr<const std::vector<std::uint8_t>> file) {
    waiting_.push_back({timestamp_us, std::move(image), std::move(file)});
}

// Meshes take more at times; over a second or so, pictures then take less.
Result<void> PictureTrack::follow_meshes(std::size_t bytes) {
    if (!(bits_per_second_ > 0)) return {};
    constexpr double seconds = 1;
    constexpr double least = 0.1;  // of the rate, for pictures
    const double now = 8 * static_cast<double>(bytes) * frames_per_second_;
    const double before = of_meshes_.value_or(share_of_meshes * bits_per_second_);
    of_meshes_ = before + (now - before) * (1 - std::exp(-1 / (seconds * frames_per_second_)));
    const double left = std::max(bits_per_second_ - *of_meshes_, least * bits_per_second_);
    constexpr double noticed = 0.02;
    if (std::abs(left - set_) < noticed * set_) return {};
    set_ = left;
    return encoder_->set_bitrate(left);
}

Result<std::optional<Packet>> PictureTrack::behind(const PacketHeader& packet, std::size_t bytes) {
    if (!frame_type(packet.kind)) return std::nullopt;
    if (encoder_)
        if (auto followed = follow_meshes(bytes); !followed) return tl::unexpected(followed.error());
    // Those of frames that were dropped go.
    while (!waiting_.empty() && waiting_.front().timestamp_us < packet.timestamp_us) waiting_.pop_front();
    if (waiting_.empty() || waiting_.front().timestamp_us != packet.timestamp_us) return std::nullopt;
    const auto picture = std::move(waiting_.front());
    waiting_.pop_front();
    const bool key = is_start(packet, last_key_) || !last_;
    if (!picture.image || (picture.image == last_ && !key)) return std::nullopt;
    const auto start = std::chrono::steady_clock::now();
    auto coded = encoder_ ? coded_as_video(packet, picture, key) : kept_file(packet, picture);
    totals_.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!coded) return tl::unexpected(coded.error());
    last_ = picture.image;
    last_number_ = packet.frame;
    ++totals_.pictures;
    totals_.key_pictures += is_key_picture(*coded) ? 1 : 0;
    if (is_key_picture(*coded)) last_key_ = packet.frame;
    totals_.bytes += packet_overhead + coded->payload.size();
    return std::optional(std::move(*coded));
}

Result<Packet> PictureTrack::coded_as_video(const PacketHeader& frame, const Waiting& picture, bool key) {
    const auto& image = *picture.image;
    const auto width = static_cast<int>(width_), height = static_cast<int>(height_);
    const bool fits = image.width == width && image.height == height;
    const OwnPlanes planes(fits ? image : resized(image, width, height));
    const auto coded = encoder_->encode(planes.view(), key);
    if (!coded) return tl::unexpected(coded.error());
    TexturePicture out;
    out.coder = coder_;
    out.width = width_;
    out.height = height_;
    out.coded = coded->bytes;
    return write_texture_picture(
        out, {frame.frame, coded->key ? frame.frame : *last_number_, frame.timestamp_us, /*referred=*/true});
}

Result<Packet> PictureTrack::kept_file(const PacketHeader& frame, const Waiting& picture) const {
    const auto coder = picture.file ? coder_of_file(*picture.file) : std::nullopt;
    if (!coder) return fail(ErrorKind::bad_input, "an image's file cannot be kept, as it is none of PNG, JPEG or WebP");
    TexturePicture out;
    out.coder = *coder;
    out.matrix = ColourMatrix::none;
    out.width = static_cast<std::uint32_t>(picture.image->width);
    out.height = static_cast<std::uint32_t>(picture.image->height);
    out.coded = *picture.file;
    return write_texture_picture(out, {frame.frame, frame.frame, frame.timestamp_us, /*referred=*/true});
}

}  // namespace htvm::app
