// The decoder part of the C interface, on top of htvm::Decoder.
#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "c_api/c_mesh.h"
#include "c_api/c_status.h"
#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"
#include "htvm/stream_index.hpp"

static_assert(HTVM_UP_UNKNOWN == static_cast<int>(htvm::UpAxis::unknown) &&
              HTVM_UP_MINUS_Z == static_cast<int>(htvm::UpAxis::minus_z));
static_assert(HTVM_TEXTURE_NONE == static_cast<int>(htvm::TextureLayout::none) &&
              HTVM_TEXTURE_CAPTURED == static_cast<int>(htvm::TextureLayout::captured) &&
              HTVM_TEXTURE_CHARTS == static_cast<int>(htvm::TextureLayout::charts) &&
              HTVM_TEXTURE_PROJECTION == static_cast<int>(htvm::TextureLayout::projection));

using htvm::c_api::check_struct;
using htvm::c_api::guarded;
using htvm::c_api::LastError;

struct htvm_decoder {
    enum class Sent { nothing, packets, bytes };

    htvm_allocator allocator;
    std::size_t max_packet_bytes;
    htvm::Decoder decoder;
    htvm::PacketReader reader;               // for what is sent as bytes
    std::optional<htvm::Packet> packet;      // sent as a packet, not yet received
    std::optional<htvm::FrameView> current;  // on loan from the decoder
    LastError error;
    std::uint64_t damaged_before = 0;  // by readers that were discarded, in bytes
    Sent sent = Sent::nothing;

    htvm_decoder(const htvm_allocator& memory, const htvm::DecoderOptions& options)
        : allocator(memory),
          max_packet_bytes(static_cast<std::size_t>(
              std::min<std::uint64_t>(options.max_packet_bytes, std::numeric_limits<std::size_t>::max() / 2))),
          decoder(options),
          reader(max_packet_bytes) {}
};

namespace {

htvm_decoder_options default_options() {
    const htvm::DecoderOptions cpp;
    htvm_decoder_options out{};
    out.struct_size = sizeof out;
    out.threads = cpp.threads;
    out.max_vertices = cpp.max_vertices;
    out.max_triangles = cpp.max_triangles;
    out.max_joints = cpp.max_joints;
    out.max_bones = cpp.max_bones;
    out.max_packet_bytes = cpp.max_packet_bytes;
    out.max_memory = cpp.max_memory;
    out.detail_levels = cpp.detail_levels;
    return out;
}

htvm::DecoderOptions cpp_options(const htvm_decoder_options& options) {
    htvm::DecoderOptions out;
    out.threads = options.threads;
    out.runner = htvm::c_api::task_runner(options.run_tasks, options.run_tasks_user);
    out.max_vertices = options.max_vertices;
    out.max_triangles = options.max_triangles;
    out.max_joints = options.max_joints;
    out.max_bones = options.max_bones;
    out.max_packet_bytes = options.max_packet_bytes;
    out.max_memory = options.max_memory;
    out.detail_levels = options.detail_levels;
    return out;
}

htvm_status no_frame(LastError& error) {
    return error.set(HTVM_BAD_INPUT, "there is no current frame: receive one first");
}

htvm_status describe_current(htvm_decoder& decoder, htvm_frame_info* info, std::size_t info_size) {
    const auto& frame = *decoder.current;
    auto out = htvm::c_api::describe(frame.info, htvm::c_api::attributes_of(frame.mesh));
    const auto& sequence = decoder.decoder.sequence();
    if ((out.attributes & HTVM_TEXCOORDS) != 0 && sequence &&
        sequence->texture.layout == htvm::TextureLayout::projection)
        out.attributes |= HTVM_MOVING_TEXCOORDS;
    out.joints = static_cast<std::uint32_t>(frame.pose->joints.size());
    out.bones = static_cast<std::uint32_t>(frame.pose->orientations.size());
    out.topology = frame.topology;
    out.reference_topology = frame.reference_topology;
    out.absent = static_cast<std::uint32_t>(std::count(frame.presence.begin(), frame.presence.end(), 0));
    out.concealed = frame.concealed;
    if (!info) return HTVM_OK;
    const auto written = htvm::c_api::write_struct(out, info, info_size);
    return written == HTVM_OK ? HTVM_OK : decoder.error.set(written, "info_size is not sizeof(htvm_frame_info)");
}

void discard(htvm_decoder& decoder) {
    decoder.packet.reset();
    decoder.damaged_before += decoder.reader.damaged_bytes();
    decoder.reader = htvm::PacketReader(decoder.max_packet_bytes);
}

// The next packet to decode, or nothing.
std::optional<htvm::Packet> next_packet(htvm_decoder& decoder) {
    if (decoder.sent == htvm_decoder::Sent::bytes) return decoder.reader.pull();
    return std::exchange(decoder.packet, std::nullopt);
}

// Copies elements of N numbers each to the caller's array.
template <class Element>
htvm_status copy(LastError& error, std::span<const Element> elements, const std::string& name,
                 typename Element::value_type* out, std::size_t capacity) {
    const std::size_t count = elements.size() * std::tuple_size_v<Element>;
    if (capacity < count)
        return error.set(
            HTVM_BUFFER_TOO_SMALL,
            (name + " need room for " + std::to_string(count) + " numbers, not " + std::to_string(capacity)).c_str());
    if (count == 0) return HTVM_OK;
    if (!out) return error.set(HTVM_BAD_INPUT, ("the array for the " + name + " is NULL").c_str());
    std::memcpy(out, elements.data(), count * sizeof(typename Element::value_type));
    return HTVM_OK;
}

// The same for an attribute of the current frame's vertices, which the frame may not have.
template <class Element>
htvm_status copy_attribute(htvm_decoder* decoder, std::span<const Element> htvm::MeshView::*attribute, const char* name,
                           typename Element::value_type* out, std::size_t capacity) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        if (!decoder->current) return no_frame(decoder->error);
        const auto& mesh = decoder->current->mesh;
        const auto& elements = mesh.*attribute;
        if (elements.size() != mesh.positions.size())
            return decoder->error.set(HTVM_BAD_INPUT, (std::string("the frame has no ") + name).c_str());
        return copy(decoder->error, elements, name, out, capacity);
    });
}

