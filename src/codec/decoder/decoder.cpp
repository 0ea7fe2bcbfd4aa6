// The decoder: checks a packet, has the decoder of its kind make a mesh of it, and shows that mesh.
#include "htvm/decoder.hpp"

#include <algorithm>
#include <array>

#include "codec/charts/chart_layer.h"
#include "codec/decoder/frame_decoders.h"
#include "codec/format/decoder_limits.h"
#include "codec/format/frame_kinds.h"
#include "codec/tracked/presence.h"
#include "core/memory_guard.h"
#include "core/parallel.h"

namespace htvm {

using namespace internal;

struct Decoder::State : DecoderState {};

namespace internal {

Rotation to_rotation(const RotationMatrix& m) {
    Rotation out{};
    for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<double>(m[i]) / static_cast<double>(1 << matrix_bits);
    return out;
}

Pose to_pose(const CodedPose& pose, const Lattice& lattice) {
    Pose out;
    for (const auto joint : pose.joints) out.joints.push_back(to_millimetres(joint, lattice));
    for (const auto& rotation : pose.orientations) out.orientations.push_back(to_rotation(rotation_matrix(rotation)));
    return out;
}

Rotation product(const Rotation& a, const Rotation& b) {
    Rotation out{};
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t k = 0; k < 3; ++k) out[3 * row + column] += a[3 * row + k] * b[3 * k + column];
    return out;
}

namespace {

// A copy moves with the vertex that it is one of.
template <class Values>
void repeat(std::span<const std::uint32_t> copied, Values& values) {
    if (values.empty()) return;
    values.reserve(values.size() + copied.size());
    for (const auto v : copied) values.push_back(values[v]);
}

// The topology number for what is there of a reference: the reference's own where all of it is, and that of the frame
// before where that had the same triangles.
std::uint32_t topology_of_present(DecoderState& state, std::uint32_t reference_topology,
                                  std::span<const std::uint8_t> presence) {
    if (presence.empty()) return reference_topology;
    auto& last = state.shown_presence;
    if (last.reference_topology == reference_topology &&
        std::equal(last.presence.begin(), last.presence.end(), presence.begin(), presence.end()))
        return last.topology;
    last = {reference_topology, new_topology(state), Presence(presence.begin(), presence.end())};
    return last.topology;
}

// Leaves those triangles that are there, and says which vertices are.
void show_part(ShownFrame& shown, const TexturedSurface* textured, std::span<const std::uint8_t> presence) {
    shown.presence.assign(presence.begin(), presence.end());
    if (textured) repeat(textured->copied, shown.presence);
    if (presence.empty()) return;
    triangles_shown(shown.triangles, shown.presence, shown.own_triangles);
    shown.triangles = shown.own_triangles;
}

// A mesh with charts as it is shown with fewer levels of detail than it has; made when these or the mesh are others.
const TexturedSurface* with_fewer_levels(ShownFrame& shown, const LatticeMeshView& mesh, std::size_t levels,
                                         std::uint32_t reference_topology) {
    if (shown.coarser_topology != reference_topology || shown.coarser_levels != levels) {
        shown.coarser_topology = 0;
        // With all levels there was no error, so there is none now.
        shown.coarser =
            textured_surface(mesh.positions.size(), mesh.triangles, mesh.textured->corners, *mesh.detail, levels)
                .value_or(TexturedSurface());
        shown.coarser_topology = reference_topology;
        shown.coarser_levels = levels;
        shown.texcoords_topology = 0;
    }
    return &shown.coarser;
}

// The mesh as it is shown: with the detail that is asked for, where it has any.
LatticeMeshView with_detail(DecoderState& state, const LatticeMeshView& mesh, std::uint32_t reference_topology) {
    if (!mesh.detail || mesh.detail->empty()) return mesh;
    const auto& detail = *mesh.detail;
    const auto levels = std::min<std::size_t>(state.options.detail_levels, detail.levels.size());
    const bool has_charts = mesh.textured && !mesh.textured->empty();
    auto out = mesh;
    if (has_charts && levels < detail.levels.size())
        out.textured = with_fewer_levels(state.shown, mesh, levels, reference_topology);
    if (levels == 0) return out;
    auto& fine = state.shown.fine;
    auto& presence = state.shown.fine_presence;
    fine.positions.assign(mesh.positions.begin(), mesh.positions.end());
    fine.colours.assign(mesh.colours.begin(), mesh.colours.end());
    fine.normals.assign(mesh.normals.begin(), mesh.normals.end());
    presence.assign(mesh.presence.begin(), mesh.presence.end());
    add_detail(detail, levels, mesh.triangles, fine.positions, state.threads);
    add_detail(detail, levels, fine.colours);
    add_detail(detail, levels, fine.normals);
    add_detail(detail, levels, presence);
    out.positions = fine.positions;
    out.triangles = detail.triangles(levels);
    out.colours = fine.colours;
    out.normals = fine.normals;
    out.presence = presence;
    return out;
}

}  // namespace

void show(DecoderState& state, const LatticeMeshView& coded, std::uint32_t reference_topology, Pose pose) {
    const auto mesh = with_detail(state, coded, reference_topology);
    const auto& lattice = state.header->lattice;
    const auto* textured = mesh.textured && !mesh.textured->empty() ? mesh.textured : nullptr;
    const auto presence = anything_absent(mesh.presence) ? mesh.presence : std::span<const std::uint8_t>();
    auto& shown = state.shown;
    shown.topology = 0;
    to_millimetres(mesh.positions, lattice, shown.positions);
    to_unit_normals(mesh.normals, shown.normals);
    if (mesh.projection) {
        shown.texcoords_topology = 0;
        project(*mesh.projection, mesh.positions, shown.projected);
        to_texcoords(shown.projected, chart_texcoord_unit, shown.texcoords);
    } else if (shown.texcoords_topology != reference_topology) {
        shown.texcoords_topology = 0;
        if (textured)
            to_texcoords(textured->texcoords, chart_texcoord_unit, shown.texcoords);
        else
            to_texcoords(mesh.texcoords, captured_texcoord_unit, shown.texcoords);
        shown.texcoords_topology = reference_topology;
    }
    shown.triangles = textured ? textured->triangles : mesh.triangles;
    show_part(shown, textured, presence);
    shown.colours = mesh.colours;
    if (textured) {
        repeat(textured->copied, shown.positions);
        repeat(textured->copied, shown.normals);
        if (!mesh.colours.empty()) {
            shown.own_colours.assign(mesh.colours.begin(), mesh.colours.end());
            repeat(textured->copied, shown.own_colours);
            shown.colours = shown.own_colours;
        }
    }
    shown.pose = std::move(pose);
    shown.reference_topology = reference_topology;
    shown.topology = topology_of_present(state, reference_topology, presence);
}

Result<TexturedSurface> read_charts(const DecoderState& state, const FramePayloadView& payload, const LatticeMesh& mesh,
                                    const SurfaceDetail& detail, std::vector<CornerTexcoords> before) {
    const auto& picture = state.header->texture;
    if (picture.layout != TextureLayout::charts || (before.empty() && !payload.has(Layer::charts)))
        return TexturedSurface();
    if (!mesh.texcoords.empty())
        return fail(ErrorKind::corrupt_stream, "a frame that has both charts and texture coordinates");
    const auto triangles = std::span(mesh.triangles).subspan(before.size());
    if (!triangles.empty()) {
        const auto layout = decode_charts(payload.of(Layer::charts), mesh.positions, triangles);
        if (!layout) return tl::unexpected(layout.error());
        const auto corners = chart_texcoords(*layout, picture, mesh.positions, triangles);
        if (!corners) return tl::unexpected(corners.error());
        before.insert(before.end(), corners->begin(), corners->end());
    }
    auto out = textured_surface(mesh.positions.size(), mesh.triangles, std::move(before), detail, detail.levels.size());
    if (!out) return out;
    if (out->texcoords.size() > state.options.max_vertices)
        return fail(ErrorKind::limit, "with those repeated at its charts' seams, the frame has " +
                                          std::to_string(out->texcoords.size()) +
                                          " vertices, more than this decoder accepts; raise its max_vertices");
    return out;
}

Result<std::optional<FilmProjection>> read_projection(const DecoderState& state, const FramePayloadView& payload,
                                                      const LatticeMesh& mesh) {
    using Read = std::optional<FilmProjection>;
    if (state.header->texture.layout != TextureLayout::projection || !payload.has(Layer::charts)) return Read();
    if (!mesh.texcoords.empty())
        return fail(ErrorKind::corrupt_stream, "a frame that has both a projection and texture coordinates");
    const auto read = read_projection_layer(payload.of(Layer::charts));
    if (!read) return tl::unexpected(read.error());
    return Read(*read);
}

Result<void> check_reference(const DecoderState& state, const Packet& packet) {
    if (state.reference && state.reference->number == packet.reference) return {};
    return fail(ErrorKind::corrupt_stream, "frame " + std::to_string(packet.frame) + " refers to frame " +
                                               std::to_string(packet.reference) + ", which is not there");
}

}  // namespace internal

