#include "codec/encoder/tracked/fresh_reference.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "codec/encoder/tracked/tracked_coders.h"

namespace htvm::internal {
namespace {

constexpr auto& numbers = tracking_numbers;

// Not where a rate is to be kept or an error to be met, nor where somebody waits; surface that comes and goes is
// repaired by growing, and pictures on charts would begin anew too, which takes more bits than the I-frame.
bool may_begin_anew(const TrackedWork& work) {
    const auto& rate = work.configuration.options.rate;
    return work.effort.fresh_references && rate.bits_per_second <= 0 && rate.target_error <= 0 &&
           !work.captured.may_repair && !work.configuration.tells_presence() &&
           work.configuration.options.texture.layout != TextureLayout::charts;
}

// By how much an I-frame changes the price of the frames that it will serve, which may be as many as the last one has
// served: the logarithm of bits where the error is equal, since a bit that is saved brings so much. error: of its
// T-frames, in times of what it is now.
double change_of_price(const TrackedWork& work, const FollowedError& followed, double intra_bytes, double error) {
    const auto& reference = *work.reference;
    const auto served = static_cast<double>(work.sequence.next_frame - reference.intra_frame);
    const double bytes_a_frame = (reference.intra_bytes + reference.patch_bytes + followed.tracked_bytes) / served;
    const double serves = std::min(served, numbers.most_served);
    return std::log1p(intra_bytes / (serves * bytes_a_frame)) + numbers.bits_by_error * std::log(error);
}

std::shared_ptr<const MeasuredCapture> measured_capture(const TrackedWork& work, double error) {
    auto out = std::make_shared<MeasuredCapture>();
    out->mesh.positions = work.captured.mesh.positions;
    out->mesh.triangles = work.captured.mesh.triangles;
    out->surface = work.kept_surface;
    out->error = error;
    return out;
}

// How far that frame is off as a T-frame of this I-frame. The colours are left out.
Result<double> error_of_earlier(const TrackedWork& work, const MeasuredCapture& earlier, const TrackedIntra& intra,
                                const FrameSteps& steps) {
    const auto& configuration = work.configuration;
    auto mesh = intra.frame.decoded;
    auto detail = intra.frame.detail;
    mesh.colours.clear();
    detail.colours.clear();
    const auto reference =
        make_reference(configuration.header,
                       {.number = work.sequence.next_frame,
                        .step = intra.step,
                        .captured = intra.frame.captured,
                        .detail = std::move(detail)},
                       std::move(mesh), intra.pose, {.bones = false, .nodes = true}, configuration.threads);
    if (!reference) return tl::unexpected(reference.error());
    const auto how = deformation_options(configuration, work.effort);
    StageClock clock(work.stages);
    const auto registered = register_nodes(make_tracked_deformable(*reference->by_nodes, reference->detail, how),
                                           *earlier.surface, {}, how);
    clock.done("registration");
    auto options = tracked_frame_options(configuration, steps);
    options.detail = &reference->detail;
    const auto tracked = encode_tracked_frame(earlier.mesh, *earlier.surface, *reference->by_nodes, registered, nullptr,
                                              {}, options, work.stages);
    if (!tracked) return tl::unexpected(tracked.error());
    return errors_between(earlier.mesh, *earlier.surface, detailed(reference->detail, tracked->mesh),
                          configuration.threads)
        .geometry_rms;
}

}  // namespace

Result<std::optional<TrackedIntra>> fresh_reference(const TrackedWork& work, const FrameToBeat& frame,
                                                    const FrameSteps& steps, FollowedError& followed) {
    const std::optional<TrackedIntra> none;
    const auto number = work.sequence.next_frame;
    followed.tracked_bytes += static_cast<double>(frame.bytes);
    if (!may_begin_anew(work) || number % numbers.followed_every != 0) return none;
    StageClock clock(work.stages);
    const double now = errors_between(work.captured.mesh, work.surface, detailed(frame.detail, frame.decoded),
                                      work.configuration.threads)
                           .geometry_rms;
    clock.done("fit of the tracking");
    const auto earlier = std::exchange(followed.last, measured_capture(work, now));
    const double least = std::exchange(followed.least, earlier ? std::min(followed.least, now) : now);
    const bool just_tried = followed.tried && number - *followed.tried < numbers.tried_again_after &&
                            now < numbers.tried_again_from * followed.error_when_tried;
    if (!earlier || just_tried || number - work.reference->intra_frame < numbers.least_served) return none;
    // At best its T-frames are as near as the nearest ones of the last I-frame. Both frames are far off: where
    // something else begins between them, the earlier one is no measure.
    const double best = least / std::min(now, earlier->error);
    if (change_of_price(work, followed, work.reference->intra_bytes, best) > -numbers.least_saved) return none;
    auto intra = code_intra(work, steps, FrameReason::surface);
    if (!intra) return tl::unexpected(intra.error());
    const auto fresh = error_of_earlier(work, *earlier, *intra, steps);
    if (!fresh) return tl::unexpected(fresh.error());
    followed.tried = number;
    followed.error_when_tried = now;
    if (change_of_price(work, followed, static_cast<double>(intra->frame.bytes()), numbers.later_error * *fresh / now) >
        -numbers.least_saved)
        return none;
    intra->best_fit = work.sequence.history.best_fit;  // what is lost is still judged by the best T-frame there was
    return std::optional(std::move(*intra));
}

}  // namespace htvm::internal