template <class Element>
htvm_status copy_pose(htvm_decoder* decoder, std::vector<Element> htvm::Pose::*part, const char* name, double* out,
                      std::size_t capacity) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        if (!decoder->current) return no_frame(decoder->error);
        return copy(decoder->error, std::span<const Element>(decoder->current->pose->*part), name, out, capacity);
    });
}

// The entries of an index of either kind; of the one in front, as if its packet began the stream.
htvm::Result<std::vector<htvm_index_entry>> index_of(const htvm::Packet& packet, std::size_t size) {
    std::vector<htvm_index_entry> out;
    if (packet.kind == htvm::PacketKind::index) {
        const auto entries = htvm::internal::read_sequence_index(packet.payload);
        if (!entries) return tl::unexpected(entries.error());
        for (const auto& entry : *entries) out.push_back({entry.timestamp_us, entry.offset, entry.frame, 0, 0, 0});
        return out;
    }
    const auto front = htvm::read_index(packet);
    if (!front) return tl::unexpected(front.error());
    for (const auto& point : front->points)
        out.push_back({point.timestamp_us, size + point.offset, static_cast<std::uint32_t>(point.frame), point.back,
                       point.flags, 0});
    return out;
}

// Refuses to mix the two ways of sending.
htvm_status check_sent(htvm_decoder& decoder, htvm_decoder::Sent way) {
    if (decoder.sent != htvm_decoder::Sent::nothing && decoder.sent != way)
        return decoder.error.set(HTVM_BAD_INPUT, "this decoder is sent packets and bytes: use one or the other");
    decoder.sent = way;
    return HTVM_OK;
}

}  // namespace

htvm_status htvm_decoder_options_init(htvm_decoder_options* options, size_t struct_size) {
    return htvm::c_api::init_struct(default_options(), options, struct_size);
}