namespace {

// By FrameType.
constexpr std::array<FrameDecoder*, frame_type_count> frame_decoders = {
    decode_intra, decode_enhanced, decode_predicted, decode_tracked, decode_patched,
};

SequenceInfo describe(const SequenceHeader& header, std::uint32_t ordinal) {
    SequenceInfo info;
    info.version = header.version;
    info.ordinal = ordinal;
    info.session = header.session;
    info.up = header.up;
    if (header.floor)
        info.floor = to_millimetres({*header.floor, *header.floor, *header.floor}, header.lattice)[axis_of(header.up)];
    info.metadata = header.metadata;
    info.global_shift = header.global_shift;
    info.texture = header.texture;
    info.lattice_step = header.lattice.step();
    info.fps_numerator = header.fps_numerator;
    info.fps_denominator = header.fps_denominator;
    info.unit_micrometres = header.unit_micrometres;
    info.has_skeleton = header.has_skeleton;
    info.skeleton = header.skeleton;
    for (const auto r : header.radii) info.radii.push_back(r * info.lattice_step);
    info.nearest_vertices = header.nearest_vertices;
    return info;
}

// Everything that can fail or run out of memory comes first, so that the state is unchanged on failure.
Result<void> apply_header(DecoderState& state, const Packet& packet) {
    auto header = read_sequence_header(packet.payload);
    if (!header) return tl::unexpected(header.error());
    if (auto ok = check_limits(*header, state.options); !ok) return tl::unexpected(ok.error());
    // A repeated header changes nothing; a different one begins another sequence.
    const bool same = state.header && state.header_payload == packet.payload;
    if (!begins_sequence(same, header->session != 0, packet.frame, state.highest_frame)) return {};
    auto info = describe(*header, state.sequences);
    auto payload = packet.payload;
    ++state.sequences;
    state.highest_frame.reset();
    state.reference.reset();
    state.bones = {};
    state.nodes = {};
    state.unreferred.reset();
    state.info = std::move(info);
    state.header = std::move(*header);
    state.header_payload = std::move(payload);
    return {};
}

Result<void> apply_codebook(DecoderState& state, const Packet& packet) {
    auto codebook = read_codebook_payload(packet.payload);
    if (!codebook) return tl::unexpected(codebook.error());
    if (!state.reference || state.reference->number != packet.reference) return {};
    auto& history = state.bones;
    (codebook->purpose == codebook_for_geometry ? history.geometry_codebook : history.colour_codebook) =
        std::move(*codebook);
    return {};
}

MeshCounts counts(const LatticeMesh& mesh) { return {mesh.positions.size(), mesh.triangles.size()}; }

// How many frames of groups there may be at once while this packet is decoded: those of the group in force, of its own,
// and the mean of two of them.
std::size_t hidden_frames(const DecoderState& state, const Packet& packet) {
    const std::size_t held = state.nodes.group.length;
    if (packet.kind != PacketKind::tracked || state.header->version < grouped_version) return held;
    const auto place = read_group_place(packet.payload);
    return place && place->length > 1 ? held + place->length + 1 : held;
}

// Memory that the decoder holds, including what this frame still has to derive.
std::uint64_t kept_memory(const DecoderState& state, const Packet& packet, const FrameRules& rules, MeshCounts coded) {
    const auto held = state.reference ? counts(state.reference->mesh()) : MeshCounts{};
    std::uint64_t kept = state.reference ? memory_of_reference(held) : 0;
    const bool nodes = state.reference && state.reference->by_nodes;
    // A patch adds to the mesh that it is put on.
    const bool adds = rules.renews && rules.refers_to != RefersTo::nothing;
    if (nodes || adds || rules.refers_to == RefersTo::reference_or_before) kept += memory_of_tracking(held);
    const MeshCounts renewed{coded.vertices + (adds ? held.vertices : 0),
                             coded.triangles + (adds ? held.triangles : 0)};
    if (rules.renews && state.header->node_spacing > 0) kept += memory_of_tracking(renewed);
    if (state.unreferred)
        kept += memory_of_reference(counts(state.unreferred->mesh)) +
                memory_of_detail_vertex * state.unreferred->detail.vertices();
    // What stays of the detail under a patch is as much at most.
    if (state.reference) kept += memory_of_detail_vertex * state.reference->detail.vertices() * (adds ? 2 : 1);
    if (state.header->texture.layout == TextureLayout::charts) {
        kept += memory_of_charts(held);
        if (rules.renews) kept += memory_of_charts(renewed);
        if (state.unreferred) kept += memory_of_charts(counts(state.unreferred->mesh));
    }
    if (state.header->version >= presence_version) {
        kept += memory_of_presence(held);
        if (rules.renews) kept += memory_of_presence(renewed);
    }
    kept += hidden_frames(state, packet) * memory_of_tracked_frame(held);
    return kept;
}

// What decoding a packet that refers to something takes (work_of_frames()).
std::uint64_t work_of(const DecoderState& state, const Packet& packet, const FrameRules& rules) {
    if (rules.refers_to == RefersTo::nothing || !state.reference) return 0;
    const auto& detail = state.reference->detail;
    const auto held = counts(state.reference->mesh());
    const auto levels = std::min<std::size_t>(state.options.detail_levels, detail.levels.size());
    const auto shown =
        levels == 0 ? held : MeshCounts{held.vertices + detail.vertices(), detail.triangles(levels).size()};
    const bool grouped = packet.kind == PacketKind::tracked && state.header->version >= grouped_version;
    const auto place = grouped ? read_group_place(packet.payload) : Result<GroupPlace>();
    // One is shown, even if an earlier packet brought it.
    const auto frames = grouped && place ? std::max<std::size_t>(1, brought_by(place->frame, place->length).size()) : 1;
    return work_of_frames(held, shown, rules.reference_work, frames);
}

// The payload of a frame, once its header shows that this decoder may decode it.
Result<FramePayloadView> read_frame(DecoderState& state, const Packet& packet, const FrameRules& rules) {
    if (!state.header) return fail(ErrorKind::corrupt_stream, "a frame came before any sequence header");
    // A run has no header: the frame's counts are those of its reference.
    const bool is_run = rules.is_run && state.header->version >= tracked_run_version;
    auto payload = is_run ? Result<FramePayloadView>() : read_frame_payload(packet.payload);
    if (!payload) return payload;
    const auto& header = payload->header;
    if (rules.codes_mesh && packet.payload.size() < least_payload(header.vertices, header.triangles))
        return fail(ErrorKind::corrupt_stream, "frame " + std::to_string(packet.frame) + " claims " +
                                                   std::to_string(header.vertices) + " vertices and " +
                                                   std::to_string(header.triangles) + " triangles in " +
                                                   std::to_string(packet.payload.size()) + " bytes");
    const MeshCounts coded{header.vertices, header.triangles};
    const bool refers = rules.refers_to != RefersTo::nothing && state.reference;
    const auto reference = refers ? counts(state.reference->mesh()) : MeshCounts{};
    const auto kept = kept_memory(state, packet, rules, coded);
    if (auto ok = check_limits(rules.memory, coded, reference, kept, state.options); !ok)
        return fail(ok.error().kind, "frame " + std::to_string(packet.frame) + ": " + ok.error().message);
    if (auto ok = allow_work(state.received, work_of(state, packet, rules), state.options); !ok)
        return fail(ok.error().kind, "frame " + std::to_string(packet.frame) + ": " + ok.error().message);
    state.spare_memory = state.options.max_memory - kept - memory_of_frame(rules.memory, coded, reference);
    if (rules.refers_to == RefersTo::reference)
        if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    return payload;
}

// A run, which was decoded.
FrameInfo describe(const Packet& packet, FrameType type, const DecoderState& state) {
    auto out = internal::describe(packet, type);
    const auto& captured = state.nodes.newest->state.head.captured;
    out.source_vertices = captured.vertices;
    out.source_triangles = captured.triangles;
    out.bytes = with_overhead(state.nodes.shares, packet);
    if (state.header->version >= grouped_version) {
        const auto place = *read_group_place(packet.payload);
        out.group = static_cast<std::uint8_t>(place.length);
        out.place = static_cast<std::uint8_t>(place.frame);
    }
    return out;
}

// Lends the shown frame. Counts come from the mesh, since with motion-based coding a header counts only what it codes.
FrameView lend(const ShownFrame& shown, const FrameInfo& info) {
    FrameView out;
    out.info = info;
    out.info.vertices = static_cast<std::uint32_t>(shown.positions.size());
    out.info.triangles = static_cast<std::uint32_t>(shown.triangles.size());
    out.topology = shown.topology;
    out.reference_topology = shown.reference_topology;
    out.presence = shown.presence;
    out.mesh = {shown.positions, shown.triangles, shown.colours, shown.normals, shown.texcoords};
    out.pose = &shown.pose;
    return out;
}

// Frees the arrays that only the frame on loan needs, so that there are never two sets of them.
void free_lent(ShownFrame& shown) {
    shown.topology = 0;
    shown.own = {};
}

Result<std::optional<FrameView>> decode_packet(DecoderState& state, const Packet& packet) {
    using Decoded = std::optional<FrameView>;
    free_lent(state.shown);
    state.received.bytes += packet.payload.size() + packet_overhead;
    if (auto ok = check_limits(packet, state.options); !ok) return tl::unexpected(ok.error());
    if (const auto type = frame_type(packet.kind)) {
        const auto& rules = rules_of(*type);
        if (state.header) state.highest_frame = std::max(state.highest_frame.value_or(0), packet.frame);
        const auto payload = read_frame(state, packet, rules);
        if (!payload) return tl::unexpected(payload.error());
        if (auto ok = frame_decoders[static_cast<std::size_t>(*type)](state, packet, *payload); !ok)
            return tl::unexpected(ok.error());
        if (!stands_alone(*type)) state.unreferred.reset();
        auto info = rules.is_run ? describe(packet, *type, state) : internal::describe(packet, *type, *payload);
        info.sequence = state.sequences - 1;
        return Decoded{lend(state.shown, info)};
    }
    Result<void> applied;
    if (packet.kind == PacketKind::sequence) applied = apply_header(state, packet);
    if (packet.kind == PacketKind::codebook) applied = apply_codebook(state, packet);
    if (!applied) return tl::unexpected(applied.error());
    return Decoded{};  // skip what this version does not know
}

tl::unexpected<Error> out_of_memory_at(const Packet& packet) {
    return within_memory(
        [&] { return fail(ErrorKind::limit, "out of memory at frame " + std::to_string(packet.frame)); });
}

}  // namespace

