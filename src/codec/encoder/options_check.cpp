#include "codec/encoder/options_check.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "codec/format/frame_payload.h"
#include "codec/format/sequence.h"
#include "htvm/option_list.hpp"
#include "htvm/texture.hpp"

namespace htvm::internal {
namespace {

tl::unexpected<Error> bad(std::string what) { return fail(ErrorKind::bad_input, std::move(what)); }

// An option that would have no effect is refused, because whoever sets it expects one.
Result<void> check_that_options_go_together(const EncoderOptions& o) {
    const auto usual = default_options(o.profile);
    for (const auto& option : option_list())
        if (!serves(option.group, o.profile) && option.get(o) != option.get(usual))
            return bad(std::string(option.name) + " does nothing with the " + profile_name(o.profile) +
                       " profile; choose the " + group_name(option.group) + " profile");
    if (o.least_key_interval > o.key_interval)
        return bad("least_key_interval, " + std::to_string(o.least_key_interval) + " frames, is above key_interval, " +
                   std::to_string(o.key_interval));
    if (o.rate.bits_per_second > 0 && o.rate.target_error > 0)
        return bad("rate.bits_per_second and rate.target_error exclude each other");
    if (o.quality != usual.quality && (o.rate.bits_per_second > 0 || o.rate.target_error > 0))
        return bad("quality does nothing with rate.bits_per_second or rate.target_error: it follows from these");
    if (!(o.rate.bits_per_second > 0)) {
        if (o.rate.buffer_seconds != usual.rate.buffer_seconds)
            return bad("rate.buffer_seconds does nothing without rate.bits_per_second");
        if (!o.rate.first_pass.empty()) return bad("rate.first_pass does nothing without rate.bits_per_second");
    }
    if (o.tracked.group > 1) {
        if (o.rate.bits_per_second > 0 || o.rate.target_error > 0)
            return bad("tracked.group goes with fixed steps only, not with rate.bits_per_second or rate.target_error");
        if (o.tracked.references == TrackedReferences::intra)
            return bad(
                "tracked.group does not go with tracked.references intra: frames of a group refer to each other");
        if (o.key_interval == 1) return bad("tracked.group does nothing with key_interval 1: there are no T-frames");
    }
    if (o.topology.frame_choice != FrameChoice::motion) {
        if (o.topology.predicted_below != usual.topology.predicted_below)
            return bad("topology.predicted_below does nothing unless topology.frame_choice is motion");
        if (o.topology.intra_above != usual.topology.intra_above)
            return bad("topology.intra_above does nothing unless topology.frame_choice is motion");
    }
    return {};
}

Result<void> check_scene(const EncoderOptions& o) {
    constexpr std::uint64_t largest_session = (std::uint64_t{1} << 53) - 1;
    if (o.session > largest_session) return bad("session must be at most 2^53 - 1");
    if (o.floor && o.up == UpAxis::unknown) return bad("the floor is known, but not what is up: set up too");
    if (o.floor && !std::isfinite(*o.floor)) return bad("the floor must be a finite number of millimetres");
    for (const auto c : o.global_shift)
        if (c < -most_global_shift || c > most_global_shift)
            return bad("the global shift must be at most 2^53 - 1 mm either way");
    return check_metadata(o.metadata);
}

Result<void> check_texture(const EncoderOptions& o) {
    const auto& texture = o.texture;
    if (texture.layout > TextureLayout::projection)
        return bad("texture.layout must be none, captured, charts or projection");
    if (texture.layout == TextureLayout::none) {
        if (texture.width != 0 || texture.height != 0)
            return bad("a size of pictures does nothing without texture.layout");
        return {};
    }
    const int least = std::min(texture.width, texture.height), most = std::max(texture.width, texture.height);
    if (least < 1 || most > static_cast<int>(most_picture_side))
        return bad("texture.width and texture.height must be within 1 and " + std::to_string(most_picture_side));
    if (texture.layout == TextureLayout::projection) {
        if (o.profile != Profile::tracked) return bad("texture.layout projection goes with the tracked profile only");
        if (o.tracked.presence == SurfacePresence::off)
            return bad("with texture.layout projection frames say what is there: tracked.presence must not be off");
    }
    if (texture.layout == TextureLayout::charts) {
        if (o.profile != Profile::tracked) return bad("texture.layout charts goes with the tracked profile only");
        if (least < 64) return bad("with texture.layout charts pictures must be at least 64 pixels wide and high");
    }
    return {};
}

Result<void> check_skeleton(const EncoderOptions& o) {
    const auto& skeleton = o.skeleton;
    if (skeleton.joint_names.size() > 1024 || skeleton.bones.size() > 1024)
        return bad("a skeleton has at most 1024 joints and bones");
    for (const auto& bone : skeleton.bones)
        if (bone.first >= skeleton.joint_names.size() || bone.second >= skeleton.joint_names.size())
            return bad("a bone names a joint that the skeleton does not have");
    if (!o.radii.empty() && o.radii.size() != skeleton.bones.size()) return bad("the radii are not one per bone");
    for (const auto r : o.radii)
        if (!(r >= 0 && r < 100000)) return bad("a bone radius must be within 0 and 100 m");
    return {};
}

}  // namespace

Result<void> check(const EncoderOptions& o) {
    if (o.profile > Profile::paper) return bad("the profile must be tracked, topology or paper");
    for (const auto& option : option_list())
        if (auto fine = check_value(option, option.get(o)); !fine) return fine;
    if (auto fine = check_that_options_go_together(o); !fine) return fine;
    if (o.intra_coder &&
        (o.intra_coder->number == intra_coder_tfan || !o.intra_coder->encode || !o.intra_coder->decode))
        return bad("the intra coder must have a number above 0, encode and decode");
    if (auto fine = check_scene(o); !fine) return fine;
    if (auto fine = check_texture(o); !fine) return fine;
    return check_skeleton(o);
}

}  // namespace htvm::internal