htvm_status htvm_decoder_create(const htvm_decoder_options* options, htvm_decoder** decoder) {
    if (!decoder) return HTVM_BAD_INPUT;
    *decoder = nullptr;
    LastError error;  // there is no handle yet that could keep the message
    return guarded(error, [&] {
        auto all = default_options();
        if (options) {
            const auto read = check_struct(error, htvm::c_api::read_struct(options, all), "htvm_decoder_options");
            if (read != HTVM_OK) return read;
        }
        if (!htvm::c_api::complete(all.allocator)) return htvm_status{HTVM_BAD_INPUT};
        *decoder = htvm::c_api::make_handle<htvm_decoder>(all.allocator, all.allocator, cpp_options(all));
        return *decoder ? htvm_status{HTVM_OK} : htvm_status{HTVM_OUT_OF_MEMORY};
    });
}

void htvm_decoder_destroy(htvm_decoder* decoder) {
    if (decoder) htvm::c_api::destroy_handle(decoder, decoder->allocator);
}

const char* htvm_decoder_last_error(const htvm_decoder* decoder) { return decoder ? decoder->error.text.data() : ""; }

htvm_status htvm_decoder_send_packet(htvm_decoder* decoder, const uint8_t* packet, size_t size) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        auto& error = decoder->error;
        if (!packet) return error.set(HTVM_BAD_INPUT, "the packet is NULL");
        if (const auto ok = check_sent(*decoder, htvm_decoder::Sent::packets); ok != HTVM_OK) return ok;
        if (decoder->packet) return htvm_status{HTVM_AGAIN};
        htvm::PacketReader one(decoder->max_packet_bytes);
        one.push({packet, size});
        auto whole = one.pull();
        if (!whole || one.damaged_bytes() > 0 || one.pending_bytes() > 0)
            return error.set(HTVM_CORRUPT_STREAM,
                             "what was sent is not exactly one undamaged packet of an accepted size");
        decoder->packet = std::move(whole);
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_decoder_send_bytes(htvm_decoder* decoder, const uint8_t* bytes, size_t size) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        if (!bytes && size > 0) return decoder->error.set(HTVM_BAD_INPUT, "the bytes are NULL");
        if (const auto ok = check_sent(*decoder, htvm_decoder::Sent::bytes); ok != HTVM_OK) return ok;
        if (size > 0) decoder->reader.push({bytes, size});
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_decoder_receive_frame(htvm_decoder* decoder, htvm_frame_info* info, size_t info_size) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto status = guarded(decoder->error, [&] {
        decoder->current.reset();
        while (const auto packet = next_packet(*decoder)) {
            auto frame = decoder->decoder.decode(*packet);
            if (!frame) return decoder->error.set(frame.error());
            if (!*frame) continue;
            decoder->current = *frame;
            return describe_current(*decoder, info, info_size);
        }
        return htvm_status{HTVM_AGAIN};
    });
    // Without this the same bytes would be read again and again, and a caller who loops until HTVM_AGAIN would never
    // get there.
    if (status == HTVM_OUT_OF_MEMORY) discard(*decoder);
    return status;
}

htvm_status htvm_decoder_conceal(htvm_decoder* decoder, uint32_t frame, int64_t timestamp_us, htvm_frame_info* info,
                                 size_t info_size) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        decoder->current = decoder->decoder.conceal(frame, timestamp_us);
        return decoder->current ? describe_current(*decoder, info, info_size) : htvm_status{HTVM_AGAIN};
    });
}

htvm_status htvm_decoder_prepare(htvm_decoder* decoder) {
    if (!decoder) return HTVM_BAD_INPUT;
    decoder->decoder.prepare();
    return HTVM_OK;
}

htvm_status htvm_decoder_set_detail_levels(htvm_decoder* decoder, uint32_t levels) {
    if (!decoder) return HTVM_BAD_INPUT;
    decoder->decoder.set_detail_levels(levels);
    return HTVM_OK;
}

htvm_status htvm_decoder_discard(htvm_decoder* decoder) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        discard(*decoder);
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_decoder_unused_bytes(const htvm_decoder* decoder, uint64_t* damaged, uint64_t* pending) {
    if (!decoder) return HTVM_BAD_INPUT;
    if (damaged) *damaged = decoder->damaged_before + decoder->reader.damaged_bytes();
    if (pending) *pending = decoder->reader.pending_bytes();
    return HTVM_OK;
}

