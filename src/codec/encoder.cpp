// The encoder, top to bottom: a frame's mesh goes onto the lattice, becomes an I- or an EP-frame, and leaves as
// packets.
#include "htvm/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "codec/encoder_pose.h"
#include "codec/enhanced_frame_enc.h"
#include "codec/intra_frame.h"
#include "codec/sequence_header.h"
#include "codec/sequence_index.h"
#include "codec/stage_clock_enc.h"
#include "core/parallel.h"
#include "htvm/decoder.hpp"

namespace htvm {

struct Encoder::State {
    EncoderOptions options;
    unsigned threads = 1;
    SequenceHeader header;
    bool begun = false, finished = false;
    PoseTracker poses;
    std::uint32_t next_frame = 0;
    std::optional<std::int64_t> last_timestamp;
    std::int32_t geometry_step = 1;   // lattice units
    std::int32_t reference_step = 1;  // of the last I-frame and the EP-frames that refer to it

    std::optional<ReferenceMesh> reference;
    std::optional<ReferenceSearch> search;
    std::vector<RigidMotion> motion_before;
    CodebookInUse geometry_codebook, colour_codebook;

    std::deque<Packet> packets;
    std::uint64_t stream_bytes = 0;
    std::vector<IndexEntry> index;

    FrameInfo info;
    LatticeMesh decoded;
    std::vector<StageTime> stages;
    std::vector<std::uint32_t> distance_order_counts;
};

namespace {

using State = Encoder::State;

Result<void> check(const EncoderOptions& o) {
    auto bad = [](const char* what) { return fail(ErrorKind::bad_input, what); };
    if (!(o.geometry_step >= 1.0 / 65536 && o.geometry_step <= 1000))
        return bad("the geometry step must be within 2^-16 and 1000 mm");
    if (!(o.colour_step >= 1 && o.colour_step <= 255)) return bad("the colour step must be within 1 and 255 levels");
    if (!(o.lambda >= 0 && o.lambda <= 1000)) return bad("lambda must be within 0 and 1000");
    if (o.key_interval < 1) return bad("the key interval must be at least 1 frame");
    if (o.nearest_vertices < 1 || o.nearest_vertices > 64) return bad("the nearest vertices must be within 1 and 64");
    if (o.lattice_bits < 0 || o.lattice_bits > 16) return bad("the lattice bits must be within 0 and 16");
    if (o.fps_numerator == 0 || o.fps_denominator == 0) return bad("the frame rate must be above 0");
    if (o.unit_micrometres == 0) return bad("the unit must be above 0");
    if (o.skeleton.joint_names.size() > 1024 || o.skeleton.bones.size() > 1024)
        return bad("a skeleton has at most 1024 joints and bones");
    if (o.intra_coder &&
        (o.intra_coder->number == intra_coder_tfan || !o.intra_coder->encode || !o.intra_coder->decode))
        return bad("the intra coder must have a number above 0, encode and decode");
    if (!o.radii.empty() && o.radii.size() != o.skeleton.bones.size()) return bad("the radii are not one a bone");
    if (!(o.weight_width >= 0 && o.weight_width <= 1000)) return bad("the weight width must be within 0 and 1000 mm");
    for (const auto r : o.radii)
        if (!(r >= 0 && r < 100000)) return bad("a bone radius must be within 0 and 100 m");
    for (const auto& bone : o.skeleton.bones)
        if (bone.first >= o.skeleton.joint_names.size() || bone.second >= o.skeleton.joint_names.size())
            return bad("a bone names a joint that the skeleton has not");
    return {};
}

// 1/16 mm, or as fine as makes the step eight units.
int lattice_bits(const EncoderOptions& options) {
    if (options.lattice_bits > 0) return options.lattice_bits;
    const int needed = static_cast<int>(std::ceil(3 - std::log2(options.geometry_step)));
    return std::clamp(needed, 4, 16);
}

void send(State& state, Packet packet) {
    state.stream_bytes += packet.payload.size() + packet_overhead;
    state.packets.push_back(std::move(packet));
}

// The sequence header goes out with the first frame: its origin and, where none were given, the radii come from there.
Result<void> begin(State& state, const Mesh& mesh, const Pose* pose) {
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    auto& header = state.header;
    header.lattice.origin = *origin;
    header.lattice.bits = lattice_bits(state.options);
    auto tracker = make_pose_tracker(state.options.skeleton, mesh, pose);
    if (!tracker) return tl::unexpected(tracker.error());
    state.poses = std::move(*tracker);
    header.skeleton = state.poses.skeleton;
    header.skeleton_tracked = state.poses.tracked;
    auto radii = state.options.radii;
    if (radii.empty()) {
        auto calibrated = calibrate(mesh, header.skeleton, state.poses.last);
        if (!calibrated) return tl::unexpected(calibrated.error());
        radii = std::move(*calibrated);
    }
    const double units = 1.0 / header.lattice.step();
    header.radii.clear();
    for (const auto r : radii)
        header.radii.push_back(static_cast<std::int32_t>(std::lround(std::min(r * units, 1.0 * lattice_limit))));
    header.fps_numerator = state.options.fps_numerator;
    header.fps_denominator = state.options.fps_denominator;
    header.unit_micrometres = state.options.unit_micrometres;
    header.nearest_vertices = static_cast<std::uint8_t>(state.options.nearest_vertices);
    header.weight_width =
        static_cast<std::int32_t>(std::lround(std::min(state.options.weight_width * units, 1.0 * lattice_limit)));
    state.geometry_step = static_cast<std::int32_t>(
        std::clamp(std::lround(state.options.geometry_step * units), 1L, static_cast<long>(lattice_limit)));
    return {};
}

EnhancedFrameOptions enhanced_options(const State& state) {
    EnhancedFrameOptions out;
    out.colour.step = static_cast<std::int32_t>(std::lround(state.options.colour_step));
    out.geometry.lambda = out.colour.lambda = state.options.lambda;
    const double ratio = static_cast<double>(state.geometry_step) / state.reference_step;
    out.geometry.step = state.reference_step;
    out.geometry.lambda *= ratio * ratio;
    out.geometry.threads = out.colour.threads = out.threads = state.threads;
    out.registration.point_to_plane = state.options.point_to_plane;
    if (!state.options.point_to_plane) {  // slower to settle
        out.registration.iterations = 16;
        out.registration.samples = 500;
    }
    out.reference_choice =
        state.options.reference_vertices == ReferenceVertices::bone ? ReferenceChoice::bone : ReferenceChoice::any;
    out.merge_duplicates = state.options.merge_duplicates;
    out.nearest_vertices = state.options.nearest_vertices;
    return out;
}

// Where frames refer to an I-frame, its step is no wider than half an edge: EP-frames then save more than it costs.
// Their quantiser starts from the same cells; the price of a bit stays that of the step asked for, so that it is the
// entropy constraint that makes it coarse. At 8 mm and 35,000 vertices: a fifth fewer bits at the same error.
std::int32_t step_for_reference(const State& state, const LatticeMesh& mesh) {
    if (state.options.key_interval == 1) return state.geometry_step;
    const double half_edge = mean_edge(mesh) / 2;
    return half_edge >= 1 && half_edge < state.geometry_step ? static_cast<std::int32_t>(half_edge)
                                                             : state.geometry_step;
}

bool same_attributes(const LatticeMesh& a, const LatticeMesh& b) {
    return a.colours.empty() == b.colours.empty() && a.normals.empty() == b.normals.empty() &&
           a.texcoords.empty() == b.texcoords.empty();
}

bool must_be_intra(const State& state, const LatticeMesh& mesh) {
    return !state.reference || state.reference->mesh.positions.empty() || mesh.positions.empty() ||
           state.next_frame - state.reference->frame >= static_cast<std::uint32_t>(state.options.key_interval) ||
           !same_attributes(mesh, state.reference->mesh);
}

Result<Packet> encode_intra(State& state, const LatticeMesh& mesh, const CodedPose& pose) {
    StageClock clock(state.stages);
    IntraFrameOptions options;
    options.geometry_step = state.reference_step = step_for_reference(state, mesh);
    options.colour_step = static_cast<std::int32_t>(std::lround(state.options.colour_step));
    options.merge_duplicates = state.options.merge_duplicates;
    options.external = state.options.intra_coder ? &*state.options.intra_coder : nullptr;
    FramePayload payload;
    auto decoded = encode_intra_frame(mesh, options, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    payload.set(Layer::pose, encode_pose(pose));
    clock.done("intra coding");
    state.decoded = std::move(*decoded);
    state.reference = make_reference(state.decoded, state.header.skeleton.bones, pose.joints, pose.orientations,
                                     state.header.radii, state.header.weight_width, state.next_frame, state.threads);
    state.search = make_reference_search(*state.reference);
    state.motion_before.clear();
    state.geometry_codebook = {};
    state.colour_codebook = {};
    clock.done("reference");
    Packet packet;
    packet.kind = PacketKind::intra;
    packet.payload = write_frame_payload(payload);
    return packet;
}

Packet codebook_packet(std::uint8_t purpose, const CodebookInUse& use) {
    Packet packet;
    packet.kind = PacketKind::codebook;
    packet.payload = write_codebook_payload(purpose, use.number, *use.codebook);
    return packet;
}

// The packets of an EP-frame: new codebooks first, the frame last.
std::vector<Packet> encode_enhanced(State& state, const LatticeMesh& mesh, const CodedPose& pose) {
    EnhancedFrameState frame_state;
    frame_state.reference = &*state.reference;
    frame_state.search = &*state.search;
    frame_state.bones = &state.header.skeleton.bones;
    frame_state.radii = state.header.radii;
    frame_state.motion_before = &state.motion_before;
    frame_state.geometry_codebook = &state.geometry_codebook;
    frame_state.colour_codebook = &state.colour_codebook;
    auto encoded = encode_enhanced_frame(mesh, pose, frame_state, enhanced_options(state), state.stages);
    state.decoded = std::move(encoded.mesh);
    state.distance_order_counts = std::move(encoded.distance_order_counts);
    std::vector<Packet> packets;
    if (state.geometry_codebook.is_new)
        packets.push_back(codebook_packet(codebook_for_geometry, state.geometry_codebook));
    if (state.colour_codebook.is_new) packets.push_back(codebook_packet(codebook_for_colour, state.colour_codebook));
    Packet packet;
    packet.kind = PacketKind::enhanced;
    packet.payload = write_frame_payload(encoded.payload);
    packets.push_back(std::move(packet));
    return packets;
}

// Numbers and queues a frame's packets, and adds up where their bytes went.
void send_frame(State& state, std::vector<Packet> packets, std::int64_t timestamp_us) {
    LayerBytes codebooks;
    for (auto& packet : packets) {
        packet.frame = state.next_frame;
        packet.reference = state.reference->frame;
        packet.timestamp_us = timestamp_us;
        if (packet.kind == PacketKind::codebook) {
            codebooks.overhead += packet_overhead;
            (packet.payload[0] == codebook_for_geometry ? codebooks.geometry : codebooks.colour) +=
                packet.payload.size();
            continue;
        }
        state.info = *inspect(packet);
        state.info.bytes.overhead += codebooks.overhead;
        state.info.bytes.geometry += codebooks.geometry;
        state.info.bytes.colour += codebooks.colour;
        if (packet.kind == PacketKind::intra)
            state.index.push_back({packet.frame, packet.timestamp_us, state.stream_bytes});
    }
    for (auto& packet : packets) send(state, std::move(packet));
}

Result<void> push_frame(State& state, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    StageClock clock(state.stages);
    const auto on_lattice = to_lattice(mesh, state.header.lattice);
    if (!on_lattice) return tl::unexpected(on_lattice.error());
    const auto coded_pose = state.poses.next(mesh, pose, state.header.lattice);
    if (!coded_pose) return tl::unexpected(coded_pose.error());
    clock.done("to the lattice");
    std::vector<Packet> packets;
    if (force_intra || must_be_intra(state, *on_lattice)) {
        auto packet = encode_intra(state, *on_lattice, *coded_pose);
        if (!packet) return tl::unexpected(packet.error());
        packets.push_back(std::move(*packet));
    } else {
        packets = encode_enhanced(state, *on_lattice, *coded_pose);
    }
    if (!state.begun) {
        Packet header;
        header.payload = write_sequence_header(state.header);
        header.timestamp_us = timestamp_us;
        send(state, std::move(header));
        state.begun = true;
    }
    send_frame(state, std::move(packets), timestamp_us);
    ++state.next_frame;
    state.last_timestamp = timestamp_us;
    return {};
}

}  // namespace

QualitySteps quality_steps(double quality) {
    const double q = std::clamp(quality, 0.0, 100.0) / 100;
    return {16 * std::exp2(-6 * q), 32 * std::exp2(-5 * q)};
}

Result<Encoder> Encoder::create(const EncoderOptions& options) {
    if (auto ok = check(options); !ok) return tl::unexpected(ok.error());
    auto state = std::make_unique<State>();
    state->options = options;
    state->threads = thread_count(options.threads);
    return Encoder(std::move(state));
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Result<void> Encoder::push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto& state = *state_;
    state.stages.clear();
    if (state.finished) return fail(ErrorKind::bad_input, "the sequence was finished; start a new encoder");
    if (state.last_timestamp && timestamp_us <= *state.last_timestamp)
        return fail(ErrorKind::bad_input, "timestamps must ascend");
    if (!state.begun)
        if (auto ok = begin(state, mesh, pose); !ok) return ok;
    return push_frame(state, mesh, pose, timestamp_us, force_intra);
}

void Encoder::finish() {
    auto& state = *state_;
    if (state.finished || !state.begun) return;
    state.finished = true;
    Packet packet;
    packet.kind = PacketKind::index;
    packet.frame = state.next_frame;
    packet.timestamp_us = *state.last_timestamp;
    packet.payload = write_sequence_index(state.index);
    send(state, std::move(packet));
}

std::optional<Packet> Encoder::pull() {
    if (state_->packets.empty()) return std::nullopt;
    Packet packet = std::move(state_->packets.front());
    state_->packets.pop_front();
    return packet;
}

const FrameInfo& Encoder::last_frame() const { return state_->info; }
Mesh Encoder::reconstruction() const { return to_mesh(state_->decoded, state_->header.lattice); }
const std::vector<StageTime>& Encoder::stage_times() const { return state_->stages; }
const std::vector<std::uint32_t>& Encoder::distance_order_counts() const { return state_->distance_order_counts; }

}  // namespace htvm
