#include "htvm/picture_decoder.hpp"

#include <dav1d/dav1d.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "texture/vp9_frame_size.h"

namespace htvm {

using namespace internal;
namespace {

tl::unexpected<Error> corrupt(const std::string& what) { return fail(ErrorKind::corrupt_stream, "picture: " + what); }

unsigned thread_count(unsigned asked) {
    return std::clamp(asked > 0 ? asked : std::thread::hardware_concurrency(), 1u, 16u);
}

// Planes that stay where they are while their owner lives.
struct Decoded {
    PicturePlanes planes;
    std::shared_ptr<const void> owner;
};

// AV1, a temporal unit at a time.
class Av1 {
public:
    static Result<std::unique_ptr<Av1>> open(const PictureDecoderOptions& options) {
        Dav1dSettings settings;
        dav1d_default_settings(&settings);
        settings.n_threads = static_cast<int>(thread_count(options.threads));
        settings.max_frame_delay = 1;
        settings.frame_size_limit = options.largest_side * options.largest_side;
        settings.logger = {nullptr, nullptr};
        auto out = std::unique_ptr<Av1>(new Av1);
        if (dav1d_open(&out->context_, &settings) != 0)
            return fail(ErrorKind::limit, "picture: there is no memory for a decoder of AV1");
        return out;
    }
    Av1(const Av1&) = delete;
    Av1& operator=(const Av1&) = delete;
    ~Av1() {
        if (context_) dav1d_close(&context_);
    }

    Result<Decoded> decode(std::span<const std::uint8_t> bytes) {
        Dav1dData data{};
        auto* copy = dav1d_data_create(&data, bytes.size());
        if (!copy) return fail(ErrorKind::limit, "picture: there is no memory for it");
        std::copy(bytes.begin(), bytes.end(), copy);
        std::shared_ptr<Dav1dPicture> last;
        // All of it goes in, and what comes out is taken meanwhile; of a sound temporal unit that is one picture.
        while (data.sz > 0) {
            const int sent = dav1d_send_data(context_, &data);
            const auto [taken, error] = receive_pictures(last);
            if ((sent < 0 && sent != DAV1D_ERR(EAGAIN)) || error || (sent < 0 && !taken)) {
                dav1d_data_unref(&data);
                dav1d_flush(context_);
                return corrupt("it is no sound AV1");
            }
        }
        if (receive_pictures(last).error) {
            dav1d_flush(context_);
            return corrupt("it is no sound AV1");
        }
        if (!last) return corrupt("its AV1 shows nothing");
        const auto& shown = *last;
        if (shown.p.bpc != 8 || shown.p.layout != DAV1D_PIXEL_LAYOUT_I420)
            return corrupt("its AV1 is not 4:2:0 with 8 bits");
        Decoded out;
        out.planes.width = static_cast<std::uint32_t>(shown.p.w);
        out.planes.height = static_cast<std::uint32_t>(shown.p.h);
        for (std::size_t k = 0; k < 3; ++k) {
            out.planes.samples[k] = static_cast<const std::uint8_t*>(shown.data[k]);
            out.planes.strides[k] = shown.stride[k == 0 ? 0 : 1];
        }
        out.owner = last;
        return out;
    }

private:
    Av1() = default;
    struct Received {
        bool any, error;
    };
    Received receive_pictures(std::shared_ptr<Dav1dPicture>& last) {
        for (bool any = false;; any = true) {
            auto picture = std::shared_ptr<Dav1dPicture>(new Dav1dPicture{}, [](Dav1dPicture* one) {
                dav1d_picture_unref(one);
                delete one;
            });
            const int got = dav1d_get_picture(context_, picture.get());
            if (got == DAV1D_ERR(EAGAIN)) return {any, false};
            if (got < 0) return {any, true};
            last = std::move(picture);
        }
    }
    Dav1dContext* context_ = nullptr;
};

// VP9, a frame at a time.
class Vp9 {
public:
    static Result<std::unique_ptr<Vp9>> open(const PictureDecoderOptions& options) {
        auto out = std::unique_ptr<Vp9>(new Vp9);
        out->largest_side_ = options.largest_side;
        vpx_codec_dec_cfg_t settings{};
        settings.threads = thread_count(options.threads);
        if (vpx_codec_dec_init(&out->context_, vpx_codec_vp9_dx(), &settings, 0) != VPX_CODEC_OK)
            return fail(ErrorKind::limit, "picture: there is no memory for a decoder of VP9");
        out->open_ = true;
        return out;
    }
    Vp9(const Vp9&) = delete;
    Vp9& operator=(const Vp9&) = delete;
    ~Vp9() {
        if (open_) vpx_codec_destroy(&context_);
    }