DecodedFrame copy_of(const FrameView& frame) {
    return {
        frame.info,          frame.topology, frame.reference_topology, {frame.presence.begin(), frame.presence.end()},
        copy_of(frame.mesh), *frame.pose,    frame.concealed};
}

Decoder::Decoder(const DecoderOptions& options) : state_(std::make_unique<State>()) {
    state_->options = options;
    state_->pool = ThreadPool(options.threads, options.runner);
    state_->threads = state_->pool.threads();
}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<std::optional<FrameView>> Decoder::decode(const Packet& packet) {
    return within_memory([&] { return decode_packet(*state_, packet); }, [&] { return out_of_memory_at(packet); });
}

Result<std::optional<DecodedFrame>> Decoder::decode_copy(const Packet& packet) {
    const auto copied = [&]() -> Result<std::optional<DecodedFrame>> {
        const auto frame = decode_packet(*state_, packet);
        if (!frame) return tl::unexpected(frame.error());
        return *frame ? std::optional(copy_of(**frame)) : std::nullopt;
    };
    return within_memory(copied, [&] { return out_of_memory_at(packet); });
}

std::optional<FrameView> Decoder::conceal(std::uint32_t frame, std::int64_t timestamp_us) {
    const auto shown = [&]() -> std::optional<FrameView> {
        auto& state = *state_;
        free_lent(state.shown);
        if (!show_unreferred_intra(state) && !show_hidden(state, frame) && !show_last_tracked(state) &&
            !show_moved_by_bones(state))
            return std::nullopt;
        FrameInfo info;
        info.sequence = state.sequences - 1;
        info.type = FrameType::predicted;
        info.frame = frame;
        info.reference = state.unreferred ? state.unreferred->frame : state.reference->number;
        info.timestamp_us = timestamp_us;
        auto out = lend(state.shown, info);
        out.concealed = true;
        return out;
    };
    return within_memory(shown, [] { return std::nullopt; });
}

std::optional<DecodedFrame> Decoder::conceal_copy(std::uint32_t frame, std::int64_t timestamp_us) {
    const auto copied = [&]() -> std::optional<DecodedFrame> {
        const auto lent = conceal(frame, timestamp_us);
        return lent ? std::optional(copy_of(*lent)) : std::nullopt;
    };
    return within_memory(copied, [] { return std::nullopt; });
}

void Decoder::prepare() {
    const auto derived = [&] {
        auto& state = *state_;
        state.prepares = true;
        // What stands in the way is said by the frame that needs it.
        if (state.reference && state.header->node_spacing > 0)
            (void)derive_nodes(*state.reference, *state.header, state.threads);
        return true;
    };
    (void)within_memory(derived, [] { return false; });
}

void Decoder::set_detail_levels(std::uint32_t levels) {
    auto& state = *state_;
    if (levels == state.options.detail_levels) return;
    state.options.detail_levels = levels;
    if (state.reference && !state.reference->detail.empty()) state.reference_topology = new_topology(state);
}

const std::optional<SequenceInfo>& Decoder::sequence() const { return state_->info; }

}  // namespace htvm
