// The encoder part of the C interface, on top of htvm::Encoder.
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "c_api/c_mesh.h"
#include "c_api/c_status.h"
#include "htvm/encoder.hpp"
#include "htvm/option_list.hpp"
#include "htvm/stream_index.hpp"

using htvm::c_api::check_struct;
using htvm::c_api::elements;
using htvm::c_api::guarded;
using htvm::c_api::LastError;
using htvm::c_api::read_mesh;
using htvm::c_api::read_struct;

struct htvm_encoder {
    htvm_allocator allocator;
    std::size_t joints, bones;  // of the skeleton
    htvm::Encoder encoder;
    std::vector<std::uint8_t> packet;  // pulled but not yet received; empty: none
    std::uint32_t attributes = 0;      // of the last frame
    htvm::StreamIndexer indexer;       // of the packets pulled, but for the index at the end
    std::uint64_t indexed_bytes = 0;
    bool any_frame = false, finished = false;
    bool ended = false;  // finished, and all packets were received
    LastError error;

    htvm_encoder(const htvm_allocator& memory, const htvm::Skeleton& skeleton, htvm::Encoder&& made)
        : allocator(memory),
          joints(skeleton.joint_names.size()),
          bones(skeleton.bones.size()),
          encoder(std::move(made)) {}
};

struct htvm_encoder_options {
    htvm_allocator allocator;
    htvm::EncoderOptions options;
    LastError error;

    htvm_encoder_options(const htvm_allocator& memory, htvm::Profile profile)
        : allocator(memory), options(htvm::default_options(profile)) {}
};

