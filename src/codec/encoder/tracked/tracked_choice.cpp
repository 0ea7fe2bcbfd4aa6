#include "codec/encoder/tracked/tracked_choice.h"

#include <algorithm>

#include "codec/encoder/tracked/fresh_reference.h"
#include "codec/encoder/tracked/surface_patch.h"
#include "codec/encoder/tracked/texcoord_layout.h"
#include "codec/encoder/tracked/tracked_coders.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

using Frame = TrackedWork::Frame;
constexpr auto& numbers = tracking_numbers;

// ---- Is tracking lost? ----------------------------------------------------------------------------------------------

// How far off a region of 10 cm may be. best: RMS of the best T-frame.
LatticeUnits allowed_in_region(const TrackedWork& work, LatticeUnits best) {
    const auto& origin = work.reference->origin;
    return std::max({numbers.region_to_best * best, numbers.region_to_intra * origin.fit.worst_region,
                     work.configuration.scale.on_lattice(numbers.visible),
                     numbers.remeshed_in_edges * LatticeUnits(origin.edge)});
}

// The same of the whole surface. On a clean, smooth capture the best T-frame may be far better than quantisation lets
// an I-frame or a patch be.
LatticeUnits allowed_over_all(const TrackedWork& work, LatticeUnits best) {
    const LatticeUnits step(work.reference->origin.steps.geometry);
    return std::max({numbers.worst_to_best * best, numbers.quantised * step,
                     work.configuration.scale.on_lattice(numbers.visible_over_all)});
}

// Why the picture falls apart: most of the person is lost, as where a capture is cut, or all of a limb. Nothing if it
// does not.
std::optional<FrameReason> why_apart(const TrackedWork& work, const TrackedFit& fit) {
    const auto& scale = work.configuration.scale;
    const auto best = work.sequence.history.best_fit;
    const auto allowed = std::max(allowed_over_all(work, best), work.reference->origin.fit.rms);
    if (fit.rms > std::max(scale.on_lattice(numbers.most_of_all), numbers.apart_to_lost * allowed))
        return FrameReason::cut;
    if (fit.worst_region >
        std::max(scale.on_lattice(numbers.most_in_region), numbers.apart_to_lost * allowed_in_region(work, best)))
        return FrameReason::region;
    return std::nullopt;
}

// Why a T-frame counts as lost: it fits visibly worse than the T-frames of its I-frame can, over the whole surface, or
// in one region, such as a hand. Of several reasons the one of most surface. Nothing if it fits.
std::optional<FrameReason> why_lost(const TrackedWork& work, const TrackedFit& fit) {
    const auto best_fit = work.sequence.history.best_fit;
    const auto best = best_fit.value > 0 ? best_fit : fit.rms;
    const bool surface = fit.rms > allowed_over_all(work, best);
    const bool region = fit.worst_region > allowed_in_region(work, best);
    const bool strays = fit.stray_share > work.reference->origin.fit.stray_share + numbers.more_strays;
    if (!surface && !region && !strays) return std::nullopt;
    if (const auto apart = why_apart(work, fit)) return apart;
    return surface ? FrameReason::surface : region ? FrameReason::region : FrameReason::strays;
}

TrackedFit fit_of(const TrackedWork& work, const EncodedTrackedFrame& encoded) {
    const auto& origin = work.reference->origin;
    return fit_of(work, encoded.mesh, origin.edge, {encoded.near, origin.fit.squared, encoded.seen});
}

// ---- What may follow ------------------------------------------------------------------------------------------------

// Whether the capture's texture atlas is laid out anew since the I-frame, whose texture coordinates a T-frame shows.
bool texture_is_laid_out_anew(const TrackedWork& work, const LatticeMesh& tracked) {
    if (work.captured.mesh.texcoords.empty()) return false;
    // Measured on a studio's capture: without a new layout no vertex has other coordinates, with one 92 % have.
    StageClock clock(work.stages);
    const double others =
        share_with_other_texcoords(tracked, work.captured.mesh, work.configuration.scale.on_lattice(numbers.slip));
    clock.done("layout of the texture");
    return others > numbers.most_others;
}

// Whoever joins late needs all patches since the I-frame.
bool patches_have_grown(const TrackedWork& work) {
    const auto& reference = *work.reference;
    return reference.patches >= numbers.most_patches ||
           reference.patch_bytes > numbers.most_patches_bytes * reference.intra_bytes;
}

