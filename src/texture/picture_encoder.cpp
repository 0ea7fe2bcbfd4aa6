// AV1 by libaom and VP9 by libvpx, both in their real-time modes: one picture in, one packet out, every picture from
// those before it alone. With foresight AV1 by SVT-AV1, of which a new coder begins at each key picture: so pictures
// from one on are coded alike wherever the stream before them began.
#include "htvm/picture_encoder.hpp"

#include <aom/aom_encoder.h>
#include <aom/aomcx.h>
#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <variant>

#include "texture/foreseeing_av1.h"

namespace htvm {
namespace {

constexpr int largest_quantiser = 63;
constexpr std::uint32_t smallest_side = 16;
constexpr double least_rate = 1e3, most_rate = 1e9;
// Both count time in units of a rational of 32 bits.
constexpr int ticks_per_second = 90000;

tl::unexpected<Error> refused(const std::string& what) { return fail(ErrorKind::bad_input, "pictures: " + what); }

Result<void> check(const PictureEncoderOptions& options) {
    if (options.coder != PictureCoder::av1 && options.coder != PictureCoder::vp9)
        return fail(ErrorKind::unsupported,
                    std::string("pictures: ") + name_of(options.coder) + " is not coded here, but AV1 and VP9");
    for (const auto side : {options.width, options.height})
        if (side < smallest_side || side > most_picture_side)
            return refused("a side is " + std::to_string(side) + " pixels; " + std::to_string(smallest_side) + " to " +
                           std::to_string(most_picture_side) + " are possible");
    if (!(options.frames_per_second >= 0.001 && options.frames_per_second <= 1000))
        return refused("the frame rate is out of its range");
    if (options.quantiser < 0 || options.quantiser > largest_quantiser) return refused("the quantiser is not 0 to 63");
    if (options.bits_per_second != 0 &&
        !(options.bits_per_second >= least_rate && options.bits_per_second <= most_rate))
        return refused("the rate is out of its range");
    if (!(options.buffer_seconds >= 0.01 && options.buffer_seconds <= 3600))
        return refused("the buffer is out of its range");
    if (options.speed < 5 || options.speed > 9) return refused("the speed is not 5 to 9");
    if (options.foresight && (options.coder != PictureCoder::av1 || options.bits_per_second > 0))
        return refused("there is foresight for AV1 by the quantiser alone");
    return {};
}

// Both libraries' images have these members.
template <class LibraryImage>
void lend_planes(LibraryImage& image, const PicturePlanes& picture) {
    image.w = image.d_w = picture.width;
    image.h = image.d_h = picture.height;
    image.bit_depth = 8;
    image.bps = 12;
    image.x_chroma_shift = image.y_chroma_shift = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        image.planes[k] = const_cast<unsigned char*>(picture.samples[k]);
        image.stride[k] = static_cast<int>(picture.strides[k]);
    }
}

unsigned thread_count(unsigned asked) {
    constexpr unsigned most = 16;  // more find nothing to do in a picture
    return std::clamp(asked > 0 ? asked : std::thread::hardware_concurrency(), 1u, most);
}

// Tiles beside each other, as a power of two, each of at least 256 pixels: what several threads share. They do not
// depend on the number of threads, so that the bytes do not.
int log2_of_columns(std::uint32_t width) {
    int out = 0;
    while (out < 2 && (width >> (out + 1)) >= 512) ++out;
    return out;
}

// What both libraries' settings are called alike.
template <class Settings>
void set_common(Settings& settings, const PictureEncoderOptions& options) {
    settings.g_w = options.width;
    settings.g_h = options.height;
    settings.g_timebase = {1, ticks_per_second};
    settings.g_threads = thread_count(options.threads);
    settings.g_lag_in_frames = 0;
    settings.g_error_resilient = 0;
    settings.rc_dropframe_thresh = 0;
    settings.rc_min_quantizer = 0;
    settings.rc_max_quantizer = largest_quantiser;
}

template <class Settings>
void set_rate(Settings& settings, double bits_per_second, double buffer_seconds) {
    settings.rc_target_bitrate = static_cast<unsigned>(std::max(1L, std::lround(bits_per_second / 1000)));
    const auto milliseconds = static_cast<unsigned>(std::lround(1000 * buffer_seconds));
    settings.rc_buf_sz = std::max(milliseconds, 1u);
    settings.rc_buf_initial_sz = settings.rc_buf_optimal_sz = std::max(2 * milliseconds / 3, 1u);
    settings.rc_undershoot_pct = settings.rc_overshoot_pct = 50;
}

// A library's context is destroyed where it stands, so it does not move.
struct Av1 {
    aom_codec_ctx_t context{};
    aom_codec_enc_cfg_t settings{};
    bool open = false;
    Av1() = default;
    Av1(const Av1&) = delete;
    Av1& operator=(const Av1&) = delete;
    ~Av1() {
        if (open) aom_codec_destroy(&context);
    }
    std::string why() {
        const char* detail = aom_codec_error_detail(&context);
        return std::string("libaom: ") + (detail ? detail : aom_codec_error(&context));
    }
    Result<void> begin(const PictureEncoderOptions& options) {
        const auto* interface = aom_codec_av1_cx();
        if (aom_codec_enc_config_default(interface, &settings, AOM_USAGE_REALTIME) != AOM_CODEC_OK)
            return refused("libaom has no real-time mode");
        set_common(settings, options);
        settings.kf_mode = AOM_KF_DISABLED;
        settings.rc_end_usage = options.bits_per_second > 0 ? AOM_CBR : AOM_Q;
        if (options.bits_per_second > 0) set_rate(settings, options.bits_per_second, options.buffer_seconds);
        if (aom_codec_enc_init(&context, interface, &settings, 0) != AOM_CODEC_OK) return refused(why());
        open = true;
        const std::pair<int, int> controls[] = {
            {AOME_SET_CPUUSED, options.speed},
            {AOME_SET_CQ_LEVEL, options.quantiser},
            {AV1E_SET_ROW_MT, 1},
            {AV1E_SET_TILE_COLUMNS, log2_of_columns(options.width)},
            {AV1E_SET_AQ_MODE, options.bits_per_second > 0 ? 3 : 0},
            {AV1E_SET_ENABLE_OBMC, 0},
            {AV1E_SET_ENABLE_WARPED_MOTION, 0},
            {AV1E_SET_ENABLE_GLOBAL_MOTION, 0},
            {AV1E_SET_ENABLE_ORDER_HINT, 0},
            {AV1E_SET_COEFF_COST_UPD_FREQ, 2},
            {AV1E_SET_MODE_COST_UPD_FREQ, 2},
            {AV1E_SET_MV_COST_UPD_FREQ, 3},
            {AV1E_SET_COLOR_PRIMARIES, AOM_CICP_CP_BT_709},
            {AV1E_SET_TRANSFER_CHARACTERISTICS, AOM_CICP_TC_SRGB},
            {AV1E_SET_MATRIX_COEFFICIENTS, AOM_CICP_MC_BT_709},
            {AV1E_SET_COLOR_RANGE, AOM_CR_STUDIO_RANGE},
        };
        for (const auto& [control, value] : controls)
            if (aom_codec_control(&context, control, value) != AOM_CODEC_OK) return refused(why());
        return {};
    }
    Result<void> set_quantiser(int quantiser) {
        if (aom_codec_control(&context, AOME_SET_CQ_LEVEL, quantiser) != AOM_CODEC_OK) return refused(why());
        return {};
    }
    Result<void> apply_settings() {
        if (aom_codec_enc_config_set(&context, &settings) != AOM_CODEC_OK) return refused(why());
        return {};
    }
    Result<CodedPicture> encode(const PicturePlanes& picture, std::int64_t time, unsigned long ticks, bool key) {
        aom_image_t image{};
        image.fmt = AOM_IMG_FMT_I420;
        lend_planes(image, picture);
        image.cp = AOM_CICP_CP_BT_709;
        image.tc = AOM_CICP_TC_SRGB;
        image.mc = AOM_CICP_MC_BT_709;
        image.range = AOM_CR_STUDIO_RANGE;
        if (aom_codec_encode(&context, &image, time, ticks, key ? AOM_EFLAG_FORCE_KF : 0) != AOM_CODEC_OK)
            return refused(why());
        CodedPicture out;
        aom_codec_iter_t next = nullptr;
        while (const auto* packet = aom_codec_get_cx_data(&context, &next)) {
            if (packet->kind != AOM_CODEC_CX_FRAME_PKT) continue;
            const auto* bytes = static_cast<const std::uint8_t*>(packet->data.frame.buf);
            out.bytes.insert(out.bytes.end(), bytes, bytes + packet->data.frame.sz);
            out.key = (packet->data.frame.flags & AOM_FRAME_IS_KEY) != 0;
        }
        return out;
    }
};

struct Vp9 {
    vpx_codec_ctx_t context{};
    vpx_codec_enc_cfg_t settings{};
    bool open = false;
    Vp9() = default;
    Vp9(const Vp9&) = delete;
    Vp9& operator=(const Vp9&) = delete;
    ~Vp9() {
        if (open) vpx_codec_destroy(&context);
    }
    std::string why() {
        const char* detail = vpx_codec_error_detail(&context);
        return std::string("libvpx: ") + (detail ? detail : vpx_codec_error(&context));
    }
    Result<void> begin(const PictureEncoderOptions& options) {
        auto* interface = vpx_codec_vp9_cx();
        if (vpx_codec_enc_config_default(interface, &settings, 0) != VPX_CODEC_OK)
            return refused("libvpx has no VP9 encoder");
        set_common(settings, options);
        settings.kf_mode = VPX_KF_DISABLED;
        settings.rc_end_usage = options.bits_per_second > 0 ? VPX_CBR : VPX_Q;
        if (options.bits_per_second > 0) set_rate(settings, options.bits_per_second, options.buffer_seconds);
        if (vpx_codec_enc_init(&context, interface, &settings, 0) != VPX_CODEC_OK) return refused(why());
        open = true;
        const std::pair<int, int> controls[] = {
            {VP8E_SET_CPUUSED, options.speed},
            {VP8E_SET_CQ_LEVEL, options.quantiser},
            {VP8E_SET_ENABLEAUTOALTREF, 0},
            {VP9E_SET_ROW_MT, 1},
            {VP9E_SET_TILE_COLUMNS, log2_of_columns(options.width)},
            {VP9E_SET_AQ_MODE, options.bits_per_second > 0 ? 3 : 0},
            {VP9E_SET_COLOR_SPACE, VPX_CS_BT_709},
            {VP9E_SET_COLOR_RANGE, VPX_CR_STUDIO_RANGE},
        };
        for (const auto& [control, value] : controls)
            if (vpx_codec_control_(&context, control, value) != VPX_CODEC_OK) return refused(why());
        return {};
    }
    Result<void> set_quantiser(int quantiser) {
        if (vpx_codec_control_(&context, VP8E_SET_CQ_LEVEL, quantiser) != VPX_CODEC_OK) return refused(why());
        return {};
    }
    Result<void> apply_settings() {
        if (vpx_codec_enc_config_set(&context, &settings) != VPX_CODEC_OK) return refused(why());
        return {};
    }
    Result<CodedPicture> encode(const PicturePlanes& picture, std::int64_t time, unsigned long ticks, bool key) {
        vpx_image_t image{};
        image.fmt = VPX_IMG_FMT_I420;
        image.cs = VPX_CS_BT_709;
        image.range = VPX_CR_STUDIO_RANGE;
        lend_planes(image, picture);
        if (vpx_codec_encode(&context, &image, time, ticks, key ? VPX_EFLAG_FORCE_KF : 0, VPX_DL_REALTIME) !=
            VPX_CODEC_OK)
            return refused(why());
        CodedPicture out;
        vpx_codec_iter_t next = nullptr;
        while (const auto* packet = vpx_codec_get_cx_data(&context, &next)) {
            if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
            const auto* bytes = static_cast<const std::uint8_t*>(packet->data.frame.buf);
            out.bytes.insert(out.bytes.end(), bytes, bytes + packet->data.frame.sz);
            out.key = (packet->data.frame.flags & VPX_FRAME_IS_KEY) != 0;
        }
        return out;
    }
};

}  // namespace

