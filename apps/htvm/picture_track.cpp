#include "picture_track.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>

#include "command_line/headings.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder_options.hpp"
#include "texture/foreseeing_av1.h"

namespace htvm::app {
namespace {

// What foresight takes for noise is what finer pictures are for: there it takes more bits for the same SSIM.
constexpr double finest_with_foresight = 85;

constexpr std::array<std::uint16_t, 3> no_gains = {picture_gain_one, picture_gain_one, picture_gain_one};

// Where who watches may start without the frames before: there pictures start too. Not where such frames are many, as
// I-frames are where they cost no more than EP-frames, or T-frames of the reference alone: key pictures always cost
// more.
bool is_start(const PacketHeader& frame, std::optional<std::uint32_t> last_key) {
    using namespace packet_flag;
    constexpr std::uint32_t apart = 30;
    const auto type = frame_type(frame.kind);
    if (!type || !frame.has(referred)) return false;
    const bool start = *type == FrameType::intra || (*type == FrameType::tracked && frame.has(access));
    return start && (!last_key || frame.frame - *last_key >= apart);
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
        .add_option(
            "--texture-size", options.size,
            "Pixels of the pictures' longer side (default: that of the capture's images; with --texture-as picture "
            "more if meshes show much of these, and by the quality: the finer it is, the more)")
        ->check(CLI::Range(16, static_cast<int>(most_picture_side)))
        ->type_name("NUMBER")
        ->group(heading::textures);
    add_choice(command, "--texture-codec", options.codec, video_codecs,
               "av1 (default) or vp9, which takes a fifth more bits, for players whose platform has no AV1")
        ->group(heading::textures);
    command
        .add_option("--texture-quality", options.quality,
                    "Of the pictures, 0 to 100 (default: -q, which balances them with the meshes)")
        ->check(CLI::Range(0.0, 100.0))
        ->type_name("NUMBER")
        ->group(heading::textures);
}

int quantiser_of(PictureCoder coder, double quality, bool foresees) {
    // The same number is coarser for VP9; with foresight finer where it is large, and coarser where it is small.
    const double offset = coder == PictureCoder::vp9 ? -4 : 0;
    const double out = foresees ? 79 - 0.64 * quality : 73 - 0.55 * quality + offset;
    return static_cast<int>(std::clamp(std::lround(out), 1L, 63L));
}

int picture_side_of(int usual_side, double quality) {
    constexpr double doubles_in = 58;         // steps of quality: twice the usual side at 100
    constexpr double step = 64, least = 256;  // below, charts of a person may find no room
    const double side = usual_side * std::exp2((quality - default_quality) / doubles_in);
    return static_cast<int>(std::clamp(step * std::round(side / step), least, static_cast<double>(most_picture_side)));
}

PictureSize film_size_of(const FilmWindow& film, int longer_side) {
    constexpr long least = 16;
    const double scale = static_cast<double>(longer_side) / std::max(film.width, film.height);
    const auto side = [&](int pixels) { return static_cast<int>(std::max(least, std::lround(scale * pixels))); };
    return {side(film.width), side(film.height)};
}

PictureSize film_size_at(const FilmWindow& film, double quality) {
    const int side = std::max(film.width, film.height);
    const int wanted = quality < default_quality ? picture_side_of(side, quality) : side;
    return film_size_of(film, std::min({wanted, side, static_cast<int>(most_picture_side)}));
}

Result<PictureTrack> PictureTrack::create(const Settings& settings) {
    PictureTrack out;
    if (settings.keep) return out;
    out.coder_ = settings.options.codec.value_or(PictureCoder::av1);
    out.width_ = static_cast<std::uint32_t>(settings.width);
    out.height_ = static_cast<std::uint32_t>(settings.height);
    if (settings.bake) {
        TextureBakingOptions baking;
        baking.width = settings.width;
        baking.height = settings.height;
        out.baker_.emplace(baking);
    }
    PictureEncoderOptions options;
    options.coder = out.coder_;
    options.width = out.width_;
    options.height = out.height_;
    options.frames_per_second = std::clamp(settings.frames_per_second, 0.001, 1000.0);
    options.bits_per_second = settings.bits_per_second > 0 ? (1 - share_of_meshes) * settings.bits_per_second : 0;
    out.frames_per_second_ = options.frames_per_second;
    out.bits_per_second_ = settings.bits_per_second;
    out.set_ = options.bits_per_second;
    options.buffer_seconds = settings.buffer_seconds;
    options.threads = settings.threads;
    const double quality = settings.options.quality.value_or(settings.quality);
    options.foresight = settings.speed_ahead && quality <= finest_with_foresight && out.coder_ == PictureCoder::av1 &&
                        options.bits_per_second == 0 && can_foresee(options.width, options.height);
    if (options.foresight) options.speed = *settings.speed_ahead;
    options.quantiser = quantiser_of(out.coder_, quality, options.foresight);
    auto encoder = PictureEncoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    out.encoder_.emplace(std::move(*encoder));
    return out;
}

void PictureTrack::add(std::int64_t timestamp_us, std::shared_ptr<const TexturedMesh> textured,
                       std::optional<FilmWindow> film) {
    waiting_.push_back({timestamp_us, std::move(textured), film});
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

Result<std::vector<Packet>> PictureTrack::lay_behind(Packet packet) {
    held_.push_back({std::move(packet)});
    if (frame_type(held_.back().packet.kind))
        if (auto added = add_picture(held_.back()); !added) return tl::unexpected(added.error());
    return give_ready();
}

Result<std::vector<Packet>> PictureTrack::finish() {
    if (encoder_)
        if (auto finished = encoder_->finish(); !finished) return tl::unexpected(finished.error());
    return give_ready();
}

Result<void> PictureTrack::add_picture(Held& held) {
    const auto& packet = held.packet;
    if (encoder_)
        if (auto followed = follow_meshes(packet_overhead + packet.payload.size()); !followed) return followed;
    // Those of frames that were dropped go.
    while (!waiting_.empty() && waiting_.front().timestamp_us < packet.timestamp_us) waiting_.pop_front();
    if (waiting_.empty() || waiting_.front().timestamp_us != packet.timestamp_us) return {};
    const auto captured = std::move(waiting_.front().textured);
    const auto film = waiting_.front().film;
    waiting_.pop_front();
    const bool key = is_start(packet, last_key_) || !last_;
    if (!captured->texture || (!baker_ && !film && captured->texture == last_ && !key)) return {};
    const auto start = std::chrono::steady_clock::now();
    const double baking = totals_.baking_seconds;
    if (baker_) {
        if (auto drawn = draw(held, *captured, key); !drawn) return drawn;
    } else if (film) {
        const auto picture = film_picture(*captured, *film, static_cast<int>(width_), static_cast<int>(height_));
        totals_.baking_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (auto coded = code_as_video(held, picture, no_gains, key); !coded) return coded;
    } else if (encoder_) {
        if (auto coded = code_as_video(held, *captured->texture, no_gains, key); !coded) return coded;
    } else {
        auto kept = kept_file(packet, *captured);
        if (!kept) return tl::unexpected(kept.error());
        held.picture.emplace(std::move(*kept));
    }
    totals_.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() -
                       (totals_.baking_seconds - baking);
    last_ = captured->texture;
    if (key || !encoder_) last_key_ = packet.frame;
    return {};
}

// Packets up to the first whose picture is not coded.
std::vector<Packet> PictureTrack::give_ready() {
    std::vector<Packet> out;
    for (; !held_.empty(); held_.pop_front()) {
        auto& [packet, being_coded, picture] = held_.front();
        if (being_coded) {
            auto coded = encoder_->pull();
            if (!coded) break;
            picture.emplace(packet_of(packet, *being_coded, std::move(*coded)));
        }
        out.push_back(std::move(packet));
        if (!picture) continue;
        ++totals_.pictures;
        totals_.key_pictures += is_key_picture(*picture) ? 1 : 0;
        totals_.bytes += packet_overhead + picture->payload.size();
        out.push_back(std::move(*picture));
    }
    return out;
}

// The captured texture, drawn in the layout of the mesh that is shown.
Result<void> PictureTrack::draw(Held& held, const TexturedMesh& captured, bool key) {
    const auto start = std::chrono::steady_clock::now();
    const auto found = shown_.find(held.packet.frame);
    if (found == shown_.end()) return fail(ErrorKind::bad_input, "nothing is shown of a frame that has a texture");
    const auto shown = std::move(found->second);
    shown_.erase(shown_.begin(), std::next(found));
    auto drawn = baker_->bake(captured, shown.mesh, shown.repeated);
    totals_.baking_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!drawn) return tl::unexpected(drawn.error());
    Gains gains{};
    for (std::size_t k = 0; k < 3; ++k)
        gains[k] = static_cast<std::uint16_t>(std::clamp(std::lround(drawn->gains[k] * picture_gain_one), 1L, 65535L));
    return code_as_video(held, drawn->picture, gains, key);
}

Result<void> PictureTrack::code_as_video(Held& held, const Image& image, const Gains& gains, bool key) {
    const auto width = static_cast<int>(width_), height = static_cast<int>(height_);
    const bool fits = image.width == width && image.height == height;
    const OwnPlanes planes(fits ? image : resized(image, width, height));
    held.being_coded = gains;
    return encoder_->push(planes.view(), key);
}

Packet PictureTrack::packet_of(const PacketHeader& frame, const Gains& gains, CodedPicture coded) {
    const auto reference = coded.key ? frame.frame : *last_number_;
    last_number_ = frame.frame;
    TexturePicture out;
    out.coder = coder_;
    out.width = width_;
    out.height = height_;
    out.gains = gains;
    out.coded = std::move(coded.bytes);
    return write_texture_picture(out, {frame.frame, reference, frame.timestamp_us, /*referred=*/true});
}

Result<Packet> PictureTrack::kept_file(const PacketHeader& frame, const TexturedMesh& captured) const {
    const auto coder = captured.texture_file ? coder_of_file(*captured.texture_file) : std::nullopt;
    if (!coder) return fail(ErrorKind::bad_input, "an image's file cannot be kept, as it is none of PNG, JPEG or WebP");
    TexturePicture out;
    out.coder = *coder;
    out.matrix = ColourMatrix::none;
    out.width = static_cast<std::uint32_t>(captured.texture->width);
    out.height = static_cast<std::uint32_t>(captured.texture->height);
    out.coded = *captured.texture_file;
    return write_texture_picture(out, {frame.frame, frame.frame, frame.timestamp_us, /*referred=*/true});
}

}  // namespace htvm::app