// Whether an I-frame of the tracked mesh is as good as one of the capture: it does not have many more vertices, nor was
// it made for much coarser or finer steps. (Where an error is asked for, the steps of I- and T-frames are far apart.)
bool may_be_renewed(const TrackedWork& work, const FrameSteps& steps, const LatticeMesh& tracked) {
    const auto& origin = work.reference->origin;
    const double ratio = static_cast<double>(steps.geometry) / origin.steps.geometry;
    const double most = work.configuration.tells_presence() ? numbers.most_grown : numbers.most_renewed_vertices;
    // The mesh that frames refer to is coarse where it has detail, which is not in it.
    return work.reference->decoded.detail.empty() && work.configuration.options.rate.target_error <= 0 &&
           static_cast<double>(tracked.positions.size()) <= most * static_cast<double>(origin.vertices) &&
           ratio <= numbers.most_renewed_steps && ratio >= 1 / numbers.most_renewed_steps;
}

// ---- Patches --------------------------------------------------------------------------------------------------------

SurfacePatchOptions patch_options(const TrackedWork& work, const FrameSteps& steps) {
    const auto& configuration = work.configuration;
    const auto& scale = configuration.scale;
    SurfacePatchOptions out;
    out.lost =
        std::max(scale.on_lattice(numbers.lost), numbers.remeshed_in_edges * LatticeUnits(work.reference->origin.edge));
    out.region = region_side(configuration);
    out.reach = scale.on_lattice(numbers.reach);
    out.speck = scale.on_lattice(numbers.speck);
    out.most_share = configuration.options.tracked.patch_share;
    if (configuration.tells_presence()) out.attempts = numbers.attempts_where_open;
    out.simplification = simplification_options(configuration, steps);
    out.threads = configuration.threads;
    return out;
}

// Whether all that is lost is replaced where to replace lost regions alone does not help, as where much is a little
// off.
enum class Replaced { regions, all };

// The T-frame with what is lost replaced; nothing if that is not possible, does not help, or costs about as much as an
// I-frame.
Result<std::optional<TrackedPatch>> patch(const TrackedWork& work, const NodeRegistration& registered,
                                          const FrameSteps& steps, const EncodedTrackedFrame& tracked,
                                          FrameReason reason, Replaced replaced) {
    using Patched = std::optional<TrackedPatch>;
    const auto& reference = *work.reference;
    const auto lost = std::min(allowed_in_region(work, work.sequence.history.best_fit),
                               numbers.lost_in_steps * LatticeUnits(steps.geometry));
    StageClock measuring(work.stages);
    const SurfacePatchSearch search(
        {tracked.mesh, reference.decoded.by_nodes->mesh.positions, tracked.near, tracked.seen}, work.captured.mesh,
        work.surface, patch_options(work, steps));
    measuring.done("patch");
    for (const auto region_lost : {lost, LatticeUnits(0)}) {
        if (region_lost.value == 0 && replaced == Replaced::regions) break;
        StageClock clock(work.stages);
        const auto found = search.find(region_lost);
        clock.done("patch");
        if (!found) continue;
        auto coded = code_patch(work, registered, steps, tracked, *found, reason);
        if (!coded) return tl::unexpected(coded.error());
        auto& out = *coded;
        if (!out) continue;
        auto& fit = out->origin.fit;
        if (static_cast<double>(out->frame.bytes()) > numbers.most_patch_bytes * reference.intra_bytes ||
            why_lost(work, fit))
            continue;
        fit = least_of(std::move(fit), reference.origin.fit);
        out->best_fit = work.sequence.history.best_fit;
        return Patched(std::move(*out));
    }
    return Patched();
}

// Whether something was tried in vain so lately that it is not tried again.
bool just_in_vain(const TrackedWork& work, const std::optional<std::uint32_t>& last) {
    return last && std::int64_t{work.sequence.next_frame} - *last < numbers.again_after;
}

