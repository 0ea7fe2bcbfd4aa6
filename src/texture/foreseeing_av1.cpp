#include "texture/foreseeing_av1.h"

#include <EbSvtAv1Enc.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <string>
#include <utility>

#include "texture/thread_priority.h"

namespace htvm {
namespace {

constexpr std::uint32_t smallest_side = 64;
constexpr int least_quantiser = 1;  // 0 is taken for another mode

// A library prints nothing, and SVT-AV1 is told so by the environment alone, which may be changed only while no other
// thread reads it: as the program begins. What the user has set stays.
const bool is_silent = setenv("SVT_LOG", "0", /*replace=*/0) == 0;

tl::unexpected<Error> refused(const std::string& what, EbErrorType error) {
    const char* why = error == EB_ErrorInsufficientResources
                          ? " (there is too little memory, or there are too many threads)"
                      : error == EB_ErrorBadParameter ? " (a setting is out of its range)"
                                                      : "";
    return fail(ErrorKind::bad_input, "pictures: SVT-AV1 " + what + why);
}

// From those of libaom's real-time mode on: as long for a picture as that at its speed 8, with 9; twice with 8, and
// more than twice as much again with each step.
int preset_of(int speed) { return 2 * speed - 6; }

void set(EbSvtAv1EncConfiguration& settings, const PictureEncoderOptions& options) {
    settings.enc_mode = static_cast<std::int8_t>(preset_of(options.speed));
    settings.source_width = options.width;
    settings.source_height = options.height;
    settings.rate_control_mode = SVT_AV1_RC_MODE_CQP_OR_CRF;
    settings.qp = static_cast<std::uint32_t>(std::max(options.quantiser, least_quantiser));
    // By the quantiser it says nothing but what is counted as a rate.
    settings.frame_rate_numerator = 30;
    settings.frame_rate_denominator = 1;
    settings.intra_period_length = -1;
    settings.intra_refresh_type = SVT_AV1_KF_REFRESH;
    settings.scene_change_detection = 0;
    // Groups of 16: with 8 a seventh more bits; with 32 no fewer, and half as much memory again. Looking beyond the
    // next group brings nothing either.
    settings.hierarchical_levels = 4;
    settings.look_ahead_distance = 0;
    settings.color_primaries = EB_CICP_CP_BT_709;
    settings.transfer_characteristics = EB_CICP_TC_SRGB;
    settings.matrix_coefficients = EB_CICP_MC_BT_709;
    settings.color_range = EB_CR_STUDIO_RANGE;
    settings.logical_processors = options.threads;
}

// Held where a coder begins or ends: SVT-AV1 then sets up and takes down what all coders of a program share, and two at
// once, as of chunks that are encoded side by side, leave its memory in disorder.
std::mutex& one_at_a_time() {
    static std::mutex mutex;
    return mutex;
}

}  // namespace

bool can_foresee(std::uint32_t width, std::uint32_t height) {
    return std::min(width, height) >= smallest_side && width % 2 == 0 && height % 2 == 0;
}

struct ForeseeingAv1::State {
    EbComponentType* encoder = nullptr;
    EbSvtAv1EncConfiguration settings{};
    bool open = false;
    std::int64_t pictures = 0;
    State() = default;
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        const std::lock_guard lock(one_at_a_time());
        if (open) svt_av1_enc_deinit(encoder);
        if (encoder) svt_av1_enc_deinit_handle(encoder);
    }

    // Those that are coded by now; with all, whatever waits.
    Result<std::vector<CodedPicture>> packets(bool all) {
        std::vector<CodedPicture> out;
        for (;;) {
            EbBufferHeaderType* packet = nullptr;
            const auto got = svt_av1_enc_get_packet(encoder, &packet, all ? 1 : 0);
            if (got == EB_NoErrorEmptyQueue) return out;
            if (got != EB_ErrorNone || !packet) return refused("fails to code a picture", got);
            const bool last = (packet->flags & EB_BUFFERFLAG_EOS) != 0;
            if (packet->n_filled_len > 0)
                out.push_back({{packet->p_buffer, packet->p_buffer + packet->n_filled_len},
                               packet->pic_type == EB_AV1_KEY_PICTURE});
            svt_av1_enc_release_out_buffer(&packet);
            if (last) return out;
        }
    }
};

ForeseeingAv1::ForeseeingAv1(std::unique_ptr<State> state) : state_(std::move(state)) {}
ForeseeingAv1::ForeseeingAv1(ForeseeingAv1&&) noexcept = default;
ForeseeingAv1& ForeseeingAv1::operator=(ForeseeingAv1&&) noexcept = default;
ForeseeingAv1::~ForeseeingAv1() = default;

Result<ForeseeingAv1> ForeseeingAv1::create(const PictureEncoderOptions& options) {
    auto state = std::make_unique<State>();
    const std::lock_guard lock(one_at_a_time());  // behind the state, whose end takes it, too
    const auto before = threads_before_all_else();
    if (const auto made = svt_av1_enc_init_handle(&state->encoder, nullptr, &state->settings); made != EB_ErrorNone)
        return refused("gives no coder", made);
    set(state->settings, options);
    if (const auto taken = svt_av1_enc_set_parameter(state->encoder, &state->settings); taken != EB_ErrorNone)
        return refused("refuses the settings", taken);
    const auto begun = svt_av1_enc_init(state->encoder);
    state->open = true;  // half of it may be
    take_back_precedence(/*but_from=*/before);
    if (begun != EB_ErrorNone) return refused("does not begin", begun);
    return ForeseeingAv1(std::move(state));
}

Result<std::vector<CodedPicture>> ForeseeingAv1::encode(const PicturePlanes& picture) {
    auto& its = *state_;
    EbSvtIOFormat planes{};
    planes.luma = const_cast<std::uint8_t*>(picture.samples[0]);
    planes.cb = const_cast<std::uint8_t*>(picture.samples[1]);
    planes.cr = const_cast<std::uint8_t*>(picture.samples[2]);
    planes.y_stride = static_cast<std::uint32_t>(picture.strides[0]);
    planes.cb_stride = static_cast<std::uint32_t>(picture.strides[1]);
    planes.cr_stride = static_cast<std::uint32_t>(picture.strides[2]);
    planes.width = picture.width;
    planes.height = picture.height;
    planes.color_fmt = EB_YUV420;
    planes.bit_depth = EB_EIGHT_BIT;
    EbBufferHeaderType header{};
    header.size = sizeof header;
    header.p_buffer = reinterpret_cast<std::uint8_t*>(&planes);
    header.n_filled_len = picture.width * picture.height / 2 * 3;
    header.pts = its.pictures++;
    header.pic_type = EB_AV1_INVALID_PICTURE;  // whatever it likes
    if (const auto sent = svt_av1_enc_send_picture(its.encoder, &header); sent != EB_ErrorNone)
        return refused("does not take a picture", sent);
    return its.packets(/*all=*/false);
}

Result<std::vector<CodedPicture>> ForeseeingAv1::finish() {
    auto& its = *state_;
    EbBufferHeaderType end{};
    end.size = sizeof end;
    end.flags = EB_BUFFERFLAG_EOS;
    end.pic_type = EB_AV1_INVALID_PICTURE;
    if (const auto sent = svt_av1_enc_send_picture(its.encoder, &end); sent != EB_ErrorNone)
        return refused("does not end", sent);
    return its.packets(/*all=*/true);
}

}  // namespace htvm
