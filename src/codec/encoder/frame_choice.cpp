#include "codec/encoder/frame_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "codec/encoder/bones/scene_change.h"
#include "codec/encoder/frame_coders.h"
#include "codec/encoder/tracked/surface_patch.h"
#include "codec/encoder/tracked/texcoord_layout.h"
#include "codec/format/frame_kinds.h"
#include "codec/intra/intra_frame.h"

namespace htvm::internal {
namespace {

FrameSteps steps_of(const Configuration& configuration, const QualitySteps& steps) {
    return {static_cast<std::int32_t>(std::clamp(std::lround(steps.geometry_step * configuration.units), 1L,
                                                 static_cast<long>(lattice_limit))),
            static_cast<std::int32_t>(std::lround(steps.colour_step))};
}

// The steps of the options, where neither a rate nor an error decides.
FrameSteps steps_asked_for(const Configuration& configuration) {
    return steps_of(configuration, {configuration.options.geometry_step, configuration.options.colour_step});
}

// For quality that is derived, which means the same for every subject, whatever its size.
FrameSteps steps_of_quality(const Configuration& configuration, double quality) {
    auto steps = quality_steps(quality);
    steps.geometry_step *= configuration.adult_millimetre / configuration.units;
    return steps_of(configuration, steps);
}

// The shortest key interval has passed: an I-frame is allowed if it saves bits.
bool may_be_intra(const FrameWork& work) {
    return work.frames_since_intra() >= work.configuration.options.least_key_interval;
}

bool is_scene_change(FrameWork& work) {
    const auto& configuration = work.configuration;
    if (!configuration.options.topology.scene_changes || configuration.tracked()) return false;
    constexpr double far = 150;  // mm on an adult
    return scene_changed(work.mesh.positions, work.bone_motion().predicted, far * configuration.adult_millimetre);
}

// ---- what may be animated -------------------------------------------------------------------------------------------

// The largest error, in lattice units, that a part may have and still be animated; 0: not checked.
double largest_animation_error(const Configuration& configuration) {
    const auto& options = configuration.options;
    double largest = options.topology.animation_error;
    if (options.rate.target_error > 0) largest = std::min(largest > 0 ? largest : 1e6, options.rate.target_error);
    return largest * configuration.units;
}

bool animation_fits(FrameWork& work) {
    const double largest = largest_animation_error(work.configuration);
    if (!(largest > 0)) return true;
    const auto& fit = work.animation_fit();
    return std::all_of(fit.rms.begin(), fit.rms.end(), [&](double rms) { return rms <= largest; });
}

std::vector<double> shifts_of_bones(const FrameWork& work) {
    return bone_shifts(work.reference().decoded.skinned, work.configuration.header.skeleton.bones, work.pose);
}

// Uses motion-based coding if it is enabled and leaves something out; otherwise codes the whole frame.
Result<Candidate> code_what_moves(FrameWork& work, const FrameSteps& steps) {
    const double still_below = work.configuration.options.topology.still_below * work.configuration.units;
    if (!(still_below > 0)) return code_frame(FrameType::enhanced, work, steps);
    const auto shifts = shifts_of_bones(work);
    if (std::all_of(shifts.begin(), shifts.end(), [&](double shift) { return shift >= still_below; }))
        return code_frame(FrameType::enhanced, work, steps);
    return code_coded_bones(
        work, steps,
        choose_coded_bones(shifts, work.animation_fit(), still_below, largest_animation_error(work.configuration)));
}

// ---- FrameChoice::motion --------------------------------------------------------------------------------------------

Result<Candidate> choose_by_motion(FrameWork& work, const FrameSteps& steps) {
    const auto shifts = shifts_of_bones(work);
    const double motion = work.configuration.to_millimetres(std::accumulate(shifts.begin(), shifts.end(), 0.0));
    const auto& options = work.configuration.options.topology;
    if (options.intra_above > 0 && motion > options.intra_above && may_be_intra(work))
        return code_frame(FrameType::intra, work, steps);
    if (motion < options.predicted_below && animation_fits(work)) return code_frame(FrameType::predicted, work, steps);
    return code_what_moves(work, steps);
}

// ---- FrameChoice::cheaper -------------------------------------------------------------------------------------------

// Bytes per vertex of an I-frame that nothing refers to: found once per reference, since it hardly changes.
Result<double> plain_intra_bytes(FrameWork& work, const FrameSteps& steps) {
    const auto& known = work.sequence.bones.plain_intra_bytes;
    const auto& reference = work.reference();
    if (known > 0 && reference.intra.steps.geometry == steps.geometry && reference.intra.steps.colour == steps.colour)
        return known;
    const auto plain = code_lone_intra(work, steps);
    if (!plain) return tl::unexpected(plain.error());
    return static_cast<double>(plain->bytes()) / static_cast<double>(work.mesh.positions.size());
}

// A codebook is used for about ten frames, so a tenth of it counts.
double bytes_in_the_long_run(const Candidate& candidate) {
    const auto frame = static_cast<double>(candidate.packets.back().payload.size() + packet_overhead);
    return frame + (static_cast<double>(candidate.bytes()) - frame) / 10;
}

// An EP-frame if it takes fewer bits than an I-frame at the same steps, where both have the same error. If it does not,
// as at high quality or where bones do not describe how the surface moves, EP-frames are tried again only after a
// while. So a capture that EP-frames do not suit takes hardly more time than I-frames alone.
Result<Candidate> choose_the_cheaper(FrameWork& work, const FrameSteps& steps) {
    if (work.configuration.options.topology.still_below > 0) return code_what_moves(work, steps);
    const bool suspended = work.sequence.next_frame < work.sequence.trial.next && may_be_intra(work);
    if (!suspended) {
        auto enhanced = code_frame(FrameType::enhanced, work, steps);
        if (!enhanced || !may_be_intra(work)) return enhanced;
        const auto plain = plain_intra_bytes(work, steps);
        if (!plain) return tl::unexpected(plain.error());
        enhanced->bones->plain_intra_bytes = *plain;
        const double intra = *plain * static_cast<double>(work.mesh.positions.size());
        // A single bone that stands in for a skeleton leaves larger residuals, which have a larger error at the same
        // steps: 0.75 instead of 0.65 mm on a man who talks. At the same error, EP-frames still take 28 % fewer bits
        // there.
        const double share = work.configuration.header.has_skeleton ? 1 : 0.9;
        if (bytes_in_the_long_run(*enhanced) < share * intra) {
            enhanced->trial = EnhancedTrial{};
            return enhanced;
        }
    }
    // The I-frame sent before the next trial will be its reference.
    EnhancedTrial trial = work.sequence.trial;
    if (!suspended) {
        trial.losses = std::min(trial.losses + 1, 6);
        trial.next = work.sequence.next_frame + (2u << trial.losses);
    }
    const bool referred_to = work.sequence.next_frame + 1 >= trial.next;
    auto intra = referred_to ? code_frame(FrameType::intra, work, steps) : code_lone_intra(work, steps);
    if (intra) intra->trial = trial;
    return intra;
}

// ---- FrameChoice::rate_distortion -----------------------------------------------------------------------------------

// The errors that a frame may have: those of an I-frame at the same quality, plus a margin for the estimate.
SurfaceErrors allowed_errors(const ReferenceInUse& reference, const FrameSteps& steps) {
    constexpr double tolerance = 1.05;
    const double geometry = static_cast<double>(steps.geometry) / reference.intra.steps.geometry;
    const double colour = static_cast<double>(steps.colour) / reference.intra.steps.colour;
    return {tolerance * geometry * reference.intra.plain.geometry_rms,
            tolerance * colour * reference.intra.plain.colour_rms};
}

bool within(const SurfaceErrors& errors, const SurfaceErrors& allowed) {
    return errors.geometry_rms <= allowed.geometry_rms && errors.colour_rms <= allowed.colour_rms;
}

// Codes an I-frame, and measures the errors of one that nothing refers to.
Result<Candidate> code_measured_intra(FrameWork& work, const FrameSteps& steps) {
    auto out = code_frame(FrameType::intra, work, steps);
    if (!out) return out;
    const auto plain = code_lone_intra(work, steps);
    if (!plain) return plain;
    StageClock clock(work.stages);
    out->intra->plain = work.errors_of(plain->decoded);
    clock.done("errors");
    return out;
}

// Whether an I-frame would hardly cost more.
bool is_expensive(const FrameWork& work, const Candidate& enhanced) {
    const auto& reference = work.reference();
    const auto vertices = static_cast<double>(work.mesh.positions.size());
    const auto of_reference = static_cast<double>(std::max<std::size_t>(reference.decoded.mesh().positions.size(), 1));
    return static_cast<double>(enhanced.bytes()) >= 0.95 * reference.bytes * vertices / of_reference;
}

// The cheapest sufficient frame among those without residuals and those with few; nothing if no bone fits.
Result<std::optional<Candidate>> choose_animation(FrameWork& work, const FrameSteps& steps,
                                                  const SurfaceErrors& allowed) {
    using Choice = std::optional<Candidate>;
    std::vector<bool> coded;
    std::size_t animated = 0;
    for (const double rms : work.animation_fit().rms) {
        coded.push_back(rms > allowed.geometry_rms);
        animated += coded.back() ? 0 : 1;
    }
    if (animated == 0) return Choice();
    auto moved = code_frame(FrameType::predicted, work, steps);
    if (!moved) return tl::unexpected(moved.error());
    if (within(work.errors_of(moved->decoded), allowed)) return Choice(std::move(*moved));
    if (animated == coded.size()) return Choice();
    auto candidate = code_coded_bones(work, steps, coded);
    if (!candidate) return tl::unexpected(candidate.error());
    if (!within(work.errors_of(candidate->decoded), allowed)) return Choice();
    return Choice(std::move(*candidate));
}

// Sums up how much more each frame since the I-frame, including this one, has cost than the cheapest of them. True if
// that would have paid for a new I-frame.
bool intra_is_paid_for(const FrameWork& work, const Candidate& enhanced) {
    const auto& history = work.sequence.bones;
    const auto bytes = static_cast<double>(enhanced.bytes());
    const double least = history.least_bytes > 0 ? std::min(history.least_bytes, bytes) : bytes;
    return may_be_intra(work) && history.excess_bytes + bytes - least > work.reference().bytes - least;
}

Result<Candidate> choose_by_cost(FrameWork& work, const FrameSteps& steps) {
    const auto allowed = allowed_errors(work.reference(), steps);
    auto animated = choose_animation(work, steps, allowed);
    if (!animated) return tl::unexpected(animated.error());
    if (*animated) return std::move(**animated);
    auto enhanced = code_frame(FrameType::enhanced, work, steps);
    if (!enhanced) return enhanced;
    const bool good = within(work.errors_of(enhanced->decoded), allowed);
    const bool due = intra_is_paid_for(work, *enhanced);
    if (good && !due && !is_expensive(work, *enhanced)) return enhanced;
    auto intra = code_measured_intra(work, steps);
    if (!intra) return intra;
    if (good && !due && enhanced->bytes() <= intra->bytes()) return enhanced;
    return intra;
}

// ---- Profile::tracked -----------------------------------------------------------------------------------------------

// How far off a region of 10 cm may be, lattice units. best: RMS of the best T-frame.
double allowed_in_region(const FrameWork& work, double best) {
    constexpr double region_to_best = 5, region_to_intra = 1.5;
    constexpr double visible = 3.5, visible_in_edges = 0.42;  // mm on an adult; in mean edges of the capture
    const auto& intra = work.reference().intra;
    return std::max({region_to_best * best, region_to_intra * intra.fit.worst_region,
                     visible * work.configuration.adult_millimetre, visible_in_edges * intra.edge});
}

// The same of the whole surface. On a clean, smooth capture the best T-frame may be far better than quantisation lets
// an I-frame or a patch be.
double allowed_over_all(const FrameWork& work, double best) {
    constexpr double worst_to_best = 2.2, quantised = 0.75;  // steps
    return std::max(worst_to_best * best, quantised * static_cast<double>(work.reference().intra.steps.geometry));
}

// Whether so much is lost that the picture falls apart: most of the person, as where a capture is cut, or all of a
// limb.
bool falls_apart(const FrameWork& work, const TrackedFit& fit) {
    constexpr double most_of_all = 4, most_in_region = 30;  // mm on an adult
    constexpr double to_lost = 3;                           // times what already counts as lost
    const double millimetre = work.configuration.adult_millimetre, best = work.sequence.nodes.best_fit;
    const double allowed = std::max(allowed_over_all(work, best), work.reference().intra.fit.rms);
    return fit.rms > std::max(most_of_all * millimetre, to_lost * allowed) ||
           fit.worst_region > std::max(most_in_region * millimetre, to_lost * allowed_in_region(work, best));
}

// Whether a T-frame fits visibly worse than the T-frames of its I-frame can: over the whole surface, or in one region,
// such as a hand.
bool lost_track(const FrameWork& work, const TrackedFit& fit) {
    constexpr double more_strays = 0.004;
    const double best_fit = work.sequence.nodes.best_fit;
    const double best = best_fit > 0 ? best_fit : fit.rms;
    return fit.stray_share > work.reference().intra.fit.stray_share + more_strays ||
           fit.rms > allowed_over_all(work, best) || fit.worst_region > allowed_in_region(work, best);
}

// Whether the capture's texture atlas is laid out anew since the I-frame, whose texture coordinates a T-frame shows.
bool relaid_texture(FrameWork& work, const LatticeMesh& tracked) {
    // Tracking slips along the surface by less than this, mm on an adult, unless it is lost. Measured on a studio's
    // capture: without a new layout no vertex has other coordinates, with one 92 % have.
    constexpr double slip = 30, most_others = 0.1;
    StageClock clock(work.stages);
    const double others = share_with_other_texcoords(tracked, work.mesh, slip * work.configuration.adult_millimetre);
    if (!work.mesh.texcoords.empty()) clock.done("layout of the texture");
    return others > most_others;
}

SurfacePatchOptions patch_options(const FrameWork& work, const FrameSteps& steps) {
    const auto& configuration = work.configuration;
    const double millimetre = configuration.adult_millimetre;
    SurfacePatchOptions out;
    out.lost = std::max(6 * millimetre, 0.42 * work.reference().intra.edge);
    out.region = region_side(configuration);
    out.reach = 30 * millimetre;
    out.speck = 20 * millimetre;
    out.most_share = configuration.options.tracked.patch_share;
    out.simplification = simplification_options(configuration, steps);
    out.threads = configuration.threads;
    return out;
}

// The T-frame with the lost regions replaced; nothing if that is not possible, does not help, or costs about as much as
// an I-frame. Where regions alone do not help, as where much is a little off, all that is lost is replaced.
Result<std::optional<Candidate>> patch(FrameWork& work, const FrameSteps& steps, const EncodedTrackedFrame& tracked) {
    using Patched = std::optional<Candidate>;
    constexpr double most_bytes = 0.8;  // of the I-frame's
    // At fine steps a bit brings more where less is wrong.
    constexpr double lost_in_steps = 1.75;
    const double lost = std::min(allowed_in_region(work, work.sequence.nodes.best_fit),
                                 lost_in_steps * static_cast<double>(steps.geometry));
    StageClock measuring(work.stages);
    const SurfacePatchSearch search({tracked.mesh, work.reference().decoded.tracked->mesh.positions, tracked.near},
                                    work.mesh, work.surface(), patch_options(work, steps));
    measuring.done("patch");
    for (const double region_lost : {lost, 0.0}) {
        StageClock clock(work.stages);
        const auto found = search.find(region_lost);
        clock.done("patch");
        if (!found) continue;
        auto coded = code_patched(work, steps, tracked, *found);
        if (!coded) return tl::unexpected(coded.error());
        auto& out = *coded;
        if (!out) continue;
        auto& fit = out->intra->fit;
        if (static_cast<double>(out->bytes()) > most_bytes * work.reference().bytes || lost_track(work, fit)) continue;
        fit = least_of(std::move(fit), work.reference().intra.fit);
        out->best_fit = work.sequence.nodes.best_fit;
        return Patched(std::move(*out));
    }
    return Patched();
}

// Whoever joins late needs all patches since the I-frame.
bool patches_have_grown(const FrameWork& work) {
    constexpr int most_patches = 24;
    constexpr double most_bytes = 4;  // times the I-frame's
    const auto& reference = work.reference();
    return reference.patches >= most_patches || reference.patch_bytes > most_bytes * reference.bytes;
}

// Whether an I-frame of the tracked mesh is as good as one of the capture: it does not have many more vertices, nor was
// it made for much coarser or finer steps. (Where an error is asked for, the steps of I- and T-frames are far apart.)
bool may_be_renewed(const FrameWork& work, const FrameSteps& steps, const LatticeMesh& tracked) {
    constexpr double most_vertices = 1.3, most_steps = 1.5;
    const auto& intra = work.reference().intra;
    const double ratio = static_cast<double>(steps.geometry) / intra.steps.geometry;
    return work.configuration.options.rate.target_error <= 0 &&
           static_cast<double>(tracked.positions.size()) <= most_vertices * static_cast<double>(intra.vertices) &&
           ratio <= most_steps && ratio >= 1 / most_steps;
}

// A T-frame, as long as it fits the capture. If a hand has left a pocket or an arm was lost, the reference's mesh can
// no longer follow, so that part of it is replaced, or an I-frame is sent. An I-frame is also sent once a T-frame takes
// more bits than the last I-frame did, if the shortest key interval has passed. Where one is due for those who join
// late, it is made of the tracked mesh, so that nothing jumps. A frame that may not be repaired is sent as it is, and
// so is one whose motion alone is wanted, unless it falls apart. due: an I-frame is wanted.
Result<Candidate> choose_tracked(FrameWork& work, const FrameSteps& steps, bool due) {
    const auto& reference = work.reference();
    const auto fit_of = [&](const LatticeMesh& decoded, std::span<const std::uint32_t> near) {
        return work.tracked_fit(decoded, reference.intra.edge, near, reference.intra.fit.squared);
    };
    if (work.effort.motion_alone && !due) {
        auto alone = code_motion_alone(work, steps);
        if (!alone || !falls_apart(work, fit_of(alone->decoded, alone->near))) return alone;
    }
    if (work.effort.always_other_starts) work.follow_lost_limbs([] {});
    auto tracked = code_frame(FrameType::tracked, work, steps);
    if (!tracked) return tracked;
    auto fit = fit_of(tracked->decoded, tracked->near);
    bool lost = lost_track(work, fit);
    // Behind an I-frame it is not known yet how well its T-frames can fit; where all are motion alone, it never is.
    const bool must_be_repaired = (lost || work.effort.motion_alone) && falls_apart(work, fit);
    lost = lost || must_be_repaired;
    if (lost && !due && !must_be_repaired && work.may_repair && !work.may_repair()) return tracked;
    std::optional<EncodedTrackedFrame> for_patches;  // which tells whether limbs were found, too
    const bool may_be_patched =
        !due && work.configuration.options.tracked.patch_share > 0 && reference.decoded.mesh().texcoords.empty();
    if (lost) {
        work.lost = true;
        // Limbs are rarely found; where they are, what was coded meanwhile is coded again.
        std::optional<Result<EncodedTrackedFrame>> coded;
        const bool limbs_moved = work.follow_lost_limbs([&] {
            if (may_be_patched) coded = code_for_patches(work, steps, tracked->near);
        });
        if (may_be_patched) {
            if (limbs_moved) coded = code_for_patches(work, steps, tracked->near);
            if (!*coded) return tl::unexpected(coded->error());
            for_patches.emplace(std::move(**coded));
        }
        if (limbs_moved && (!for_patches || !lost_track(work, fit_of(for_patches->mesh, for_patches->near)))) {
            tracked = code_frame(FrameType::tracked, work, steps);
            if (!tracked) return tracked;
            fit = fit_of(tracked->decoded, tracked->near);
            lost = lost_track(work, fit);
        }
    }
    const bool expensive = may_be_intra(work) && static_cast<double>(tracked->bytes()) > reference.bytes;
    const bool anew = expensive || relaid_texture(work, tracked->decoded);
    if (!anew && lost && for_patches) {
        auto patched = patch(work, steps, *for_patches);
        if (!patched) return tl::unexpected(patched.error());
        if (*patched) return std::move(**patched);
    }
    auto& best = tracked->nodes->best_fit;
    if (!lost && (best == 0 || fit.rms < best)) best = fit.rms;
    if (!anew && !lost && !due && !patches_have_grown(work)) return tracked;
    const bool renewed = !anew && !lost && may_be_renewed(work, steps, tracked->decoded);
    auto intra =
        renewed ? code_renewed_intra(work, steps, tracked->decoded) : code_frame(FrameType::intra, work, steps);
    if (intra && !lost) intra->best_fit = best;
    return intra;
}

// ---- one attempt at given steps -------------------------------------------------------------------------------------

Result<Candidate> choose(FrameWork& work, const FrameSteps& steps, bool force_intra) {
    const auto& options = work.configuration.options;
    const auto choice = options.topology.frame_choice;
    if (!work.carries_surface()) return code_lone_intra(work, steps);
    if (options.profile == Profile::tracked && work.can_refer())
        return choose_tracked(work, steps, force_intra || work.intra_is_due());
    if (force_intra || work.intra_is_due() || is_scene_change(work)) {
        if (options.profile != Profile::tracked && choice == FrameChoice::rate_distortion)
            return code_measured_intra(work, steps);
        return work.configuration.intra_alone() ? code_lone_intra(work, steps)
                                                : code_frame(FrameType::intra, work, steps);
    }
    switch (choice) {
        case FrameChoice::motion:
            return choose_by_motion(work, steps);
        case FrameChoice::rate_distortion:
            return choose_by_cost(work, steps);
        case FrameChoice::cheaper:
            return choose_the_cheaper(work, steps);
        case FrameChoice::fixed:
            break;
    }
    return code_what_moves(work, steps);
}

FrameType expected_type(const FrameWork& work, bool force_intra) {
    if (force_intra || work.intra_is_due()) return FrameType::intra;
    return work.configuration.tracked() ? FrameType::tracked : FrameType::enhanced;
}

// ---- quality by rate ------------------------------------------------------------------------------------------------

// The error for a frame that takes this many bits even at the lowest quality.
tl::unexpected<Error> does_not_fit(const RateOptions& options, double room, double bits) {
    const double capacity = options.bits_per_second * options.buffer_seconds;
    const auto number = [](double x) {
        std::array<char, 32> text{};
        std::snprintf(text.data(), text.size(), "%.3g", x);
        return std::string(text.data());
    };
    std::string message = "the frame takes " + number(bits / 8000) +
                          " kB even at the lowest quality, and the buffer has room for " + number(room / 8000) +
                          " kB of its " + number(capacity / 8000) + " kB; give ";
    // Rounded up, so that the numbers in the message suffice.
    const auto enough = [&](double x) { return number(1.01 * x); };
    if (bits > capacity)
        message += "a bitrate of at least " + enough(bits / options.buffer_seconds / 1e6) +
                   " Mbit/s or a buffer of at least " + enough(bits / options.bits_per_second) + " s";
    else
        message += "a higher bitrate or a larger buffer";
    return fail(ErrorKind::limit, message);
}

// The cheapest frame there is: the motion of the nodes or bones alone.
Result<Candidate> code_stand_in(FrameWork& work, double quality) {
    const auto steps = steps_of_quality(work.configuration, quality);
    auto out =
        work.configuration.tracked() ? code_motion_alone(work, steps) : code_frame(FrameType::predicted, work, steps);
    if (out) out->stands_in = true;
    return out;
}

// Lowers the quality until the frame fits the buffer; at last, only its motion is coded. The first frames of a kind are
// coded up to four times, until their quality is the one that the rate allows.
Result<Candidate> code_within_buffer(FrameWork& work, RateController& rate, const BitsOf& bits_of, bool force_intra) {
    const auto fits = [&](const Candidate& candidate) { return bits_of(candidate) <= rate.room(); };
    double quality = rate.quality(expected_type(work, force_intra)), bits = 0;
    constexpr double far_off = 3;
    for (int trials = 3;;) {
        auto candidate = choose(work, steps_of_quality(work.configuration, quality), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        bits = bits_of(*candidate);
        if (trials-- > 0 && rate.is_guess(rate_type(*candidate))) {
            // Without the codebooks that come with the first frame, as later frames do not need them.
            const auto own = static_cast<double>(candidate->packets.back().payload.size() + packet_overhead);
            rate.tried({candidate->type, quality, 8 * own, candidate->renewed});
            const double better = rate.quality(candidate->type);
            if (std::abs(better - quality) > far_off) {
                quality = better;
                continue;
            }
        }
        if (fits(*candidate)) return candidate;
        const double lower = rate.lower_quality(candidate->type, quality, bits);
        if (lower >= quality) break;
        quality = lower;
    }
    if (work.can_be_moved()) {
        auto stand_in = code_stand_in(work, quality);
        if (!stand_in) return stand_in;
        stand_in->quality = quality;
        if (fits(*stand_in)) return stand_in;
    }
    auto error = does_not_fit(work.configuration.options.rate, rate.room(), bits);
    rate.coded({FrameType::predicted, quality, 0});
    return error;
}

// ---- quality by error -----------------------------------------------------------------------------------------------

// Codes the frame again, with what was learned, if the error is off; of several attempts, the nearest is taken.
Result<Candidate> code_to_error(FrameWork& work, ErrorController& control, bool force_intra) {
    constexpr int attempts = 4;
    FrameType type = expected_type(work, force_intra);
    std::optional<Candidate> nearest;
    double nearest_off = 0;
    for (int attempt = 0; attempt < attempts; ++attempt) {
        const double quality = control.quality(type);
        auto candidate = choose(work, steps_of_quality(work.configuration, quality), force_intra);
        if (!candidate) return candidate;
        candidate->quality = quality;
        type = candidate->type;
        const double error = work.configuration.to_millimetres(work.errors_of(candidate->decoded).geometry_rms);
        if (control.accept(type, quality, error) || type == FrameType::predicted) return candidate;
        const double off = std::abs(std::log2(error / work.configuration.options.rate.target_error));
        if (!nearest || off < nearest_off) nearest_off = off, nearest = std::move(*candidate);
    }
    return std::move(*nearest);
}

}  // namespace

// A frame without a surface says nothing of what others take.
FrameType rate_type(const Candidate& candidate) {
    const bool bare = stands_alone(candidate.type) && candidate.decoded.triangles.empty();
    return candidate.stands_in || bare ? FrameType::predicted : candidate.type;
}

std::optional<FrameSteps> enhanced_steps(const Configuration& configuration) {
    const auto& options = configuration.options;
    const auto choice = options.topology.frame_choice;
    const bool whole = (choice == FrameChoice::fixed || choice == FrameChoice::cheaper) &&
                       !(options.topology.still_below > 0) && !configuration.tracked();
    if (!whole || options.rate.bits_per_second > 0 || options.rate.target_error > 0) return std::nullopt;
    return steps_asked_for(configuration);
}

Result<Candidate> choose_frame(FrameWork& work, QualityControl& control, const BitsOf& bits_of, bool force_intra) {
    if (control.rate) return code_within_buffer(work, *control.rate, bits_of, force_intra);
    if (control.error) return code_to_error(work, *control.error, force_intra);
    return choose(work, steps_asked_for(work.configuration), force_intra);
}

}  // namespace htvm::internal