// Whether the reference should grow by what was captured beside it: soon where that is much, as an arm that comes into
// view; else now and then.
bool growth_is_due(const TrackedWork& work, const TrackedFit& fit, const VainAttempts& in_vain) {
    if (!work.configuration.tells_presence() || just_in_vain(work, in_vain.growth)) return false;
    const auto since = std::int64_t{work.sequence.next_frame} - work.reference->decoded.number;
    const auto& scale = work.configuration.scale;
    const auto wide = fit.widest_uncovered;
    if (fit.uncovered_share > numbers.much_uncovered || wide > scale.on_lattice(numbers.grown_soon)) return true;
    // Rims that are worn off bit by bit, here and there, are never wide.
    const bool worn = since >= numbers.worn_after && fit.uncovered_share > numbers.worn_off;
    return worn || (since >= numbers.grown_after && wide > scale.on_lattice(numbers.grown_from));
}

// ---- The steps of a choice ------------------------------------------------------------------------------------------

// A T-frame and how well it fits.
struct JudgedMotion {
    CodedMotion coded;
    TrackedFit fit;
    std::optional<FrameReason> lost = {};  // why, if it is
    // What patches are planned on, if the frame is lost and may be patched, and that is not what was coded.
    std::optional<EncodedTrackedFrame> for_patches = {};
    const EncodedTrackedFrame& to_patch() const { return for_patches ? *for_patches : coded.encoded; }
};

Result<JudgedMotion> code_and_judge(const TrackedWork& work, const NodeRegistration& registered,
                                    const FrameSteps& steps) {
    auto coded = code_motion(work, registered, steps, MotionParts::all);
    if (!coded) return tl::unexpected(coded.error());
    auto fit = fit_of(work, coded->encoded);
    const auto lost = why_lost(work, fit);
    return JudgedMotion{std::move(*coded), std::move(fit), lost};
}

bool may_be_patched(const TrackedWork& work, bool due) {
    return !due && work.configuration.options.tracked.patch_share > 0 &&
           work.reference->decoded.mesh().texcoords.empty();
}

// Looks for limbs that another start finds, and beside it codes what patches are planned on. Limbs are rarely found;
// where they are, what was coded meanwhile is coded again, and the T-frame with it, unless it stays lost.
Result<void> look_for_limbs(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps, bool patches,
                            JudgedMotion& motion) {
    const auto code_of_reference = [&](const NodeRegistration& registered) {
        return code_for_patches(work, registered, steps, motion.coded.encoded.near);
    };
    const bool to_code = patches && !motion.coded.of_reference;
    std::optional<Result<EncodedTrackedFrame>> of_reference;
    FoundLimbs limbs;
    std::vector<StageTime> of_limbs;
    if (tracking.searched_limbs) {
        if (to_code) of_reference = code_of_reference(*tracking.registered);
    } else {
        parallel_invoke(
            work.configuration.threads, [&] { limbs = find_lost_limbs(work, *tracking.registered, of_limbs); },
            [&] {
                if (to_code) of_reference = code_of_reference(*tracking.registered);
            });
        work.stages.insert(work.stages.end(), of_limbs.begin(), of_limbs.end());
        tracking.searched_limbs = true;
        tracking.registered = std::move(limbs.registered);
        tracking.moved_limbs = tracking.moved_limbs || limbs.any;
    }
    if (patches && limbs.any) of_reference = code_of_reference(*tracking.registered);
    if (of_reference) {
        if (!*of_reference) return tl::unexpected(of_reference->error());
        motion.for_patches = std::move(**of_reference);
    }
    if (!limbs.any || (patches && why_lost(work, fit_of(work, motion.to_patch())))) return {};
    auto again = code_and_judge(work, *tracking.registered, steps);
    if (!again) return tl::unexpected(again.error());
    again->for_patches = std::move(motion.for_patches);
    motion = std::move(*again);
    return {};
}

// Looks for limbs, if that was not done yet, and gives whether there were any.
bool find_limbs(const TrackedWork& work, Tracking& tracking) {
    if (std::exchange(tracking.searched_limbs, true)) return false;
    auto limbs = find_lost_limbs(work, *tracking.registered, work.stages);
    tracking.registered = std::move(limbs.registered);
    tracking.moved_limbs = limbs.any;
    return limbs.any;
}

Result<Frame> as_frame(Result<TrackedIntra> intra) {
    if (!intra) return tl::unexpected(intra.error());
    return Frame(std::move(*intra));
}

// Why a T-frame that is lost is patched: what a patch repairs is a part, however far off it was.
FrameReason why_patched(FrameReason lost) { return lost == FrameReason::cut ? FrameReason::region : lost; }

