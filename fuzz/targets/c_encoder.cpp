// The encoder's C interface with any meshes, poses and options, by any names, including structs of earlier versions.
// The result must be a status with a message, or packets that the C decoder accepts, frame by frame.
#include <array>
#include <cstring>
#include <limits>
#include <string>

#include "any_capture.h"
#include "htvm/htvm.h"

namespace {

using namespace htvm;
using fuzz::require;

constexpr std::array numbers = {0.0,
                                1.0,
                                2.0,
                                6.0,
                                30.0,
                                255.0,
                                1000.0,
                                -1.0,
                                0.05,
                                1e6,
                                1e30,
                                std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::quiet_NaN()};

// Changes a few options, each to a value that may be far out of range, by a name that may be wrong.
void set_any_options(fuzz::FuzzInput& input, htvm_encoder_options* options, std::uint32_t profile) {
    require(htvm_encoder_options_set_number(options, "geometry_step", 8) == HTVM_OK, "8 mm is a step");
    for (std::uint32_t n = input.below(6); n > 0; --n) {
        htvm_option_info info;
        require(htvm_encoder_option(input.below(htvm_encoder_option_count()), profile, &info, sizeof info) == HTVM_OK,
                "every option of the list can be asked for");
        std::string name = info.name;
        const std::uint8_t how = input.u8();
        if (how > 250) name[input.below(static_cast<std::uint32_t>(name.size()))] = static_cast<char>(input.u8());
        const double value = how % 3 == 0 ? numbers[input.below(numbers.size())] : input.below(4) + how % 2 * 0.5;
        const auto status = how % 8 == 0
                                ? htvm_encoder_options_set(options, name.c_str(), std::to_string(value).c_str())
                                : htvm_encoder_options_set_number(options, name.c_str(), value);
        require(status == HTVM_OK || status == HTVM_BAD_INPUT, "a status that the header names");
        if (status < 0) require(std::strlen(htvm_encoder_options_last_error(options)) > 0, "a failure says why");
        double now = 0;
        if (status == HTVM_OK && how % 8 != 0)
            require(htvm_encoder_options_get_number(options, name.c_str(), &now) == HTVM_OK && now == value,
                    "what was set is read");
        std::array<char, 32> text{};
        if (status == HTVM_OK)
            require(htvm_encoder_options_get(options, name.c_str(), text.data(), text.size()) == HTVM_OK,
                    "32 characters are enough");
    }
    require(htvm_encoder_options_set_number(options, "threads", 1) == HTVM_OK, "one thread");
}

// The mesh's arrays for C. Attributes that do not fit its vertices are left out, since C cannot express them.
htvm_mesh mesh_of(const Mesh& mesh, std::uint8_t age) {
    htvm_mesh out;
    require(htvm_mesh_init(&out, sizeof out) == HTVM_OK, "a mesh is given its defaults");
    if (age > 250) out.struct_size = age - 251u;
    out.vertices = static_cast<std::uint32_t>(mesh.positions.size());
    out.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto fits = [&](const auto& attribute) {
        return attribute.size() == mesh.positions.size() && !attribute.empty();
    };
    if (out.vertices > 0) out.positions = mesh.positions[0].data();
    if (out.triangles > 0) out.indices = mesh.triangles[0].data();
    if (fits(mesh.colours)) out.colours = mesh.colours[0].data();
    if (fits(mesh.normals)) out.normals = mesh.normals[0].data();
    if (fits(mesh.texcoords)) out.texcoords = mesh.texcoords[0].data();
    return out;
}

// Receives all packets there are, each decoded at once: how many frames they show.
std::size_t receive(htvm_encoder* encoder, htvm_decoder* decoder) {
    std::size_t frames = 0;
    for (;;) {
        std::size_t size = 0;
        const auto asked = htvm_encoder_receive_packet(encoder, nullptr, 0, &size);
        if (asked == HTVM_AGAIN || asked == HTVM_END) break;
        require(asked == HTVM_BUFFER_TOO_SMALL && size > 0, "a capacity of 0 asks for the size");
        std::vector<std::uint8_t> packet(size);
        require(htvm_encoder_receive_packet(encoder, packet.data(), size, &size) == HTVM_OK && size == packet.size(),
                "and the packet is of that size");
        require(htvm_decoder_send_packet(decoder, packet.data(), size) == HTVM_OK, "the decoder takes the packet");
        const auto decoded = htvm_decoder_receive_frame(decoder, nullptr, 0);
        if (decoded < 0) std::cerr << htvm_decoder_last_error(decoder) << '\n';
        require(decoded >= 0, "what the encoder sends can be decoded");
        frames += decoded == HTVM_OK;
    }
    return frames;
}

void send(htvm_encoder* encoder, htvm_decoder* decoder, const fuzz::AnyCapture& capture, std::uint8_t age) {
    std::int64_t time = 0;
    // Frames may be held (latency_frames, tracked.group); each error costs one frame, the one sent or one held.
    std::size_t sent = 0, lost = 0, shown = 0;
    const std::size_t joints = capture.skeleton.joint_names.size(), bones = capture.skeleton.bones.size();
    for (const auto& frame : capture.frames) {
        const auto mesh = mesh_of(frame.mesh, age);
        htvm_pose pose;
        require(htvm_pose_init(&pose, sizeof pose) == HTVM_OK, "a pose is given its defaults");
        const bool any_pose = frame.pose && frame.pose->joints.size() == joints && joints > 0;
        if (any_pose) {
            pose.joints = frame.pose->joints[0].data();
            if (frame.pose->orientations.size() == bones && bones > 0)
                pose.orientations = frame.pose->orientations[0].data();
        }
        const auto status =
            htvm_encoder_send_mesh(encoder, &mesh, any_pose ? &pose : nullptr, time += 33333, age % 8 == 7);
        require(status == HTVM_OK || status == HTVM_BAD_INPUT || status == HTVM_LIMIT,
                "a status that the header names");
        if (status < 0) require(std::strlen(htvm_encoder_last_error(encoder)) > 0, "a failure says what was wrong");
        ++sent;
        lost += status < 0;
        shown += receive(encoder, decoder);
        require(shown + lost <= sent, "no frames but of meshes that were sent");
    }
    auto ended = htvm_encoder_finish(encoder);
    for (int held = 0; held < 2 && ended == HTVM_LIMIT; ++held, ++lost) ended = htvm_encoder_finish(encoder);
    require(ended == HTVM_OK, "a sequence can be ended");
    shown += receive(encoder, decoder);
    require(shown + lost == sent, "one frame a mesh");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const std::uint8_t age = input.u8();
    const std::uint32_t profile = age % 3;
    htvm_encoder_options* options = nullptr;
    require(htvm_encoder_options_create(profile, nullptr, &options) == HTVM_OK, "options can be made");
    set_any_options(input, options, profile);
    const auto capture = fuzz::any_capture(input);
    std::vector<std::uint16_t> bone_joints;
    for (const auto& bone : capture.skeleton.bones) bone_joints.insert(bone_joints.end(), {bone.first, bone.second});
    htvm_skeleton skeleton;
    require(htvm_skeleton_init(&skeleton, sizeof skeleton) == HTVM_OK, "a skeleton is given its defaults");
    skeleton.joints = static_cast<std::uint32_t>(capture.skeleton.joint_names.size());
    skeleton.bones = static_cast<std::uint32_t>(capture.skeleton.bones.size());
    skeleton.bone_joints = bone_joints.data();
    if (age == 250) skeleton.struct_size = input.below(sizeof skeleton + 1);
    const auto taken = htvm_encoder_options_set_skeleton(options, &skeleton);
    require(taken == HTVM_OK || taken == HTVM_BAD_INPUT, "a skeleton is taken or refused");
    htvm_encoder* encoder = nullptr;
    std::array<char, 40> words{};
    const auto status = htvm_encoder_create(options, &encoder, words.data(), words.size());
    htvm_encoder_options_destroy(options);
    require((status == HTVM_OK) == (encoder != nullptr), "a handle where there is success");
    require(words.back() == 0, "the sentence is cut where the array ends");
    if (status != HTVM_OK) {
        require(status == HTVM_BAD_INPUT, "a status that the header names");
        require(words[0] != 0, "a failure says what was wrong");
        return 0;
    }
    htvm_decoder_options limits;
    require(htvm_decoder_options_init(&limits, sizeof limits) == HTVM_OK, "options are given their defaults");
    limits.threads = 1;
    htvm_decoder* decoder = nullptr;
    require(htvm_decoder_create(&limits, &decoder) == HTVM_OK, "a decoder can be made");
    send(encoder, decoder, capture, age);
    htvm_encoder_destroy(encoder);
    htvm_decoder_destroy(decoder);
    return 0;
}
