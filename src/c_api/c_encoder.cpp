// The encoder's part of the C interface, over htvm::Encoder.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "c_api/c_status.h"
#include "htvm/encoder.hpp"

using htvm::c_api::check_struct;
using htvm::c_api::guarded;
using htvm::c_api::LastError;
using htvm::c_api::read_struct;

struct htvm_encoder {
    htvm_allocator allocator;
    std::size_t joints, bones;  // of the skeleton
    htvm::Encoder encoder;
    std::vector<std::uint8_t> packet;  // pulled, not yet received; empty: none
    std::uint32_t attributes = 0;      // of the last frame
    bool any_frame = false, finished = false;
    LastError error;

    htvm_encoder(const htvm_allocator& memory, const htvm::Skeleton& skeleton, htvm::Encoder&& made)
        : allocator(memory),
          joints(skeleton.joint_names.size()),
          bones(skeleton.bones.size()),
          encoder(std::move(made)) {}
};

namespace {

htvm_encoder_options default_options() {
    const auto cpp = htvm::default_options(htvm::Profile::topology);
    htvm_encoder_options out{};
    out.struct_size = sizeof out;
    out.threads = cpp.threads;
    out.geometry_step = cpp.geometry_step;
    out.colour_step = cpp.colour_step;
    out.lambda = cpp.lambda;
    out.key_interval = cpp.key_interval;
    out.least_key_interval = cpp.least_key_interval;
    out.scene_changes = cpp.topology.scene_changes;
    out.frame_choice = static_cast<std::uint32_t>(cpp.topology.frame_choice);
    out.tracked = cpp.profile == htvm::Profile::tracked;
    out.tracked_from_intra = cpp.tracked.references == htvm::TrackedReferences::intra;
    out.simplify = cpp.tracked.simplify;
    out.node_spacing = cpp.tracked.node_spacing;
    out.predicted_below = cpp.topology.predicted_below;
    out.intra_above = cpp.topology.intra_above;
    out.still_below = cpp.topology.still_below;
    out.animation_error = cpp.topology.animation_error;
    out.bits_per_second = cpp.rate.bits_per_second;
    out.buffer_seconds = cpp.rate.buffer_seconds;
    out.target_error = cpp.rate.target_error;
    out.merge_duplicates = cpp.topology.merge_duplicates;
    out.nearest_vertices = cpp.topology.nearest_vertices;
    out.reference_any = cpp.topology.reference_vertices == htvm::ReferenceVertices::any;
    out.point_to_plane = cpp.topology.point_to_plane;
    out.weight_width = cpp.topology.weight_width;
    out.lattice_bits = cpp.lattice_bits;
    out.unit_micrometres = cpp.unit_micrometres;
    out.fps_numerator = cpp.fps_numerator;
    out.fps_denominator = cpp.fps_denominator;
    return out;
}

// All but the skeleton. frame_choice is within its range.
htvm::EncoderOptions cpp_options(const htvm_encoder_options& options) {
    htvm::EncoderOptions out;
    out.threads = options.threads;
    out.runner = htvm::c_api::task_runner(options.run_tasks, options.run_tasks_user);
    out.geometry_step = options.geometry_step;
    out.colour_step = options.colour_step;
    out.lambda = options.lambda;
    out.key_interval = options.key_interval;
    out.least_key_interval = options.least_key_interval;
    out.topology.scene_changes = options.scene_changes != 0;
    out.topology.frame_choice = static_cast<htvm::FrameChoice>(options.frame_choice);
    out.profile = options.tracked != 0 ? htvm::Profile::tracked : htvm::Profile::topology;
    out.tracked.references =
        options.tracked_from_intra != 0 ? htvm::TrackedReferences::intra : htvm::TrackedReferences::previous;
    out.tracked.simplify = options.simplify;
    out.tracked.node_spacing = options.node_spacing;
    out.topology.predicted_below = options.predicted_below;
    out.topology.intra_above = options.intra_above;
    out.topology.still_below = options.still_below;
    out.topology.animation_error = options.animation_error;
    out.rate.bits_per_second = options.bits_per_second;
    out.rate.buffer_seconds = options.buffer_seconds;
    out.rate.target_error = options.target_error;
    out.topology.merge_duplicates = options.merge_duplicates != 0;
    out.topology.nearest_vertices = options.nearest_vertices;
    out.topology.reference_vertices =
        options.reference_any != 0 ? htvm::ReferenceVertices::any : htvm::ReferenceVertices::bone;
    out.topology.point_to_plane = options.point_to_plane != 0;
    out.topology.weight_width = options.weight_width;
    out.lattice_bits = options.lattice_bits;
    out.unit_micrometres = options.unit_micrometres;
    out.fps_numerator = options.fps_numerator;
    out.fps_denominator = options.fps_denominator;
    return out;
}

htvm_status read_skeleton(LastError& error, const htvm_skeleton& given, htvm::EncoderOptions& options) {
    htvm_skeleton skeleton{};
    const auto read = check_struct(error, read_struct(&given, skeleton), "htvm_skeleton");
    if (read != HTVM_OK) return read;
    constexpr std::uint32_t most = 1024;
    if (skeleton.joints > most || skeleton.bones > most)
        return error.set(HTVM_BAD_INPUT, "a skeleton has at most 1024 joints and 1024 bones");
    if (skeleton.bones > 0 && !skeleton.bone_joints)
        return error.set(HTVM_BAD_INPUT, "htvm_skeleton.bone_joints is NULL, but there are bones");
    for (std::uint32_t j = 0; j < skeleton.joints; ++j) {
        const char* name = skeleton.joint_names ? skeleton.joint_names[j] : nullptr;
        options.skeleton.joint_names.push_back(name ? name : "joint " + std::to_string(j));
    }
    for (std::uint32_t b = 0; b < skeleton.bones; ++b) {
        options.skeleton.bones.push_back({skeleton.bone_joints[2 * b], skeleton.bone_joints[2 * b + 1]});
        if (skeleton.radii) options.radii.push_back(skeleton.radii[b]);
    }
    return HTVM_OK;
}

// `count` elements of N numbers each; none where the array is NULL.
template <class Element>
std::vector<Element> elements(const typename Element::value_type* numbers, std::size_t count) {
    std::vector<Element> out;
    if (!numbers || count == 0) return out;
    out.resize(count);
    std::memcpy(out.data(), numbers, count * sizeof(Element));
    return out;
}

htvm_status read_mesh(LastError& error, const htvm_mesh* given, htvm::Mesh& out) {
    if (!given) return error.set(HTVM_BAD_INPUT, "the mesh is NULL");
    htvm_mesh mesh{};
    const auto read = check_struct(error, read_struct(given, mesh), "htvm_mesh");
    if (read != HTVM_OK) return read;
    if ((mesh.vertices > 0 && !mesh.positions) || (mesh.triangles > 0 && !mesh.indices))
        return error.set(HTVM_BAD_INPUT, "the mesh has vertices or triangles, but NULL in place of their array");
    out.positions = elements<htvm::Vector3f>(mesh.positions, mesh.vertices);
    out.triangles = elements<htvm::Triangle>(mesh.indices, mesh.triangles);
    out.colours = elements<htvm::Colour>(mesh.colours, mesh.vertices);
    out.normals = elements<htvm::Vector3f>(mesh.normals, mesh.vertices);
    out.texcoords = elements<htvm::Vector2f>(mesh.texcoords, mesh.vertices);
    return HTVM_OK;
}

htvm_status read_pose(htvm_encoder& encoder, const htvm_pose& given, htvm::Pose& out) {
    htvm_pose pose{};
    const auto read = check_struct(encoder.error, read_struct(&given, pose), "htvm_pose");
    if (read != HTVM_OK) return read;
    if (encoder.joints > 0 && !pose.joints) return encoder.error.set(HTVM_BAD_INPUT, "htvm_pose.joints is NULL");
    out.joints = elements<htvm::Vector3d>(pose.joints, encoder.joints);
    out.orientations = elements<htvm::Rotation>(pose.orientations, encoder.bones);
    for (std::size_t j = 0; pose.tracked && j < encoder.joints; ++j) out.tracked.push_back(pose.tracked[j] != 0);
    return HTVM_OK;
}

htvm_status create(LastError& error, const htvm_encoder_options* options, htvm_encoder** encoder) {
    auto all = default_options();
    if (options) {
        const auto read = check_struct(error, read_struct(options, all), "htvm_encoder_options");
        if (read != HTVM_OK) return read;
    }
    if (!htvm::c_api::complete(all.allocator))
        return error.set(HTVM_BAD_INPUT, "htvm_allocator has one of its functions and not the other");
    if (all.frame_choice > HTVM_CHOICE_RATE_DISTORTION)
        return error.set(HTVM_BAD_INPUT, "htvm_encoder_options.frame_choice is none of HTVM_CHOICE_...");
    auto cpp = cpp_options(all);
    if (all.skeleton)
        if (const auto read = read_skeleton(error, *all.skeleton, cpp); read != HTVM_OK) return read;
    auto made = htvm::Encoder::create(cpp);
    if (!made) return error.set(made.error());
    *encoder = htvm::c_api::make_handle<htvm_encoder>(all.allocator, all.allocator, cpp.skeleton, std::move(*made));
    return *encoder ? htvm_status{HTVM_OK} : error.set(HTVM_OUT_OF_MEMORY, "there is no memory for an encoder");
}

}  // namespace

