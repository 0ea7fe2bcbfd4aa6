#include "codec/encoder/bones/bones_choice.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "codec/encoder/bones/bones_coders.h"
#include "codec/encoder/bones/scene_change.h"

namespace htvm::internal {
namespace {

using Frame = BonesWork::Frame;

Result<Frame> as_frame(Result<BonesIntra> intra) {
    if (!intra) return tl::unexpected(intra.error());
    return Frame(std::move(*intra));
}

bool is_scene_change(const BonesWork& work) {
    const auto& configuration = work.configuration;
    if (!configuration.options.topology.scene_changes) return false;
    constexpr AdultMillimetres far(150);
    return scene_changed(work.mesh().positions, work.motion->predicted, configuration.scale.on_lattice(far));
}

// Why it must be an I-frame, before anything is coded; nothing if it need not be.
std::optional<FrameReason> why_intra(const BonesWork& work) {
    if (intra_is_due(work)) return reason_of_due(work.configuration, work.sequence.next_frame);
    if (is_scene_change(work)) return FrameReason::cut;
    return std::nullopt;
}

// ---- what may be animated -------------------------------------------------------------------------------------------

// The largest error, in lattice units, that a part may have and still be animated; 0: not checked.
double largest_animation_error(const Configuration& configuration) {
    const auto& options = configuration.options;
    double largest = options.topology.animation_error;
    if (options.rate.target_error > 0) largest = std::min(largest > 0 ? largest : 1e6, options.rate.target_error);
    return largest * configuration.scale.units;
}

bool animation_fits(const BonesWork& work) {
    const double largest = largest_animation_error(work.configuration);
    if (!(largest > 0)) return true;
    const auto& fit = *work.animation;
    return std::all_of(fit.rms.begin(), fit.rms.end(), [&](double rms) { return rms <= largest; });
}

std::vector<double> shifts_of_bones(const BonesWork& work) {
    return bone_shifts(work.reference().decoded.skinned, work.configuration.header.skeleton.bones, work.captured.pose);
}

BonesMoved code_whole(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    return code_enhanced(work, steps, std::exchange(progress.quantised, std::nullopt));
}

// Uses motion-based coding if it is enabled and leaves something out; otherwise codes the whole frame.
BonesMoved code_what_moves(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    const double still_below = work.configuration.options.topology.still_below * work.configuration.scale.units;
    if (!(still_below > 0)) return code_whole(work, progress, steps);
    const auto shifts = shifts_of_bones(work);
    if (std::all_of(shifts.begin(), shifts.end(), [&](double shift) { return shift >= still_below; }))
        return code_whole(work, progress, steps);
    const auto coded = choose_coded_bones(shifts, *work.animation, LatticeUnits(still_below),
                                          LatticeUnits(largest_animation_error(work.configuration)));
    return code_coded_bones(work, steps, coded, std::exchange(progress.quantised, std::nullopt));
}

// ---- FrameChoice::motion --------------------------------------------------------------------------------------------

Result<Frame> choose_by_motion(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    const auto shifts = shifts_of_bones(work);
    const double motion =
        work.configuration.scale.in_space(LatticeUnits(std::accumulate(shifts.begin(), shifts.end(), 0.0))).value;
    const auto& options = work.configuration.options.topology;
    if (options.intra_above > 0 && motion > options.intra_above && may_be_intra(work))
        return as_frame(code_intra(work, steps, FrameReason::surface));
    if (motion < options.predicted_below && animation_fits(work)) return Frame(code_predicted(work));
    return Frame(code_what_moves(work, progress, steps));
}

// ---- FrameChoice::cheaper -------------------------------------------------------------------------------------------

// Bytes per vertex of an I-frame that nothing refers to: found once per reference, since it hardly changes.
Result<double> plain_intra_bytes(const BonesWork& work, const FrameSteps& steps) {
    const auto& known = work.sequence.history.plain_intra_bytes;
    if (known > 0 && work.reference().steps == steps) return known;
    const auto plain = code_unreferred_intra(work, steps, FrameReason::none);
    if (!plain) return tl::unexpected(plain.error());
    return static_cast<double>(plain->frame.bytes()) / static_cast<double>(work.mesh().positions.size());
}

// A codebook is used for about ten frames, so a tenth of it counts.
double bytes_in_the_long_run(const CodedFrame& coded) {
    const auto frame = static_cast<double>(coded.packets.back().payload.size() + packet_overhead);
    return frame + (static_cast<double>(coded.bytes()) - frame) / 10;
}

// An EP-frame if it takes fewer bits than an I-frame at the same steps, where both have the same error. If it does not,
// as at high quality or where bones do not describe how the surface moves, EP-frames are tried again only after a
// while. So a capture that EP-frames do not suit takes hardly more time than I-frames alone.
Result<Frame> choose_the_cheaper(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    if (work.configuration.options.topology.still_below > 0) return Frame(code_what_moves(work, progress, steps));
    const bool suspended = work.sequence.next_frame < work.sequence.trial.next && may_be_intra(work);
    if (!suspended) {
        auto enhanced = code_whole(work, progress, steps);
        if (!may_be_intra(work)) return Frame(std::move(enhanced));
        const auto plain = plain_intra_bytes(work, steps);
        if (!plain) return tl::unexpected(plain.error());
        enhanced.history.plain_intra_bytes = *plain;
        const double intra = *plain * static_cast<double>(work.mesh().positions.size());
        // A single bone that stands in for a skeleton leaves larger residuals, which have a larger error at the same
        // steps: 0.75 instead of 0.65 mm on a man who talks. At the same error, EP-frames still take 28 % fewer bits
        // there.
        const double share = work.configuration.header.has_skeleton ? 1 : 0.9;
        if (bytes_in_the_long_run(enhanced.frame) < share * intra) {
            enhanced.trial = EnhancedTrial{};
            return Frame(std::move(enhanced));
        }
    }
    // The I-frame sent before the next trial will be its reference.
    EnhancedTrial trial = work.sequence.trial;
    if (!suspended) {
        trial.losses = std::min(trial.losses + 1, 6);
        trial.next = work.sequence.next_frame + (2u << trial.losses);
    }
    const bool referred_to = work.sequence.next_frame + 1 >= trial.next;
    auto intra = referred_to ? code_intra(work, steps, FrameReason::rate)
                             : code_unreferred_intra(work, steps, FrameReason::rate);
    if (intra) intra->trial = trial;
    return as_frame(std::move(intra));
}

// ---- FrameChoice::rate_distortion -----------------------------------------------------------------------------------

// The errors that a frame may have: those of an I-frame at the same quality, plus a margin for the estimate.
SurfaceErrors allowed_errors(const BonesReference& reference, const FrameSteps& steps) {
    constexpr double tolerance = 1.05;
    const double geometry = static_cast<double>(steps.geometry) / reference.steps.geometry;
    const double colour = static_cast<double>(steps.colour) / reference.steps.colour;
    return {tolerance * geometry * reference.plain.geometry_rms, tolerance * colour * reference.plain.colour_rms};
}

bool within(const SurfaceErrors& errors, const SurfaceErrors& allowed) {
    return errors.geometry_rms <= allowed.geometry_rms && errors.colour_rms <= allowed.colour_rms;
}

// Codes an I-frame, and measures the errors of one that nothing refers to.
Result<BonesIntra> code_measured_intra(const BonesWork& work, const FrameSteps& steps, FrameReason reason) {
    auto out = code_intra(work, steps, reason);
    if (!out) return out;
    const auto plain = code_unreferred_intra(work, steps, FrameReason::none);
    if (!plain) return plain;
    StageClock clock(work.stages);
    out->plain = errors_of(work, plain->frame);
    clock.done("errors");
    return out;
}

// Whether an I-frame would hardly cost more.
bool is_expensive(const BonesWork& work, const CodedFrame& enhanced) {
    const auto& reference = work.reference();
    const auto vertices = static_cast<double>(work.mesh().positions.size());
    const auto of_reference = static_cast<double>(std::max<std::size_t>(reference.decoded.mesh().positions.size(), 1));
    return static_cast<double>(enhanced.bytes()) >= 0.95 * reference.bytes * vertices / of_reference;
}

// The cheapest sufficient frame among those without residuals and those with few; nothing if no bone fits.
std::optional<BonesMoved> choose_animation(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps,
                                           const SurfaceErrors& allowed) {
    std::vector<bool> coded;
    std::size_t animated = 0;
    for (const double rms : work.animation->rms) {
        coded.push_back(rms > allowed.geometry_rms);
        animated += coded.back() ? 0 : 1;
    }
    if (animated == 0) return std::nullopt;
    auto moved = code_predicted(work);
    if (within(errors_of(work, moved.frame), allowed)) return moved;
    if (animated == coded.size()) return std::nullopt;
    auto in_part = code_coded_bones(work, steps, coded, std::exchange(progress.quantised, std::nullopt));
    if (!within(errors_of(work, in_part.frame), allowed)) return std::nullopt;
    return in_part;
}

// Sums up how much more each frame since the I-frame, including this one, has cost than the cheapest of them. True if
// that would have paid for a new I-frame.
bool intra_is_paid_for(const BonesWork& work, const CodedFrame& enhanced) {
    const auto& history = work.sequence.history;
    const auto bytes = static_cast<double>(enhanced.bytes());
    const double least = history.least_bytes > 0 ? std::min(history.least_bytes, bytes) : bytes;
    return may_be_intra(work) && history.excess_bytes + bytes - least > work.reference().bytes - least;
}

Result<Frame> choose_by_cost(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    const auto allowed = allowed_errors(work.reference(), steps);
    if (auto animated = choose_animation(work, progress, steps, allowed)) return Frame(std::move(*animated));
    auto enhanced = code_whole(work, progress, steps);
    const bool good = within(errors_of(work, enhanced.frame), allowed);
    const bool due = intra_is_paid_for(work, enhanced.frame);
    if (good && !due && !is_expensive(work, enhanced.frame)) return Frame(std::move(enhanced));
    auto intra = code_measured_intra(work, steps, good ? FrameReason::rate : FrameReason::surface);
    if (!intra) return as_frame(std::move(intra));
    if (good && !due && enhanced.frame.bytes() <= intra->frame.bytes()) return Frame(std::move(enhanced));
    return as_frame(std::move(intra));
}

}  // namespace

FrameType expected_type(const BonesWork& work) { return intra_is_due(work) ? FrameType::intra : FrameType::enhanced; }

Result<Frame> choose(const BonesWork& work, BonesProgress& progress, const FrameSteps& steps) {
    const auto choice = work.configuration.options.topology.frame_choice;
    if (!may_be_referred_to(work.mesh()))
        return as_frame(
            code_unreferred_intra(work, steps, reason_of_due(work.configuration, work.sequence.next_frame)));
    if (const auto reason = why_intra(work)) {
        if (choice == FrameChoice::rate_distortion) return as_frame(code_measured_intra(work, steps, *reason));
        return as_frame(work.configuration.intra_only() ? code_unreferred_intra(work, steps, *reason)
                                                        : code_intra(work, steps, *reason));
    }
    switch (choice) {
        case FrameChoice::motion:
            return choose_by_motion(work, progress, steps);
        case FrameChoice::rate_distortion:
            return choose_by_cost(work, progress, steps);
        case FrameChoice::cheaper:
            return choose_the_cheaper(work, progress, steps);
        case FrameChoice::fixed:
            break;
    }
    return Frame(code_what_moves(work, progress, steps));
}

Result<Frame> code_stand_in(const BonesWork& work, BonesProgress&, const FrameSteps&) {
    return Frame(code_predicted(work));
}

SurfaceErrors errors_of(const BonesWork& work, const CodedFrame& frame) {
    return errors_between(work.mesh(), *work.surface, frame.decoded, work.configuration.threads);
}

std::optional<FrameSteps> enhanced_steps(const Configuration& configuration) {
    const auto& options = configuration.options;
    const auto choice = options.topology.frame_choice;
    const bool whole =
        (choice == FrameChoice::fixed || choice == FrameChoice::cheaper) && !(options.topology.still_below > 0);
    if (!whole || options.rate.bits_per_second > 0 || options.rate.target_error > 0) return std::nullopt;
    return configuration.steps;
}

}  // namespace htvm::internal