    Result<Decoded> decode(std::span<const std::uint8_t> bytes) {
        const auto packet = as_superframe(bytes);
        const auto longest = longest_vp9_side(packet);
        if (!longest) return corrupt("it is no sound VP9 of profile 0");
        if (*longest > largest_side_) return fail(ErrorKind::limit, "picture: its VP9 is larger than allowed");
        if (vpx_codec_decode(&context_, packet.data(), static_cast<unsigned>(packet.size()), nullptr, 0) !=
            VPX_CODEC_OK)
            return corrupt("it is no sound VP9");
        vpx_codec_iter_t next = nullptr;
        const vpx_image_t* shown = nullptr;
        while (const auto* image = vpx_codec_get_frame(&context_, &next)) shown = image;
        if (!shown) return corrupt("its VP9 shows nothing");
        if (shown->fmt != VPX_IMG_FMT_I420 || shown->bit_depth != 8) return corrupt("its VP9 is not 4:2:0 with 8 bits");
        Decoded out;
        out.planes.width = shown->d_w;
        out.planes.height = shown->d_h;
        // A copy, since libvpx keeps its planes only until it is given the next frame, be that damaged.
        const auto samples = std::make_shared<std::array<std::vector<std::uint8_t>, 3>>();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t width = k == 0 ? shown->d_w : (shown->d_w + 1) / 2;
            const std::size_t height = k == 0 ? shown->d_h : (shown->d_h + 1) / 2;
            auto& plane = (*samples)[k];
            plane.resize(width * height);
            for (std::size_t y = 0; y < height; ++y)
                std::copy_n(shown->planes[k] + static_cast<std::ptrdiff_t>(y) * shown->stride[k], width,
                            plane.begin() + static_cast<std::ptrdiff_t>(y * width));
            out.planes.samples[k] = plane.data();
            out.planes.strides[k] = static_cast<std::ptrdiff_t>(width);
        }
        out.owner = samples;
        return out;
    }

private:
    Vp9() = default;
    // Behind a frame without an index libvpx would look for another one, whose size nobody has checked.
    static std::vector<std::uint8_t> as_superframe(std::span<const std::uint8_t> bytes) {
        std::vector<std::uint8_t> out(bytes.begin(), bytes.end());
        if (bytes.empty() || (bytes.back() & 0xe0u) == 0xc0) return out;
        constexpr std::uint8_t marker = 0xd8;  // one frame, its size in four bytes
        out.push_back(marker);
        for (int byte = 0; byte < 4; ++byte) out.push_back(static_cast<std::uint8_t>(bytes.size() >> (8 * byte)));
        out.push_back(marker);
        return out;
    }
    vpx_codec_ctx_t context_{};
    bool open_ = false;
    std::uint32_t largest_side_ = most_picture_side;
};

}  // namespace

struct PictureDecoder::State {
    PictureDecoderOptions options;
    std::unique_ptr<Av1> av1;
    std::unique_ptr<Vp9> vp9;
    std::optional<PictureCoder> goes_on;  // a picture of this coder was decoded, and others may follow it
    std::uint32_t referred = 0;           // its frame

    TexturePicture picture = {};
    std::uint32_t frame = 0;
    std::optional<PicturePlanes> planes = {};
    std::shared_ptr<const void> owner = {};
    std::shared_ptr<const Image> image = {};

    void forget() {
        picture = {};
        frame = 0;
        planes.reset();
        owner.reset();
        image.reset();
    }