struct PictureEncoder::State {
    PictureEncoderOptions options;
    bool foresees;
    std::variant<Av1, Vp9> coder;             // of pictures as they come
    std::optional<ForeseeingAv1> ahead = {};  // with foresight: of those since the last key picture
    std::uint64_t pictures = 0;
    std::deque<bool> is_key = {};  // of those that wait: whether each has to be a key picture
    std::deque<CodedPicture> ready = {};
    bool finished = false;
    explicit State(const PictureEncoderOptions& given)
        : options(given), foresees(given.foresight && can_foresee(given.width, given.height)) {
        if (options.coder == PictureCoder::vp9) coder.emplace<Vp9>();
    }
    Result<void> take(CodedPicture picture) {
        if (picture.bytes.empty() || is_key.empty()) return refused("the coder gave nothing for a picture");
        if (is_key.front() && !picture.key) return refused("the coder gave no key picture where one was asked for");
        is_key.pop_front();
        ready.push_back(std::move(picture));
        return {};
    }
    Result<void> take(Result<std::vector<CodedPicture>> coded) {
        if (!coded) return tl::unexpected(coded.error());
        for (auto& picture : *coded)
            if (auto taken = take(std::move(picture)); !taken) return taken;
        return {};
    }
    Result<void> push_ahead(const PicturePlanes& picture, bool key) {
        if (key) {
            if (auto ended = end_ahead(); !ended) return ended;
            auto next = ForeseeingAv1::create(options);
            if (!next) return tl::unexpected(next.error());
            ahead.emplace(std::move(*next));
        }
        is_key.push_back(key);
        return take(ahead->encode(picture));
    }
    // Before another begins, so that there is the memory of one.
    Result<void> end_ahead() {
        if (!ahead) return {};
        auto taken = take(ahead->finish());
        ahead.reset();
        if (taken && !is_key.empty()) return refused("the coder gave nothing for a picture");
        return taken;
    }
    Result<void> push_at_once(const PicturePlanes& picture, bool key) {
        // By number, not by timestamp: rate control shares out by pictures.
        const double ticks = ticks_per_second / options.frames_per_second;
        const auto from = std::llround(ticks * static_cast<double>(pictures));
        const auto to = std::llround(ticks * static_cast<double>(pictures + 1));
        auto coded = std::visit(
            [&](auto& its) {
                return its.encode(picture, from, static_cast<unsigned long>(std::max(to - from, 1LL)), key);
            },
            coder);
        if (!coded) return tl::unexpected(coded.error());
        is_key.push_back(key);
        return take(std::move(*coded));
    }
};

