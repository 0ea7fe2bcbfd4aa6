#include "codec/encoder_check.h"

#include "codec/stream/frame_payload.h"
#include "core/lattice.h"

namespace htvm::internal {

Result<void> check(const EncoderOptions& o) {
    auto bad = [](const char* what) { return fail(ErrorKind::bad_input, what); };
    if (!(o.geometry_step >= 1.0 / 65536 && o.geometry_step <= 1000))
        return bad("the geometry step must be within 2^-16 and 1000 mm");
    if (!(o.colour_step >= 1 && o.colour_step <= 255)) return bad("the colour step must be within 1 and 255 levels");
    if (!(o.lambda >= 0 && o.lambda <= 1000)) return bad("lambda must be within 0 and 1000");
    if (o.key_interval < 1) return bad("the key interval must be at least 1 frame");
    if (o.least_key_interval < 1 || o.least_key_interval > o.key_interval)
        return bad("the least key interval must be within 1 and the key interval");
    for (const double mm : {o.topology.predicted_below, o.topology.intra_above, o.topology.still_below,
                            o.topology.animation_error, o.rate.target_error})
        if (!(mm >= 0 && mm <= 1e6)) return bad("a threshold or error must be within 0 and 1,000,000 mm");
    if (!(o.tracked.node_spacing >= 1 && o.tracked.node_spacing <= 10000))
        return bad("the node spacing must be within 1 and 10,000 mm");
    if (!(o.tracked.simplify >= 0 && o.tracked.simplify <= 10))
        return bad("simplification must be within 0 and 10 steps");
    if (!(o.rate.bits_per_second >= 0 && o.rate.bits_per_second <= 1e12))
        return bad("the bitrate must be within 0 and 10^12 bit/s");
    if (!(o.rate.buffer_seconds >= 0.01 && o.rate.buffer_seconds <= 3600))
        return bad("the buffer must hold 0.01 to 3600 s");
    if (o.rate.bits_per_second > 0 && o.rate.target_error > 0)
        return bad("a bitrate and a target error exclude each other");
    if (o.topology.nearest_vertices < 1 || o.topology.nearest_vertices > 64)
        return bad("the nearest vertices must be within 1 and 64");
    if (o.lattice_bits < 0 || o.lattice_bits > 16) return bad("the lattice bits must be within 0 and 16");
    if (o.fps_numerator == 0 || o.fps_denominator == 0) return bad("the frame rate must be above 0");
    if (o.unit_micrometres == 0) return bad("the unit must be above 0");
    if (o.skeleton.joint_names.size() > 1024 || o.skeleton.bones.size() > 1024)
        return bad("a skeleton has at most 1024 joints and bones");
    if (o.intra_coder &&
        (o.intra_coder->number == intra_coder_tfan || !o.intra_coder->encode || !o.intra_coder->decode))
        return bad("the intra coder must have a number above 0, encode and decode");
    if (!o.radii.empty() && o.radii.size() != o.skeleton.bones.size()) return bad("the radii are not one a bone");
    if (!(o.topology.weight_width >= 0 && o.topology.weight_width <= 1000))
        return bad("the weight width must be within 0 and 1000 mm");
    for (const auto r : o.radii)
        if (!(r >= 0 && r < 100000)) return bad("a bone radius must be within 0 and 100 m");
    for (const auto& bone : o.skeleton.bones)
        if (bone.first >= o.skeleton.joint_names.size() || bone.second >= o.skeleton.joint_names.size())
            return bad("a bone names a joint that the skeleton has not");
    return {};
}

}  // namespace htvm::internal

htvm::EncoderOptions htvm::default_options(Profile profile) {
    EncoderOptions out;
    out.profile = profile;
    if (profile != Profile::paper) return out;
    out.topology.reference_vertices = ReferenceVertices::bone;
    out.topology.point_to_plane = false;
    out.topology.weight_width = 0;
    return out;
}