    Result<Decoded> decode_video(const TexturePicture& read) {
        if (read.coder == PictureCoder::av1) {
            if (!av1) {
                auto opened = Av1::open(options);
                if (!opened) return tl::unexpected(opened.error());
                av1 = std::move(*opened);
            }
            return av1->decode(read.coded);
        }
        if (!vp9) {
            auto opened = Vp9::open(options);
            if (!opened) return tl::unexpected(opened.error());
            vp9 = std::move(*opened);
        }
        return vp9->decode(read.coded);
    }

    Result<void> show_video(const TexturePicture& read, const PacketHeader& header) {
        if (!is_key_picture(header) && (goes_on != read.coder || referred != header.reference))
            return corrupt("the one that it needs, of frame " + std::to_string(header.reference) + ", is not there");
        goes_on.reset();
        auto decoded = decode_video(read);
        if (!decoded) return tl::unexpected(decoded.error());
        if (decoded->planes.width != read.width || decoded->planes.height != read.height)
            return corrupt("it is of another size than its packet says");
        decoded->planes.matrix = read.matrix;
        decoded->planes.full_range = read.full_range;
        planes = decoded->planes;
        owner = std::move(decoded->owner);
        image.reset();
        goes_on = read.coder;
        referred = header.frame;
        return {};
    }

    Result<void> show_file(const TexturePicture& read) {
        if (!options.read_image_file)
            return fail(ErrorKind::unsupported,
                        std::string("picture: ") + name_of(read.coder) + " files are not read here");
        auto decoded = options.read_image_file(read.coded);
        if (!decoded && decoded.error().kind == ErrorKind::limit)
            return fail(ErrorKind::limit, "picture: " + decoded.error().message);
        if (!decoded) return corrupt(decoded.error().message);
        if (static_cast<std::uint32_t>(decoded->width) != read.width ||
            static_cast<std::uint32_t>(decoded->height) != read.height)
            return corrupt("it is of another size than its packet says");
        for (std::size_t i = 0; i < decoded->rgb.size(); ++i) {
            const auto gain = read.gains[i % 3];
            if (gain == picture_gain_one) continue;
            const auto value = (std::uint32_t{decoded->rgb[i]} * gain + picture_gain_one / 2) / picture_gain_one;
            decoded->rgb[i] = static_cast<std::uint8_t>(std::min(value, 255u));
        }
        image = std::make_shared<const Image>(std::move(*decoded));
        planes.reset();
        owner.reset();
        return {};
    }
};

PictureDecoder::PictureDecoder(PictureDecoderOptions options) : state_(std::make_unique<State>()) {
    state_->options = std::move(options);
}
PictureDecoder::PictureDecoder(PictureDecoder&&) noexcept = default;
PictureDecoder& PictureDecoder::operator=(PictureDecoder&&) noexcept = default;
PictureDecoder::~PictureDecoder() = default;

Result<void> PictureDecoder::decode(const Packet& packet) {
    auto& its = *state_;
    const auto read = read_texture_picture(packet);
    if (!read) return tl::unexpected(read.error());
    if (read->width > its.options.largest_side || read->height > its.options.largest_side)
        return fail(ErrorKind::limit, "picture: it is larger than allowed");
    if (read->coder == PictureCoder::h264)
        return fail(ErrorKind::unsupported,
                    "picture: H.264 is for browsers, and is not decoded here; the stream that it was made of has the "
                    "same pictures as AV1 or VP9");
    auto taken = is_video(read->coder) ? its.show_video(*read, packet) : its.show_file(*read);
    if (!taken) return taken;
    its.picture = *read;
    its.picture.coded = {};
    its.frame = packet.frame;
    return {};
}

void PictureDecoder::reset() {
    state_->forget();
    state_->av1.reset();
    state_->vp9.reset();
    state_->goes_on.reset();
}

std::shared_ptr<const Image> PictureDecoder::image() {
    auto& its = *state_;
    if (!its.image && its.planes) its.image = std::make_shared<const Image>(image_of(*its.planes, its.picture.gains));
    return its.image;
}

const PicturePlanes* PictureDecoder::planes() const { return state_->planes ? &*state_->planes : nullptr; }

const TexturePicture& PictureDecoder::picture() const { return state_->picture; }

std::uint32_t PictureDecoder::frame() const { return state_->frame; }

}  // namespace htvm