PictureEncoder::PictureEncoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
PictureEncoder::PictureEncoder(PictureEncoder&&) noexcept = default;
PictureEncoder& PictureEncoder::operator=(PictureEncoder&&) noexcept = default;
PictureEncoder::~PictureEncoder() = default;

Result<PictureEncoder> PictureEncoder::create(const PictureEncoderOptions& options) {
    if (auto fine = check(options); !fine) return tl::unexpected(fine.error());
    auto state = std::make_unique<State>(options);
    if (!state->foresees) {
        auto begun = std::visit([&](auto& coder) { return coder.begin(options); }, state->coder);
        if (!begun) return tl::unexpected(begun.error());
    }
    return PictureEncoder(std::move(state));
}

Result<void> PictureEncoder::push(const PicturePlanes& picture, bool key) {
    auto& its = *state_;
    if (picture.width != its.options.width || picture.height != its.options.height)
        return refused("a picture is " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                       " pixels, others " + std::to_string(its.options.width) + " x " +
                       std::to_string(its.options.height));
    if (picture.matrix != ColourMatrix::bt709 || picture.full_range)
        return refused("planes to be coded are of BT.709 in limited range");
    if (its.finished) return refused("a picture comes behind the last one");
    const bool wants_key = key || its.pictures == 0;
    auto pushed = its.foresees ? its.push_ahead(picture, wants_key) : its.push_at_once(picture, wants_key);
    ++its.pictures;
    return pushed;
}