// Why an I-frame of the capture is sent though the T-frame may fit; nothing if none is.
std::optional<FrameReason> why_anew(const TrackedWork& work, const CodedMotion& coded) {
    if (may_be_intra(work) && static_cast<double>(coded.bytes()) > work.reference->intra_bytes)
        return FrameReason::rate;
    if (texture_is_laid_out_anew(work, coded.encoded.mesh)) return FrameReason::texture;
    return std::nullopt;
}

// Why an I-frame is sent instead of the T-frame; nothing if none is. Where the T-frame is lost, it may take many bits
// for that.
std::optional<FrameReason> why_intra(const TrackedWork& work, bool due, std::optional<FrameReason> lost,
                                     std::optional<FrameReason> anew) {
    if (due) return FrameReason::due;
    if (lost) return lost;
    if (anew) return anew;
    if (patches_have_grown(work)) return FrameReason::patches;
    return std::nullopt;
}

// The TP-frame that the frame before has asked for; nothing if there is none, which in_vain then says of what was to be
// added. It takes the time of two T-frames: so none is coded first, to be judged.
Result<std::optional<Frame>> patch_as_planned(const TrackedWork& work, const NodeRegistration& registered,
                                              const FrameSteps& steps, FrameReason reason, VainAttempts& in_vain) {
    auto tracked = code_for_patches(work, registered, steps, {});
    if (!tracked) return tl::unexpected(tracked.error());
    auto patched = patch(work, registered, steps, *tracked, reason, Replaced::regions);
    if (!patched) return tl::unexpected(patched.error());
    if (!*patched) {
        auto& last = reason == FrameReason::border ? in_vain.growth : in_vain.repair;
        last = work.sequence.next_frame;
        return std::optional<Frame>();
    }
    (*patched)->in_vain = in_vain;
    return std::optional(Frame(std::move(**patched)));
}

