#include "codec/encoder/bones/bones_work.h"

#include <utility>

namespace htvm::internal {
namespace {

RegistrationOptions registration_options(const EncoderOptions& options) {
    RegistrationOptions out;
    out.point_to_plane = options.topology.registration == BoneRegistration::plane;
    if (!out.point_to_plane) {  // converges more slowly
        out.iterations = 16;
        out.samples = 500;
    }
    return out;
}

std::int64_t frames_since_intra(const BonesWork& work) {
    return std::int64_t{work.sequence.next_frame} - work.reference().decoded.number;
}

AnimationFit fit_of_animation(const BonesWork& work) {
    const auto& predicted = work.motion->predicted;
    StageClock clock(work.stages);
    const auto& options = work.configuration.options;
    const bool checked = options.topology.animation_error > 0 || options.rate.target_error > 0 ||
                         options.topology.frame_choice == FrameChoice::rate_distortion;
    auto out = measure_animation(work.mesh(), work.reference().decoded.skinned, predicted, checked,
                                 work.configuration.threads);
    clock.done("fit of the animation");
    return out;
}

SurfaceIndex surface_of(const BonesWork& work) {
    StageClock clock(work.stages);
    SurfaceIndex out(points_of(work.mesh().positions), work.mesh().triangles);
    clock.done("search structures");
    return out;
}

}  // namespace

BonesWork::BonesWork(const Configuration& settled, const BonesSequence& before, CapturedFrame frame,
                     std::optional<FrameMotion> known_motion, std::vector<StageTime>& times)
    : configuration(settled),
      sequence(before),
      stages(times),
      captured(std::move(frame)),
      motion(known_motion ? OnDemand<FrameMotion>(std::move(*known_motion)) : OnDemand<FrameMotion>([this] {
          return motion_of_bones(configuration, reference(), captured, sequence.history.motion, stages);
      })),
      animation([this] { return fit_of_animation(*this); }),
      surface([this] { return surface_of(*this); }) {}

bool may_be_referred_to(const LatticeMesh& captured) { return !captured.positions.empty(); }

bool can_be_moved(const BonesSequence& sequence, const LatticeMesh& captured) {
    if (!sequence.reference) return false;
    const auto& reference = sequence.reference->decoded;
    return reference.has_bones && !reference.mesh().positions.empty() && may_be_referred_to(captured) &&
           same_attributes(captured, reference.mesh());
}

bool intra_is_due(const BonesWork& work) {
    const bool can_refer = !work.configuration.intra_only() && can_be_moved(work);
    return work.captured.force_intra || !can_refer ||
           frames_since_intra(work) >= work.configuration.options.key_interval;
}

bool may_be_intra(const BonesWork& work) {
    return frames_since_intra(work) >= work.configuration.options.least_key_interval;
}

FrameMotion motion_of_bones(const Configuration& configuration, const BonesReference& reference,
                            const CapturedFrame& captured, std::span<const RigidMotion> before,
                            std::vector<StageTime>& stages) {
    const MotionReference against{&reference.decoded.skinned, &reference.search, &configuration.header.skeleton.bones,
                                  configuration.header.radii, before};
    return find_frame_motion(captured.mesh.positions, captured.pose, against,
                             registration_options(configuration.options), configuration.threads, stages);
}

}  // namespace htvm::internal
