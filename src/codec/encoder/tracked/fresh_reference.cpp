#include "codec/encoder/tracked/fresh_reference.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace htvm::internal {
namespace {

constexpr auto& numbers = tracking_numbers;

// Not where a rate is to be kept or an error to be met, nor where somebody waits; surface that comes and goes is
// repaired by growing, and pictures on charts would begin anew too, which takes more bits than the I-frame.
bool may_begin_anew(const TrackedWork& work) {
    const auto& rate = work.configuration.options.rate;
    return !work.effort.motion_alone && rate.bits_per_second <= 0 && rate.target_error <= 0 &&
           !work.captured.may_repair && !work.configuration.tells_presence() &&
           work.configuration.options.texture.layout != TextureLayout::charts;
}

double error_of(const TrackedWork& work, const CodedMotion& frame) {
    StageClock clock(work.stages);
    const double out = errors_shown(work, frame.encoded.mesh, work.reference->decoded.detail).geometry_rms;
    clock.done("fit of the tracking");
    return out;
}

// By how much the I-frame changes the price of the frames that it will serve, as many as are expected: the logarithm of
// bits where the error is equal, since a bit that is saved brings so much.
double change_of_price(const TrackedWork& work, const FollowedCapture& followed, double error_now) {
    const auto& reference = *work.reference;
    const auto served = static_cast<double>(work.sequence.next_frame - reference.intra_frame);
    const double bytes_a_frame = (reference.intra_bytes + reference.patch_bytes + followed.tracked_bytes) / served;
    const double serves = std::min(static_cast<double>(followed.expected), numbers.most_served);
    const double error = std::sqrt(followed.squared / followed.measured);
    return std::log1p(reference.intra_bytes / (serves * bytes_a_frame)) +
           numbers.bits_by_error * std::log(error / error_now);
}

}  // namespace

FollowedCapture followed_on(FollowedCapture followed, double vertices_again) {
    if (vertices_again >= numbers.vertices_again)
        ++followed.frames;
    else
        followed.expected = std::max(std::exchange(followed.frames, 0), followed.expected / 2);
    return followed;
}

FollowedCapture followed_from_intra(FollowedCapture followed) {
    followed.tracked_bytes = 0;
    return followed;
}

Result<std::optional<TrackedIntra>> fresh_reference(const TrackedWork& work, const CodedMotion& frame, bool lost,
                                                    const FrameSteps& steps, FollowedCapture& followed) {
    const std::optional<TrackedIntra> none;
    followed.tracked_bytes += static_cast<double>(frame.bytes());
    if (!may_begin_anew(work)) return none;
    const auto intra_frame = work.reference->intra_frame, age = work.sequence.next_frame - intra_frame;
    const bool same_mesh = followed.frames >= age;  // as the I-frame was made of
    if (same_mesh && !lost && std::ranges::find(numbers.measured_at, age) != numbers.measured_at.end()) {
        if (std::exchange(followed.of_intra, intra_frame) != intra_frame) followed.squared = 0, followed.measured = 0;
        const double error = error_of(work, frame);
        followed.squared += error * error;
        ++followed.measured;
    }
    const bool anew = followed.frames == 0 && followed.expected >= numbers.least_kept;
    if (!anew || followed.measured == 0) return none;
    if (change_of_price(work, followed, error_of(work, frame)) > -numbers.least_saved) return none;
    auto intra = code_intra(work, steps, FrameReason::surface);
    if (!intra) return tl::unexpected(intra.error());
    intra->best_fit = work.sequence.history.best_fit;  // what is lost is still judged by the best T-frame there was
    return std::optional(std::move(*intra));
}

}  // namespace htvm::internal