Result<void> PictureEncoder::finish() {
    if (std::exchange(state_->finished, true)) return {};
    return state_->end_ahead();
}

std::optional<CodedPicture> PictureEncoder::pull() {
    auto& ready = state_->ready;
    if (ready.empty()) return std::nullopt;
    auto out = std::move(ready.front());
    ready.pop_front();
    return out;
}

Result<CodedPicture> PictureEncoder::encode(const PicturePlanes& picture, bool key) {
    if (state_->options.foresight) return refused("with foresight a picture is not coded at once");
    if (auto pushed = push(picture, key); !pushed) return tl::unexpected(pushed.error());
    auto coded = pull();
    if (!coded) return refused("the coder gave nothing for a picture");
    return std::move(*coded);
}

Result<void> PictureEncoder::set_quantiser(int quantiser) {
    if (state_->options.bits_per_second > 0) return refused("the rate decides the quantiser");
    if (quantiser < 0 || quantiser > largest_quantiser) return refused("the quantiser is not 0 to 63");
    state_->options.quantiser = quantiser;
    if (state_->foresees) return {};
    return std::visit([&](auto& coder) { return coder.set_quantiser(quantiser); }, state_->coder);
}

Result<void> PictureEncoder::set_bitrate(double bits_per_second) {
    if (!(state_->options.bits_per_second > 0)) return refused("the quantiser decides the rate");
    if (!(bits_per_second >= least_rate && bits_per_second <= most_rate))
        return refused("the rate is out of its range");
    return std::visit(
        [&](auto& coder) {
            set_rate(coder.settings, bits_per_second, state_->options.buffer_seconds);
            return coder.apply_settings();
        },
        state_->coder);
}

}  // namespace htvm