htvm_status htvm_encoder_options_init(htvm_encoder_options* options, size_t struct_size) {
    return htvm::c_api::init_struct(default_options(), options, struct_size);
}
htvm_status htvm_skeleton_init(htvm_skeleton* skeleton, size_t struct_size) {
    return htvm::c_api::init_struct(htvm_skeleton{}, skeleton, struct_size);
}
htvm_status htvm_mesh_init(htvm_mesh* mesh, size_t struct_size) {
    return htvm::c_api::init_struct(htvm_mesh{}, mesh, struct_size);
}
htvm_status htvm_pose_init(htvm_pose* pose, size_t struct_size) {
    return htvm::c_api::init_struct(htvm_pose{}, pose, struct_size);
}

void htvm_quality_steps(double quality, double* geometry_step, double* colour_step) {
    const auto steps = htvm::quality_steps(quality);
    if (geometry_step) *geometry_step = steps.geometry_step;
    if (colour_step) *colour_step = steps.colour_step;
}

htvm_status htvm_encoder_create(const htvm_encoder_options* options, htvm_encoder** encoder, char* text,
                                size_t text_capacity) {
    if (!encoder) return HTVM_BAD_INPUT;
    *encoder = nullptr;
    LastError error;  // there is no handle yet to keep it in
    const auto status = guarded(error, [&] { return create(error, options, encoder); });
    if (text && text_capacity > 0) {
        const std::size_t length = std::min(std::strlen(error.text.data()), text_capacity - 1);
        std::memcpy(text, error.text.data(), length);
        text[length] = '\0';
    }
    return status;
}

