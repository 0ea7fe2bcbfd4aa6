// The decoder, top to bottom: a packet's payload becomes a mesh, an I-frame by itself, an EP-frame against its I-frame.
#include "htvm/decoder.hpp"

#include <new>
#include <stdexcept>

#include "codec/paper/animated_frame.h"
#include "codec/stream/decoder_limits.h"
#include "codec/paper/enhanced_frame.h"
#include "codec/intra/intra_frame.h"
#include "codec/stream/sequence.h"
#include "codec/tracked/tracked_frame.h"
#include "codec/reference/transforms.h"
#include "core/parallel.h"

namespace htvm {

using namespace internal;

struct Decoder::State {
    DecoderOptions options;
    Threads threads = {};
    std::optional<SequenceHeader> header;
    std::vector<std::uint8_t> header_payload;
    std::optional<SequenceInfo> info;
    std::optional<ReferenceMesh> reference;
    std::vector<QuantisedTransform> last_transforms;  // of the frame before, one a bone
    std::int32_t reference_step = 1;                  // quantiser step of the I-frame's positions, lattice units
    std::optional<TrackedReference> tracked;          // made when the first T-frame asks for it
    std::optional<TrackedState> tracked_state;        // of the last T-frame since the I-frame
    std::uint32_t tracked_frame = 0;                  // its number
    LatticeMesh tracked_mesh;                         // as it was shown
    Pose tracked_pose;                                // likewise
    std::optional<NumberedCodebook> geometry_codebook, colour_codebook;
};

namespace {

using State = Decoder::State;
using Frame = std::optional<DecodedFrame>;

std::array<double, 9> matrix_of(const RotationMatrix& m) {
    std::array<double, 9> out{};
    for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<double>(m[i]) / static_cast<double>(1 << matrix_bits);
    return out;
}

Rotation product(const Rotation& a, const Rotation& b) {
    Rotation out{};
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t k = 0; k < 3; ++k) out[3 * row + column] += a[3 * row + k] * b[3 * k + column];
    return out;
}

SequenceInfo describe(const SequenceHeader& header) {
    SequenceInfo info;
    info.lattice_step = header.lattice.step();
    info.fps_numerator = header.fps_numerator;
    info.fps_denominator = header.fps_denominator;
    info.unit_micrometres = header.unit_micrometres;
    info.skeleton_tracked = header.skeleton_tracked;
    info.skeleton = header.skeleton;
    for (const auto r : header.radii) info.radii.push_back(r * info.lattice_step);
    info.nearest_vertices = header.nearest_vertices;
    return info;
}

// What came behind the I-frame in force.
void forget_frames(State& state) {
    state.tracked.reset();
    state.tracked_state.reset();
    state.tracked_mesh = {};
    state.geometry_codebook.reset();
    state.colour_codebook.reset();
}

// Whatever can fail, or find no memory, comes first: then nothing of the state has changed.
Result<Frame> take_header(State& state, const Packet& packet) {
    auto header = read_sequence_header(packet.payload);
    if (!header) return tl::unexpected(header.error());
    if (auto ok = check_limits(*header, state.options); !ok) return tl::unexpected(ok.error());
    // A repeated header changes nothing; another one begins another sequence.
    if (state.header && state.header_payload == packet.payload) return Frame{};
    auto info = describe(*header);
    auto payload = packet.payload;
    state.reference.reset();
    forget_frames(state);
    state.info = std::move(info);
    state.header = std::move(*header);
    state.header_payload = std::move(payload);
    return Frame{};
}

Result<Frame> take_codebook(State& state, const Packet& packet) {
    auto codebook = read_codebook_payload(packet.payload);
    if (!codebook) return tl::unexpected(codebook.error());
    if (!state.reference || state.reference->frame != packet.reference) return Frame{};
    (codebook->purpose == codebook_for_geometry ? state.geometry_codebook : state.colour_codebook) =
        std::move(*codebook);
    return Frame{};
}

MeshCounts counts(const LatticeMesh& mesh) { return {mesh.positions.size(), mesh.triangles.size()}; }

std::uint64_t kept_memory(const State& state) {
    if (!state.reference) return 0;
    const auto mesh = counts(state.reference->mesh);
    return memory_of_reference(mesh) + (state.tracked ? memory_of_tracking(mesh) : 0);
}

// The payload of a frame that this decoder may decode, as far as its header tells.
Result<FramePayload> read_frame(const State& state, const Packet& packet, FrameType type) {
    if (!state.header) return fail(ErrorKind::corrupt_stream, "a frame came before any sequence header");
    auto payload = read_frame_payload(packet.payload);
    if (!payload) return payload;
    const auto& header = payload->header;
    const bool by_itself = type == FrameType::intra || type == FrameType::enhanced;
    if (by_itself && packet.payload.size() < least_payload(header.vertices, header.triangles))
        return fail(ErrorKind::corrupt_stream, "frame " + std::to_string(packet.frame) + " claims " +
                                                   std::to_string(header.vertices) + " vertices and " +
                                                   std::to_string(header.triangles) + " triangles in " +
                                                   std::to_string(packet.payload.size()) + " bytes");
    const auto reference = type != FrameType::intra && state.reference ? counts(state.reference->mesh) : MeshCounts{};
    auto kept = kept_memory(state);
    if (type == FrameType::tracked && !state.tracked) kept += memory_of_tracking(reference);
    if (auto ok = check_limits(type, header, reference, kept, state.options); !ok)
        return fail(ok.error().kind, "frame " + std::to_string(packet.frame) + ": " + ok.error().message);
    return payload;
}

Result<Frame> decode_intra(State& state, const Packet& packet) {
    const auto payload = read_frame(state, packet, FrameType::intra);
    if (!payload) return tl::unexpected(payload.error());
    const auto& skeleton = state.header->skeleton;
    const auto pose = decode_pose(payload->of(Layer::pose), skeleton.joint_names.size(), skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    // It follows from the reference mesh: should this frame prove bad, the next T-frame has it made again. The memory
    // is worth more, or streams of many I-frames would take half as much again as those of one.
    state.tracked.reset();
    const auto& external = state.options.intra_coder;
    auto mesh = decode_intra_frame(*payload, external ? &*external : nullptr);
    if (!mesh) return tl::unexpected(mesh.error());
    DecodedFrame out;
    out.mesh = to_mesh(*mesh, state.header->lattice);
    for (const auto joint : pose->joints) out.pose.joints.push_back(to_millimetres(joint, state.header->lattice));
    for (const auto& rotation : pose->orientations)
        out.pose.orientations.push_back(matrix_of(rotation_matrix(rotation)));
    auto reference = make_reference(std::move(*mesh), skeleton.bones, pose->joints, pose->orientations,
                                    state.header->radii, state.header->weight_width, packet.frame, state.threads);
    std::vector<QuantisedTransform> still(skeleton.bones.size());
    // From here on nothing can fail.
    state.reference = std::move(reference);
    state.last_transforms = std::move(still);
    state.reference_step = static_cast<std::int32_t>(payload->header.geometry_step);
    forget_frames(state);
    return Frame{std::move(out)};
}

// The I-frame's joints, each moved by the first bone that it belongs to.
Pose moved_pose(const State& state, std::span<const QuantisedTransform> transforms) {
    const auto& reference = *state.reference;
    const auto& bones = state.header->skeleton.bones;
    Pose pose;
    std::vector<LatticePoint> joints = reference.joints;
    std::vector<bool> moved(joints.size(), false);
    for (std::size_t i = 0; i < bones.size(); ++i) {
        const auto matrix = rotation_matrix(transforms[i].rotation);
        for (const auto joint : {bones[i].first, bones[i].second}) {
            if (moved[joint]) continue;
            joints[joint] = move(reference.joints[joint], matrix, reference.pivots[i], transforms[i].shift);
            moved[joint] = true;
        }
        pose.orientations.push_back(product(matrix_of(matrix), matrix_of(rotation_matrix(reference.orientations[i]))));
    }
    for (const auto joint : joints) pose.joints.push_back(to_millimetres(joint, state.header->lattice));
    return pose;
}

const Codebook* named(const std::optional<NumberedCodebook>& codebook, std::uint32_t number) {
    return codebook && codebook->number == number ? &codebook->codebook : nullptr;
}

Result<void> check_reference(const State& state, const Packet& packet) {
    if (state.reference && state.reference->frame == packet.reference) return {};
    return fail(ErrorKind::corrupt_stream, "frame " + std::to_string(packet.frame) + " refers to frame " +
                                               std::to_string(packet.reference) + ", which is not there");
}

Result<Frame> decode_enhanced(State& state, const Packet& packet) {
    const auto payload = read_frame(state, packet, FrameType::enhanced);
    if (!payload) return tl::unexpected(payload.error());
    if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    const EnhancedFrameContext context{
        *state.reference, named(state.geometry_codebook, payload->header.geometry_codebook),
        named(state.colour_codebook, payload->header.colour_codebook), state.header->nearest_vertices, state.threads};
    auto decoded = decode_enhanced_frame(*payload, context);
    if (!decoded) {
        // This much may still serve to conceal the frame.
        if (auto moved = decode_transforms(payload->of(Layer::transforms), state.reference->pivots.size()))
            state.last_transforms = std::move(*moved);
        return tl::unexpected(decoded.error());
    }
    state.last_transforms = std::move(decoded->transforms);
    // Zippered frames count only what they code in their headers.
    if (decoded->mesh.positions.size() > state.options.max_vertices ||
        decoded->mesh.triangles.size() > state.options.max_triangles)
        return fail(ErrorKind::limit, "frame " + std::to_string(packet.frame) +
                                          " has more vertices or triangles than this decoder accepts; raise its "
                                          "max_vertices or max_triangles");
    DecodedFrame out;
    out.mesh = to_mesh(decoded->mesh, state.header->lattice);
    out.pose = moved_pose(state, state.last_transforms);
    return Frame{std::move(out)};
}

Result<Frame> decode_predicted(State& state, const Packet& packet) {
    const auto payload = read_frame(state, packet, FrameType::predicted);
    if (!payload) return tl::unexpected(payload.error());
    if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    auto decoded = decode_predicted_frame(*payload, *state.reference, state.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    DecodedFrame out;
    out.mesh = to_mesh(decoded->mesh, state.header->lattice);
    out.pose = moved_pose(state, decoded->transforms);
    state.last_transforms = std::move(decoded->transforms);
    return Frame{std::move(out)};
}

// The I-frame's joints, each moved as the node nearest to it.
Pose tracked_pose(const State& state, const TrackedReference& tracked, std::span<const QuantisedTransform> transforms) {
    const auto& bones = state.header->skeleton.bones;
    std::vector<std::size_t> node_of_joint;
    Pose pose;
    for (const auto joint : state.reference->joints) {
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < tracked.pivots.size(); ++i)
            if (squared_distance(joint, tracked.pivots[i]) < squared_distance(joint, tracked.pivots[nearest]))
                nearest = i;
        node_of_joint.push_back(nearest);
        const auto moved = tracked.pivots.empty() ? joint
                                                  : move(joint, rotation_matrix(transforms[nearest].rotation),
                                                         tracked.pivots[nearest], transforms[nearest].shift);
        pose.joints.push_back(to_millimetres(moved, state.header->lattice));
    }
    for (std::size_t i = 0; i < bones.size(); ++i) {
        const auto rest = matrix_of(rotation_matrix(state.reference->orientations[i]));
        pose.orientations.push_back(
            tracked.pivots.empty()
                ? rest
                : product(matrix_of(rotation_matrix(transforms[node_of_joint[bones[i].first]].rotation)), rest));
    }
    return pose;
}

Result<Frame> decode_tracked(State& state, const Packet& packet) {
    const auto payload = read_frame(state, packet, FrameType::tracked);
    if (!payload) return tl::unexpected(payload.error());
    if (state.header->node_spacing == 0)
        return fail(ErrorKind::corrupt_stream, "a tracked frame in a stream whose header says that it has none");
    const bool of_frame_before = state.tracked_state && state.tracked_frame == packet.reference;
    if (!of_frame_before)
        if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    if (!state.tracked) {
        auto tracked = make_tracked_reference(state.reference->mesh, state.header->node_spacing, state.reference_step);
        if (!tracked) return tl::unexpected(tracked.error());
        state.tracked = std::move(*tracked);
    }
    auto decoded = decode_tracked_frame(*payload, *state.tracked, of_frame_before ? &*state.tracked_state : nullptr,
                                        state.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    DecodedFrame out;
    out.mesh = to_mesh(decoded->mesh, state.header->lattice);
    out.pose = tracked_pose(state, *state.tracked, decoded->state.transforms);
    auto pose = out.pose;
    state.tracked_pose = std::move(pose);
    state.tracked_state = std::move(decoded->state);
    state.tracked_mesh = std::move(decoded->mesh);
    state.tracked_frame = packet.frame;
    return Frame{std::move(out)};
}

Result<Frame> take(State& state, const Packet& packet) {
    if (auto ok = check_limits(packet, state.options); !ok) return tl::unexpected(ok.error());
    switch (packet.kind) {
        case PacketKind::sequence:
            return take_header(state, packet);
        case PacketKind::codebook:
            return take_codebook(state, packet);
        case PacketKind::intra:
            return decode_intra(state, packet);
        case PacketKind::enhanced:
            return decode_enhanced(state, packet);
        case PacketKind::predicted:
            return decode_predicted(state, packet);
        case PacketKind::tracked:
            return decode_tracked(state, packet);
        case PacketKind::index:
            break;
    }
    return Frame{};  // what this version does not know is skipped
}

Result<Frame> out_of_memory(const Packet& packet) {
    try {
        return fail(ErrorKind::limit, "out of memory at frame " + std::to_string(packet.frame));
    } catch (const std::bad_alloc&) {
        return fail(ErrorKind::limit, "out of memory");  // short enough to need none
    }
}

}  // namespace

Decoder::Decoder(const DecoderOptions& options) : state_(std::make_unique<State>()) {
    state_->options = options;
    state_->threads = thread_count(options.threads);
}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<std::optional<DecodedFrame>> Decoder::push(const Packet& packet) {
    try {
        auto frame = take(*state_, packet);
        if (frame && *frame) {
            auto& info = (*frame)->info = *inspect(packet);
            // Motion-based coding counts only what is coded in its header.
            info.vertices = static_cast<std::uint32_t>((*frame)->mesh.positions.size());
            info.triangles = static_cast<std::uint32_t>((*frame)->mesh.triangles.size());
        }
        return frame;
    } catch (const std::bad_alloc&) {
        return out_of_memory(packet);
    } catch (const std::length_error&) {
        return out_of_memory(packet);
    }
}

std::optional<DecodedFrame> Decoder::conceal(std::uint32_t frame, std::int64_t timestamp_us) const try {
    const auto& state = *state_;
    if (!state.reference) return std::nullopt;
    const auto& reference = *state.reference;
    DecodedFrame out;
    const auto& transforms = state.last_transforms;
    if (state.tracked_state) {
        out.mesh = to_mesh(state.tracked_mesh, state.header->lattice);
        out.pose = state.tracked_pose;
    } else {
        out.mesh = to_mesh(animate(reference, transforms, predict_positions(reference, transforms, state.threads)),
                           state.header->lattice);
        out.pose = moved_pose(state, transforms);
    }
    out.concealed = true;
    out.info.type = FrameType::predicted;
    out.info.frame = frame;
    out.info.reference = reference.frame;
    out.info.timestamp_us = timestamp_us;
    out.info.vertices = static_cast<std::uint32_t>(out.mesh.positions.size());
    out.info.triangles = static_cast<std::uint32_t>(out.mesh.triangles.size());
    return out;
} catch (const std::bad_alloc&) {
    return std::nullopt;
} catch (const std::length_error&) {
    return std::nullopt;
}

const std::optional<SequenceInfo>& Decoder::sequence() const { return state_->info; }

std::optional<FrameType> frame_type(PacketKind kind) {
    switch (kind) {
        case PacketKind::intra:
            return FrameType::intra;
        case PacketKind::enhanced:
            return FrameType::enhanced;
        case PacketKind::predicted:
            return FrameType::predicted;
        case PacketKind::tracked:
            return FrameType::tracked;
        case PacketKind::sequence:
        case PacketKind::codebook:
        case PacketKind::index:
            break;
    }
    return std::nullopt;
}

Result<FrameInfo> inspect(const Packet& packet) {
    const auto type = frame_type(packet.kind);
    if (!type) return fail(ErrorKind::bad_input, "the packet is not a frame");
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    FrameInfo out;
    out.type = *type;
    out.frame = packet.frame;
    out.reference = packet.reference;
    out.timestamp_us = packet.timestamp_us;
    out.source_vertices = payload->header.source_vertices;
    out.source_triangles = payload->header.source_triangles;
    out.vertices = payload->header.vertices;
    out.triangles = payload->header.triangles;
    auto size = [&](Layer layer) { return payload->of(layer).size(); };
    auto& b = out.bytes;
    b.pose = size(Layer::pose);
    b.transforms = size(Layer::transforms);
    b.geometry = size(Layer::geometry);
    b.colour = size(Layer::colour);
    b.normals = size(Layer::normals);
    b.texcoords = size(Layer::texcoords);
    b.mapping = size(Layer::mapping);
    b.fans = size(Layer::fans);
    b.distance_orders = size(Layer::distance_orders);
    b.external_intra = size(Layer::external_intra);
    b.overhead = packet.payload.size() + packet_overhead - b.total();
    return out;
}

}  // namespace htvm