htvm_status htvm_decoder_view(htvm_decoder* decoder, htvm_mesh_view* view, size_t view_size) {
    if (!decoder) return HTVM_BAD_INPUT;
    if (!decoder->current) return no_frame(decoder->error);
    auto out = htvm::c_api::lent(decoder->current->mesh, decoder->current->topology);
    const auto& presence = decoder->current->presence;
    if (!presence.empty()) out.presence = presence.data();
    const auto written = htvm::c_api::write_struct(out, view, view_size);
    return written == HTVM_OK ? HTVM_OK : decoder->error.set(written, "view is NULL or view_size not its sizeof");
}

htvm_status htvm_decoder_copy_positions(htvm_decoder* decoder, float* positions, size_t capacity) {
    return copy_attribute(decoder, &htvm::MeshView::positions, "positions", positions, capacity);
}

htvm_status htvm_decoder_copy_colours(htvm_decoder* decoder, uint8_t* rgb, size_t capacity) {
    return copy_attribute(decoder, &htvm::MeshView::colours, "colours", rgb, capacity);
}

htvm_status htvm_decoder_copy_normals(htvm_decoder* decoder, float* normals, size_t capacity) {
    return copy_attribute(decoder, &htvm::MeshView::normals, "normals", normals, capacity);
}

htvm_status htvm_decoder_copy_texcoords(htvm_decoder* decoder, float* texcoords, size_t capacity) {
    return copy_attribute(decoder, &htvm::MeshView::texcoords, "texcoords", texcoords, capacity);
}

htvm_status htvm_decoder_copy_triangles(htvm_decoder* decoder, uint32_t* indices, size_t capacity) {
    if (!decoder) return HTVM_BAD_INPUT;
    return guarded(decoder->error, [&] {
        if (!decoder->current) return no_frame(decoder->error);
        return copy(decoder->error, decoder->current->mesh.triangles, "triangles", indices, capacity);
    });
}

htvm_status htvm_decoder_copy_joints(htvm_decoder* decoder, double* joints, size_t capacity) {
    return copy_pose(decoder, &htvm::Pose::joints, "joints", joints, capacity);
}

htvm_status htvm_decoder_copy_orientations(htvm_decoder* decoder, double* rotations, size_t capacity) {
    return copy_pose(decoder, &htvm::Pose::orientations, "orientations", rotations, capacity);
}

htvm_status htvm_decoder_sequence(htvm_decoder* decoder, htvm_sequence_info* info, size_t info_size) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto& sequence = decoder->decoder.sequence();
    if (!sequence) return HTVM_AGAIN;
    htvm_sequence_info out{};
    out.joints = static_cast<std::uint32_t>(sequence->skeleton.joint_names.size());
    out.bones = static_cast<std::uint32_t>(sequence->skeleton.bones.size());
    out.skeleton_tracked = sequence->has_skeleton;
    out.fps_numerator = sequence->fps_numerator;
    out.fps_denominator = sequence->fps_denominator;
    out.unit_micrometres = sequence->unit_micrometres;
    out.nearest_vertices = static_cast<std::uint32_t>(sequence->nearest_vertices);
    out.lattice_step = sequence->lattice_step;
    out.session = sequence->session;
    out.sequence = sequence->ordinal;
    out.stream_version = sequence->version;
    out.up = static_cast<std::uint32_t>(sequence->up);
    out.floor_known = sequence->floor.has_value();
    out.floor = sequence->floor.value_or(0);
    out.metadata = static_cast<std::uint32_t>(sequence->metadata.size());
    out.texture_layout = static_cast<std::uint32_t>(sequence->texture.layout);
    out.texture_width = static_cast<std::uint32_t>(sequence->texture.width);
    out.texture_height = static_cast<std::uint32_t>(sequence->texture.height);
    const auto written = htvm::c_api::write_struct(out, info, info_size);
    return written == HTVM_OK ? HTVM_OK : decoder->error.set(written, "info is NULL or info_size not its sizeof");
}

htvm_status htvm_decoder_joint_name(htvm_decoder* decoder, uint32_t joint, char* name, size_t capacity) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto& sequence = decoder->decoder.sequence();
    if (!sequence) return HTVM_AGAIN;
    const auto& names = sequence->skeleton.joint_names;
    if (joint >= names.size() || !name) return decoder->error.set(HTVM_BAD_INPUT, "no such joint, or name is NULL");
    if (capacity < names[joint].size() + 1)
        return decoder->error.set(HTVM_BUFFER_TOO_SMALL, "the joint's name is longer than its array");
    std::memcpy(name, names[joint].c_str(), names[joint].size() + 1);
    return HTVM_OK;
}