// A T-frame, as long as it fits the capture. If a hand has left a pocket or an arm was lost, the reference's mesh can
// no longer follow, so that part of it is replaced, or an I-frame is sent. An I-frame is also sent once a T-frame takes
// more bits than the last I-frame did, if the shortest key interval has passed, and where a capture that is tracked
// already is begun anew, if that pays. Where one is due for those who join late, it is made of the tracked mesh, so
// that nothing jumps. A frame that may not be repaired is sent as it is, and so is one whose motion alone is wanted,
// unless it falls apart.
Result<Frame> choose_by_fit(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps) {
    const bool due = intra_is_due(work);
    const auto& history = work.sequence.history;
    auto in_vain = history.in_vain;
    auto followed = followed_on(history.followed, tracking.registered->vertices_again);
    const auto send = [&](CodedMotion coded, LatticeUnits best, std::optional<FrameReason> to_patch = {}) {
        auto out = chosen_motion(work, *tracking.registered, std::move(coded), best);
        out.history.to_patch = to_patch;
        out.history.in_vain = in_vain;
        out.history.followed = followed;
        return Frame(std::move(out));
    };
    // 1. Its motion alone, where no more is wanted.
    if (work.effort.motion_alone && !due) {
        auto bare = code_motion(work, *tracking.registered, steps, MotionParts::motion_alone);
        if (!bare) return tl::unexpected(bare.error());
        if (!why_apart(work, fit_of(work, bare->encoded))) return send(std::move(*bare), history.best_fit);
    }

    // 2. The patch that the frame before has asked for.
    const bool patches = may_be_patched(work, due);
    const bool repaired_in_vain = just_in_vain(work, in_vain.repair);
    if (history.to_patch && patches && !work.effort.motion_alone) {
        auto patched = patch_as_planned(work, *tracking.registered, steps, *history.to_patch, in_vain);
        if (!patched) return tl::unexpected(patched.error());
        if (*patched) {
            std::get<TrackedPatch>(**patched).followed = followed;
            return std::move(**patched);
        }
    }

    // 3. A T-frame, and how well it fits. Behind an I-frame it is not known yet how well its T-frames can fit; where
    // all are motion alone, it never is.
    if (work.effort.always_other_starts) find_limbs(work, tracking);
    auto motion = code_and_judge(work, *tracking.registered, steps);
    if (!motion) return tl::unexpected(motion.error());
    const auto apart = motion->lost || work.effort.motion_alone ? why_apart(work, motion->fit) : std::nullopt;
    if (apart) motion->lost = apart;
    const auto& may_repair = work.captured.may_repair;
    if (motion->lost && !due && !apart && may_repair && !may_repair())
        return send(std::move(motion->coded), history.best_fit);

    // 4. Where tracking is lost: limbs from another start. Where surface comes and goes, what is far off is not shown:
    // so the frame is sent as it is, and the next one goes on from limbs that were found, or is a patch, unless that
    // was in vain twice. Each takes its time, and together they would take that of four frames.
    if (motion->lost) {
        tracking.lost = true;
        const bool looks = apart || !just_in_vain(work, in_vain.limbs);
        const bool in_vain_again = repaired_in_vain && in_vain.repair == work.sequence.next_frame;
        if (work.configuration.tells_presence() && !due && !apart && patches && !in_vain_again) {
            const bool found = looks && find_limbs(work, tracking);
            if (looks && !found) in_vain.limbs = work.sequence.next_frame;
            return send(std::move(motion->coded), history.best_fit,
                        found ? std::nullopt : std::optional(why_patched(*motion->lost)));
        }
        if (!looks) tracking.searched_limbs = true;
        if (auto ok = look_for_limbs(work, tracking, steps, patches, *motion); !ok) return tl::unexpected(ok.error());
    }

    // 5. An I-frame, where the capture is begun anew and its T-frames will be nearer.
    if (!due) {
        auto fresh = fresh_reference(work, motion->coded, motion->lost.has_value(), steps, followed);
        if (!fresh) return tl::unexpected(fresh.error());
        if (*fresh) {
            (*fresh)->followed = followed_from_intra(followed);
            return Frame(std::move(**fresh));
        }
    }

    // 6. Where it still is: a patch, or an I-frame that lets the frames behind it follow better.
    const auto& tracked = motion->coded.encoded;
    const auto anew = why_anew(work, motion->coded);
    if (!anew && patches && motion->lost) {
        auto patched =
            patch(work, *tracking.registered, steps, motion->to_patch(), why_patched(*motion->lost), Replaced::all);
        if (!patched) return tl::unexpected(patched.error());
        if (*patched) {
            (*patched)->in_vain = in_vain;
            (*patched)->followed = followed;
            return Frame(std::move(**patched));
        }
    }

    // 7. The T-frame, or an I-frame: of the tracked mesh, where that is as good.
    const bool best = !motion->lost && (history.best_fit.value == 0 || motion->fit.rms < history.best_fit);
    const auto best_fit = best ? motion->fit.rms : history.best_fit;
    const auto reason = why_intra(work, due, motion->lost, anew);
    if (!reason) {
        const bool grows = growth_is_due(work, motion->fit, in_vain);
        return send(std::move(motion->coded), best_fit, grows ? std::optional(FrameReason::border) : std::nullopt);
    }
    const bool renewed = !anew && !motion->lost && may_be_renewed(work, steps, tracked.mesh);
    auto intra = renewed ? code_renewal(work, steps, tracked, *reason) : code_intra(work, steps, *reason);
    if (intra) intra->followed = followed_from_intra(followed);
    if (intra && !motion->lost) intra->best_fit = best_fit;
    return as_frame(std::move(intra));
}

}  // namespace

FrameType expected_type(const TrackedWork& work) { return intra_is_due(work) ? FrameType::intra : FrameType::tracked; }

Result<Frame> choose(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps) {
    const bool surface = carries_surface(work.captured.mesh);
    if (surface && can_refer(work)) return choose_by_fit(work, tracking, steps);
    const auto reason = reason_of_due(work.configuration, work.sequence.next_frame);
    const bool referred_to = surface && !work.configuration.intra_only();
    return as_frame(referred_to ? code_intra(work, steps, reason) : code_unreferred_intra(work, steps, reason));
}

Result<Frame> code_stand_in(const TrackedWork& work, Tracking& tracking, const FrameSteps& steps) {
    auto coded = code_motion(work, register_once(work, tracking), steps, MotionParts::motion_alone);
    if (!coded) return tl::unexpected(coded.error());
    return Frame(chosen_motion(work, *tracking.registered, std::move(*coded), work.sequence.history.best_fit));
}

SurfaceErrors errors_of(const TrackedWork& work, const CodedFrame& frame) {
    return errors_shown(work, frame.decoded, detail_of(frame, work.reference ? &work.reference->decoded : nullptr));
}

}  // namespace htvm::internal