namespace {

constexpr auto number_of_profiles = std::uint32_t{HTVM_PROFILE_PAPER} + 1;
static_assert(HTVM_PROFILE_TRACKED == static_cast<int>(htvm::Profile::tracked) &&
              HTVM_PROFILE_TOPOLOGY == static_cast<int>(htvm::Profile::topology) &&
              HTVM_PROFILE_PAPER == static_cast<int>(htvm::Profile::paper));
static_assert(HTVM_OPTION_NUMBER == static_cast<int>(htvm::OptionKind::number) &&
              HTVM_OPTION_WHOLE_NUMBER == static_cast<int>(htvm::OptionKind::whole_number) &&
              HTVM_OPTION_SWITCH == static_cast<int>(htvm::OptionKind::on_or_off) &&
              HTVM_OPTION_WORD == static_cast<int>(htvm::OptionKind::word));

// The value is text or a number.
template <class Value>
htvm_status set_option(htvm_encoder_options* options, const char* name, Value value) {
    if (!options) return HTVM_BAD_INPUT;
    return guarded(options->error, [&] {
        if (!name) return options->error.set(HTVM_BAD_INPUT, "the option's name is NULL");
        const auto set = htvm::set_option(options->options, name, value);
        return set ? htvm_status{HTVM_OK} : options->error.set(set.error());
    });
}

// Calls take() with the option and its value, and returns its status.
template <class Take>
htvm_status get_option(htvm_encoder_options* options, const char* name, const Take& take) {
    if (!options) return HTVM_BAD_INPUT;
    return guarded(options->error, [&] {
        if (!name) return options->error.set(HTVM_BAD_INPUT, "the option's name is NULL");
        const auto* option = htvm::find_option(name);
        if (!option) return options->error.set(htvm::no_such_option(name));
        return take(*option, option->get(options->options));
    });
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

htvm_status read_pose(htvm_encoder& encoder, const htvm_pose& given, htvm::Pose& out) {
    htvm_pose pose{};
    const auto read = check_struct(encoder.error, read_struct(&given, pose), "htvm_pose");
    if (read != HTVM_OK) return read;
    if (encoder.joints > 0 && !pose.joints) return encoder.error.set(HTVM_BAD_INPUT, "htvm_pose.joints is NULL");
    out.joints = elements<htvm::Vector3d>(pose.joints, encoder.joints);
    out.orientations = elements<htvm::Rotation>(pose.orientations, encoder.bones);
    for (std::size_t j = 0; pose.tracked && j < encoder.joints; ++j) out.found.push_back(pose.tracked[j] != 0);
    return HTVM_OK;
}

// The next packet's bytes; empty if there is none.
std::vector<std::uint8_t> pull(htvm_encoder& encoder) {
    const auto packet = encoder.encoder.pull();
    if (!packet) return {};
    auto bytes = htvm::write_packet(*packet);
    if (packet->kind != htvm::PacketKind::index) {
        encoder.indexer.add(*packet, encoder.indexed_bytes);
        encoder.indexed_bytes += bytes.size();
    }
    return bytes;
}

htvm_status give_packet(LastError& error, const std::vector<std::uint8_t>& packet, std::uint8_t* buffer,
                        std::size_t capacity, std::size_t* size) {
    *size = packet.size();
    if (capacity < *size)
        return error.set(HTVM_BUFFER_TOO_SMALL, ("the packet has " + std::to_string(*size) + " bytes").c_str());
    if (!buffer) return error.set(HTVM_BAD_INPUT, "the buffer is NULL");
    std::memcpy(buffer, packet.data(), *size);
    return HTVM_OK;
}

htvm_status create(LastError& error, const htvm_encoder_options& options, htvm_encoder** encoder) {
    auto made = htvm::Encoder::create(options.options);
    if (!made) return error.set(made.error());
    *encoder = htvm::c_api::make_handle<htvm_encoder>(options.allocator, options.allocator, options.options.skeleton,
                                                      std::move(*made));
    return *encoder ? htvm_status{HTVM_OK} : error.set(HTVM_OUT_OF_MEMORY, "there is no memory for an encoder");
}

htvm_status create_with_defaults(LastError& error, htvm_encoder** encoder) {
    htvm_allocator memory{};
    htvm::c_api::complete(memory);
    return create(error, htvm_encoder_options(memory, htvm::Profile::tracked), encoder);
}

}  // namespace

htvm_status htvm_encoder_options_create(uint32_t profile, const htvm_allocator* allocator,
                                        htvm_encoder_options** options) {
    if (!options) return HTVM_BAD_INPUT;
    *options = nullptr;
    htvm_allocator memory = allocator ? *allocator : htvm_allocator{};
    if (profile >= number_of_profiles || !htvm::c_api::complete(memory)) return HTVM_BAD_INPUT;
    LastError unused;  // there is no handle yet that could keep the message
    return guarded(unused, [&] {
        *options = htvm::c_api::make_handle<htvm_encoder_options>(memory, memory, static_cast<htvm::Profile>(profile));
        return htvm_status{*options ? HTVM_OK : HTVM_OUT_OF_MEMORY};
    });
}

void htvm_encoder_options_destroy(htvm_encoder_options* options) {
    if (options) htvm::c_api::destroy_handle(options, options->allocator);
}

const char* htvm_encoder_options_last_error(const htvm_encoder_options* options) {
    return options ? options->error.text.data() : "";
}

htvm_status htvm_encoder_options_set(htvm_encoder_options* options, const char* name, const char* value) {
    if (options && !value) return options->error.set(HTVM_BAD_INPUT, "the option's value is NULL");
    return set_option(options, name, std::string_view(value ? value : ""));
}

htvm_status htvm_encoder_options_set_number(htvm_encoder_options* options, const char* name, double value) {
    return set_option(options, name, value);
}

htvm_status htvm_encoder_options_get(htvm_encoder_options* options, const char* name, char* value, size_t capacity) {
    return get_option(options, name, [&](const htvm::Option& option, double number) {
        const auto text = htvm::value_text(option, number);
        if (capacity <= text.size()) return options->error.set(HTVM_BUFFER_TOO_SMALL, "the value is longer");
        if (!value) return options->error.set(HTVM_BAD_INPUT, "the array for the value is NULL");
        std::memcpy(value, text.c_str(), text.size() + 1);
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_options_get_number(htvm_encoder_options* options, const char* name, double* value) {
    return get_option(options, name, [&](const htvm::Option&, double number) {
        if (!value) return options->error.set(HTVM_BAD_INPUT, "the place for the value is NULL");
        *value = number;
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_options_set_skeleton(htvm_encoder_options* options, const htvm_skeleton* skeleton) {
    if (!options) return HTVM_BAD_INPUT;
    return guarded(options->error, [&] {
        htvm::EncoderOptions read;
        if (skeleton)
            if (const auto status = read_skeleton(options->error, *skeleton, read); status != HTVM_OK) return status;
        options->options.skeleton = std::move(read.skeleton);
        options->options.radii = std::move(read.radii);
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_options_add_metadata(htvm_encoder_options* options, const char* key, const char* value) {
    if (!options) return HTVM_BAD_INPUT;
    return guarded(options->error, [&] {
        if (!key || !value) return options->error.set(HTVM_BAD_INPUT, "the key or the value is NULL");
        options->options.metadata.push_back({key, value});
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_options_set_floor(htvm_encoder_options* options, double floor) {
    if (!options) return HTVM_BAD_INPUT;
    options->options.floor = floor;
    return HTVM_OK;
}

htvm_status htvm_encoder_options_set_global_shift(htvm_encoder_options* options, const int64_t* shift) {
    if (!options) return HTVM_BAD_INPUT;
    if (!shift) return options->error.set(HTVM_BAD_INPUT, "shift is NULL");
    std::copy_n(shift, 3, options->options.global_shift.begin());
    return HTVM_OK;
}

htvm_status htvm_encoder_options_set_run_tasks(htvm_encoder_options* options, htvm_run_tasks run_tasks, void* user) {
    if (!options) return HTVM_BAD_INPUT;
    return guarded(options->error, [&] {
        options->options.runner = htvm::c_api::task_runner(run_tasks, user);
        return htvm_status{HTVM_OK};
    });
}

uint32_t htvm_encoder_option_count() { return static_cast<std::uint32_t>(htvm::option_list().size()); }

htvm_status htvm_encoder_option(uint32_t option, uint32_t profile, htvm_option_info* info, size_t info_size) {
    const auto list = htvm::option_list();
    if (option >= list.size() || profile >= number_of_profiles) return HTVM_BAD_INPUT;
    const auto& row = list[option];
    LastError unused;
    return guarded(unused, [&] {
        const auto asked = static_cast<htvm::Profile>(profile);
        const bool number = row.kind == htvm::OptionKind::number || row.kind == htvm::OptionKind::whole_number;
        htvm_option_info out{};
        out.kind = static_cast<std::uint32_t>(row.kind);
        out.name = row.name;
        out.group = htvm::group_name(row.group);
        out.unit = row.unit;
        out.meaning = row.meaning;
        out.zero = row.zero;
        out.words = static_cast<std::uint32_t>(row.words.size());
        out.least = number ? row.least : 0;
        out.most = number ? row.most : row.words.empty() ? 1 : out.words - 1;
        out.default_value = row.get(htvm::default_options(asked));
        out.serves = htvm::serves(row.group, asked);
        return htvm::c_api::write_struct(out, info, info_size);
    });
}

const char* htvm_encoder_option_word(uint32_t option, uint32_t word) {
    const auto list = htvm::option_list();
    return option < list.size() && word < list[option].words.size() ? list[option].words[word] : nullptr;
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
    LastError error;  // there is no handle yet that could keep the message
    const auto status = guarded(
        error, [&] { return options ? create(error, *options, encoder) : create_with_defaults(error, encoder); });
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
        if (const auto bounds = encoder->encoder.bounds()) encoder->indexer.add(*bounds);
        encoder->any_frame = encoder->any_frame || !encoder->encoder.coded_frames().empty();
        encoder->attributes = htvm::c_api::attributes_of(htvm::view_of(cpp_mesh));
        return htvm_status{HTVM_OK};
    });
}

htvm_status htvm_encoder_set_bitrate(htvm_encoder* encoder, double bits_per_second) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        const auto set = encoder->encoder.set_bitrate(bits_per_second);
        return set ? htvm_status{HTVM_OK} : encoder->error.set(set.error());
    });
}

htvm_status htvm_encoder_set_effort(htvm_encoder* encoder, uint32_t effort) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        const auto set = encoder->encoder.set_effort(effort > 9 ? 10 : static_cast<int>(effort));
        return set ? htvm_status{HTVM_OK} : encoder->error.set(set.error());
    });
}

htvm_status htvm_encoder_set_repair(htvm_encoder* encoder, htvm_may_repair may_repair, void* user) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        std::function<bool()> asks;
        if (may_repair) asks = [may_repair, user] { return may_repair(user) != 0; };
        const auto set = encoder->encoder.set_repair(std::move(asks));
        return set ? htvm_status{HTVM_OK} : encoder->error.set(set.error());
    });
}

htvm_status htvm_encoder_finish(htvm_encoder* encoder) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        if (encoder->finished) return htvm_status{HTVM_OK};
        if (const auto finished = encoder->encoder.finish(); !finished) return encoder->error.set(finished.error());
        if (const auto bounds = encoder->encoder.bounds()) encoder->indexer.add(*bounds);
        encoder->any_frame = encoder->any_frame || !encoder->encoder.coded_frames().empty();
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
        if (encoder->packet.empty()) encoder->packet = pull(*encoder);
        encoder->ended = encoder->finished && encoder->packet.empty();
        if (encoder->packet.empty()) return htvm_status{encoder->finished ? HTVM_END : HTVM_AGAIN};
        const auto given = give_packet(error, encoder->packet, buffer, capacity, size);
        if (given == HTVM_OK) encoder->packet.clear();
        return given;
    });
}

htvm_status htvm_encoder_front_index(htvm_encoder* encoder, uint8_t* buffer, size_t capacity, size_t* size) {
    if (!encoder) return HTVM_BAD_INPUT;
    return guarded(encoder->error, [&] {
        if (!size) return encoder->error.set(HTVM_BAD_INPUT, "size is NULL");
        *size = 0;
        if (!encoder->ended) return htvm_status{HTVM_AGAIN};
        const auto index = encoder->indexer.finish(encoder->indexed_bytes);
        if (index.frames == 0) return htvm_status{HTVM_END};
        return give_packet(encoder->error, htvm::write_packet(htvm::write_index(index)), buffer, capacity, size);
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