htvm_status htvm_decoder_metadata(htvm_decoder* decoder, uint32_t entry, char* key, size_t key_capacity, char* value,
                                  size_t value_capacity) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto& sequence = decoder->decoder.sequence();
    if (!sequence) return HTVM_AGAIN;
    if (entry >= sequence->metadata.size() || !key || !value)
        return decoder->error.set(HTVM_BAD_INPUT, "no such entry, or key or value is NULL");
    const auto& texts = sequence->metadata[entry];
    if (key_capacity <= texts.key.size() || value_capacity <= texts.value.size())
        return decoder->error.set(HTVM_BUFFER_TOO_SMALL, "the key or the value is longer than its array");
    std::memcpy(key, texts.key.c_str(), texts.key.size() + 1);
    std::memcpy(value, texts.value.c_str(), texts.value.size() + 1);
    return HTVM_OK;
}

htvm_status htvm_decoder_global_shift(htvm_decoder* decoder, int64_t* shift) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto& sequence = decoder->decoder.sequence();
    if (!sequence) return HTVM_AGAIN;
    if (!shift) return decoder->error.set(HTVM_BAD_INPUT, "shift is NULL");
    std::copy_n(sequence->global_shift.begin(), 3, shift);
    return HTVM_OK;
}

htvm_status htvm_decoder_bone(htvm_decoder* decoder, uint32_t bone, uint32_t* first, uint32_t* second, double* radius) {
    if (!decoder) return HTVM_BAD_INPUT;
    const auto& sequence = decoder->decoder.sequence();
    if (!sequence) return HTVM_AGAIN;
    if (bone >= sequence->skeleton.bones.size()) return decoder->error.set(HTVM_BAD_INPUT, "there is no such bone");
    if (first) *first = sequence->skeleton.bones[bone].first;
    if (second) *second = sequence->skeleton.bones[bone].second;
    if (radius) *radius = sequence->radii[bone];
    return HTVM_OK;
}

htvm_status htvm_decoder_layer_bytes(htvm_decoder* decoder, uint64_t* bytes, size_t capacity) {
    static_assert(HTVM_LAYERS == htvm::layer_count);
    if (!decoder) return HTVM_BAD_INPUT;
    if (!decoder->current) return no_frame(decoder->error);
    if (!bytes) return decoder->error.set(HTVM_BAD_INPUT, "bytes is NULL");
    if (capacity < HTVM_LAYERS) return decoder->error.set(HTVM_BUFFER_TOO_SMALL, "capacity is below HTVM_LAYERS");
    const auto& taken = decoder->current->info.bytes;
    std::copy(taken.of_layer.begin(), taken.of_layer.end(), bytes);
    bytes[0] = taken.overhead;
    return HTVM_OK;
}

const char* htvm_layer_name(uint32_t layer) {
    if (layer == 0) return "overhead";
    const auto* found = std::find_if(htvm::frame_layers.begin(), htvm::frame_layers.end(),
                                     [&](const auto& name) { return static_cast<uint32_t>(name.layer) == layer; });
    return found == htvm::frame_layers.end() ? nullptr : found->name;
}

htvm_status htvm_index_read(const uint8_t* packet, size_t size, htvm_index_entry* entries, size_t capacity,
                            size_t* count) {
    if (!packet || !count || (!entries && capacity > 0)) return HTVM_BAD_INPUT;
    *count = 0;
    LastError error;  // there is no handle to keep it in
    return guarded(error, [&] {
        htvm::PacketReader reader;
        reader.push({packet, size});
        const auto whole = reader.pull();
        if (!whole || reader.damaged_bytes() > 0 || reader.pending_bytes() > 0) return htvm_status{HTVM_CORRUPT_STREAM};
        const auto index = index_of(*whole, size);
        if (!index) return error.set(index.error());
        *count = index->size();
        if (capacity < index->size()) return htvm_status{HTVM_BUFFER_TOO_SMALL};
        std::copy(index->begin(), index->end(), entries);
        return htvm_status{HTVM_OK};
    });
}