void htvm_encoder_destroy(htvm_encoder* encoder) {
    if (encoder) htvm::c_api::destroy_handle(encoder, encoder->allocator);
}

const char* htvm_encoder_last_error(const htvm_encoder* encoder) { return encoder ? encoder->error.text.data() : ""; }

htvm_status htvm_encoder_send_mesh(htvm_encoder* encoder, const htvm_mesh* mesh, const htvm_pose* pose,
                                   int64_t timestamp_us, int force_intra) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        auto& error = encoder->error;
        if (encoder->finished) return error.set(HTVM_BAD_INPUT, "the sequence was finished: no mesh can follow");
        htvm::Mesh cpp_mesh;
        if (const auto read = read_mesh(error, mesh, cpp_mesh); read != HTVM_OK) return read;
        htvm::Pose cpp_pose;
        if (pose)
            if (const auto read = read_pose(*encoder, *pose, cpp_pose); read != HTVM_OK) return read;
        const bool with_pose = pose && encoder->joints > 0;
        const auto pushed =
            encoder->encoder.push(cpp_mesh, with_pose ? &cpp_pose : nullptr, timestamp_us, force_intra != 0);
        if (!pushed) return error.set(pushed.error());
        encoder->any_frame = true;
        encoder->attributes = htvm::c_api::attributes_of(htvm::view_of(cpp_mesh));
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_finish(htvm_encoder* encoder) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        if (!encoder->finished) encoder->encoder.finish();
        encoder->finished = true;
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_receive_packet(htvm_encoder* encoder, uint8_t* buffer, size_t capacity, size_t* size) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        auto& error = encoder->error;
        if (!size) return error.set(HTVM_BAD_INPUT, "size is NULL");
        *size = 0;
        if (encoder->packet.empty())
            if (const auto packet = encoder->encoder.pull()) encoder->packet = htvm::write_packet(*packet);
        if (encoder->packet.empty()) return htvm_status{encoder->finished ? HTVM_END : HTVM_AGAIN};
        *size = encoder->packet.size();
        if (capacity < *size)
            return error.set(HTVM_BUFFER_TOO_SMALL, ("the packet has " + std::to_string(*size) + " bytes").c_str());
        if (!buffer) return error.set(HTVM_BAD_INPUT, "the buffer is NULL");
        std::memcpy(buffer, encoder->packet.data(), *size);
        encoder->packet.clear();
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_last_frame(htvm_encoder* encoder, htvm_frame_info* info, size_t info_size) {
    if (!encoder) return HTVM_BAD_INPUT;
    if (!encoder->any_frame) return HTVM_AGAIN;
    auto out = htvm::c_api::describe(encoder->encoder.last_frame(), encoder->attributes);
    out.joints = static_cast<std::uint32_t>(encoder->joints);
    out.bones = static_cast<std::uint32_t>(encoder->bones);
    const auto written = htvm::c_api::write_struct(out, info, info_size);
    return written == HTVM_OK ? HTVM_OK : encoder->error.set(written, "info is NULL or info_size not its sizeof");
}
