// Control: at which quality a frame is coded, where that follows from a rate or an error. It wraps either strategy and
// looks into no frame: what it must know of a kind, it reads in the table of kinds. A strategy's work gives it
// expected_type(), choose(), code_stand_in(), can_be_moved(), errors_of() and coded_frame().
#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "codec/encoder/coded_frame.h"
#include "codec/encoder/control/error_control.h"
#include "codec/encoder/control/rate_control.h"
#include "codec/format/frame_kinds.h"

namespace htvm::internal {

// The controllers learn from every attempt; the encoder tells them what was sent. At most one is there.
struct QualityControl {
    std::optional<RateController> rate;
    std::optional<ErrorController> error;
};

// The bits that sending a frame adds to its own: the sequence header's, which it brings if it comes first, or if it
// stands alone and the header was not sent for long.
struct HeaderBits {
    double if_alone = 0, otherwise = 0;
};
inline double bits_of(const CodedFrame& frame, const HeaderBits& header) {
    return 8.0 * static_cast<double>(frame.bytes()) + (stands_alone(frame.type) ? header.if_alone : header.otherwise);
}

// The error for a frame that takes this many bits even at the lowest quality.
tl::unexpected<Error> does_not_fit(const RateController& rate, double bits);

// Lowers the quality until the frame fits the buffer; at last, only its motion is coded. The first frames of a kind are
// coded up to four times, until their quality is the one that the rate allows.
template <class Work>
Result<typename Work::Frame> code_within_buffer(const Work& work, typename Work::Progress& progress,
                                                RateController& rate, const HeaderBits& header) {
    constexpr double far_off = 3;
    double quality = rate.quality(expected_type(work)), bits = 0;
    for (int trials = 3;;) {
        auto chosen = choose(work, progress, steps_of_quality(work.configuration, quality));
        if (!chosen) return chosen;
        auto& frame = coded_frame(*chosen);
        frame.quality = quality;
        bits = bits_of(frame, header);
        if (trials-- > 0 && rate.is_guess(rate_type(frame))) {
            // Without the codebooks that come with the first frame, as later frames do not need them.
            const auto own = static_cast<double>(frame.packets.back().payload.size() + packet_overhead);
            rate.tried({frame.type, quality, 8 * own, frame.renewed});
            const double better = rate.quality(frame.type);
            if (std::abs(better - quality) > far_off) {
                quality = better;
                continue;
            }
        }
        if (bits <= rate.room()) return chosen;
        const double lower = rate.lower_quality(frame.type, quality, bits);
        if (lower >= quality) break;
        quality = lower;
    }
    if (can_be_moved(work)) {
        auto stand_in = code_stand_in(work, progress, steps_of_quality(work.configuration, quality));
        if (!stand_in) return stand_in;
        auto& frame = coded_frame(*stand_in);
        frame.stands_in = true;
        frame.quality = quality;
        if (bits_of(frame, header) <= rate.room()) return stand_in;
    }
    auto error = does_not_fit(rate, bits);
    rate.dropped(quality);
    return error;
}

// Codes the frame again, with what was learned, if the error is off; of several attempts, the nearest is taken.
template <class Work>
Result<typename Work::Frame> code_to_error(const Work& work, typename Work::Progress& progress,
                                           ErrorController& control) {
    constexpr int attempts = 4;
    FrameType type = expected_type(work);
    std::optional<typename Work::Frame> nearest;
    double nearest_off = 0;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        const double quality = control.quality(type);
        auto chosen = choose(work, progress, steps_of_quality(work.configuration, quality));
        if (!chosen) return chosen;
        auto& frame = coded_frame(*chosen);
        frame.quality = quality;
        type = frame.type;
        const double error = work.configuration.scale.in_space(LatticeUnits(errors_of(work, frame).geometry_rms)).value;
        const bool whatever_quality = rules_of(type).rate == RateClass::moved;
        if (control.accept(type, quality, error) || whatever_quality) return chosen;
        const double off = std::abs(std::log2(error / work.configuration.options.rate.target_error));
        if (!nearest || off < nearest_off) nearest_off = off, nearest = std::move(*chosen);
    }
    return std::move(*nearest);
}

// The frame as it will be sent. Errors: those of the mesh or its coding; `limit` if it does not fit the buffer even at
// the lowest quality.
template <class Work>
Result<typename Work::Frame> code_under_control(const Work& work, typename Work::Progress& progress,
                                                QualityControl& control, const HeaderBits& header) {
    if (control.rate) return code_within_buffer(work, progress, *control.rate, header);
    if (control.error) return code_to_error(work, progress, *control.error);
    return choose(work, progress, work.configuration.steps);
}

}  // namespace htvm::internal
