// The C interface's encoder gives the bytes of the C++ one, and survives callers who do as they should not.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "c_api/c_test_streams.h"

namespace htvm {
namespace {

using namespace test;

using Handle = std::unique_ptr<htvm_encoder, decltype(&htvm_encoder_destroy)>;

Handle make_encoder(const htvm_encoder_options* options = nullptr) {
    htvm_encoder* encoder = nullptr;
    char text[200] = "";
    EXPECT_EQ(htvm_encoder_create(options, &encoder, text, sizeof text), HTVM_OK) << text;
    return {encoder, htvm_encoder_destroy};
}

htvm_encoder_options default_options() {
    htvm_encoder_options options;
    EXPECT_EQ(htvm_encoder_options_init(&options, sizeof options), HTVM_OK);
    return options;
}

// The mesh as the C interface takes it; it refers to the mesh's arrays.
htvm_mesh c_mesh(const Mesh& mesh) {
    htvm_mesh out;
    EXPECT_EQ(htvm_mesh_init(&out, sizeof out), HTVM_OK);
    out.vertices = static_cast<std::uint32_t>(mesh.positions.size());
    out.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    if (!mesh.positions.empty()) out.positions = mesh.positions[0].data();
    if (!mesh.triangles.empty()) out.indices = mesh.triangles[0].data();
    if (!mesh.colours.empty()) out.colours = mesh.colours[0].data();
    if (!mesh.normals.empty()) out.normals = mesh.normals[0].data();
    if (!mesh.texcoords.empty()) out.texcoords = mesh.texcoords[0].data();
    return out;
}

htvm_pose c_pose(const Pose& pose) {
    htvm_pose out;
    EXPECT_EQ(htvm_pose_init(&out, sizeof out), HTVM_OK);
    if (!pose.joints.empty()) out.joints = pose.joints[0].data();
    if (!pose.orientations.empty()) out.orientations = pose.orientations[0].data();
    return out;
}

// A skeleton as the C interface takes it, with the arrays that it refers to.
struct CSkeleton {
    Skeleton cpp;  // whose names the C struct points at
    std::vector<std::uint16_t> bones;
    std::vector<const char*> names;
    htvm_skeleton skeleton;

    explicit CSkeleton(Skeleton given) : cpp(std::move(given)) {
        for (const auto& bone : cpp.bones) {
            bones.push_back(bone.first);
            bones.push_back(bone.second);
        }
        for (const auto& name : cpp.joint_names) names.push_back(name.c_str());
        EXPECT_EQ(htvm_skeleton_init(&skeleton, sizeof skeleton), HTVM_OK);
        skeleton.joints = static_cast<std::uint32_t>(names.size());
        skeleton.bones = static_cast<std::uint32_t>(cpp.bones.size());
        skeleton.bone_joints = bones.data();
        skeleton.joint_names = names.data();
    }
};

// Appends the packets that are ready; gives the status that ended it.
htvm_status receive_all(htvm_encoder* encoder, std::vector<std::uint8_t>& out) {
    for (;;) {
        std::size_t size = 0;
        auto status = htvm_encoder_receive_packet(encoder, nullptr, 0, &size);
        if (status != HTVM_BUFFER_TOO_SMALL) return status;
        const std::size_t before = out.size();
        out.resize(before + size);
        status = htvm_encoder_receive_packet(encoder, out.data() + before, size, &size);
        EXPECT_EQ(status, HTVM_OK);
    }
}

std::vector<std::uint8_t> bytes_of(const TestSequence& sequence, htvm_encoder_options options) {
    const CSkeleton skeleton(sequence.skeleton);
    if (!sequence.skeleton.bones.empty()) options.skeleton = &skeleton.skeleton;
    const auto encoder = make_encoder(&options);
    std::vector<std::uint8_t> out;
    std::int64_t time = -40000;
    for (const auto& frame : sequence.frames) {
        const auto mesh = c_mesh(frame.mesh);
        const auto pose = frame.pose ? c_pose(*frame.pose) : htvm_pose{};
        EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, frame.pose ? &pose : nullptr, time += 33333, 0), HTVM_OK)
            << htvm_encoder_last_error(encoder.get());
        EXPECT_EQ(receive_all(encoder.get(), out), HTVM_AGAIN);
    }
    EXPECT_EQ(htvm_encoder_finish(encoder.get()), HTVM_OK);
    EXPECT_EQ(receive_all(encoder.get(), out), HTVM_END);
    return out;
}

TEST(CEncoder, GivesTheBytesOfTheCppEncoder) {
    for (const auto& sequence : {synthetic(true, 4, 300), sequence_of(tfan_test::grid(6, 6), 4, all)})
        EXPECT_EQ(bytes_of(sequence, default_options()), encode(sequence, {}).bytes) << sequence.name;
}

TEST(CEncoder, EveryOptionReachesTheCppEncoder) {
    EncoderOptions cpp = default_options(Profile::topology);
    auto options = default_options();
    cpp.geometry_step = options.geometry_step = 5;
    cpp.colour_step = options.colour_step = 9;
    cpp.lambda = options.lambda = 0.3;
    cpp.key_interval = options.key_interval = 3;
    cpp.least_key_interval = options.least_key_interval = 2;
    cpp.topology.scene_changes = false;
    options.scene_changes = 0;
    cpp.topology.frame_choice = FrameChoice::motion;
    options.frame_choice = HTVM_CHOICE_MOTION;
    cpp.topology.predicted_below = options.predicted_below = 30;
    cpp.topology.intra_above = options.intra_above = 3000;
    cpp.topology.still_below = options.still_below = 20;
    cpp.topology.animation_error = options.animation_error = 6;
    cpp.topology.merge_duplicates = false;
    options.merge_duplicates = 0;
    cpp.topology.nearest_vertices = options.nearest_vertices = 5;
    cpp.topology.reference_vertices = ReferenceVertices::bone;
    options.reference_any = 0;
    cpp.topology.point_to_plane = false;
    options.point_to_plane = 0;
    cpp.topology.weight_width = options.weight_width = 10;
    cpp.lattice_bits = options.lattice_bits = 6;
    cpp.unit_micrometres = options.unit_micrometres = 10000;
    cpp.fps_numerator = options.fps_numerator = 25;
    cpp.fps_denominator = options.fps_denominator = 2;
    cpp.threads = options.threads = 2;
    const auto person = synthetic(true, 6, 300);
    EXPECT_EQ(bytes_of(person, options), encode(person, cpp).bytes);

    cpp = default_options(Profile::topology);
    options = default_options();
    cpp.profile = Profile::tracked;
    options.tracked = 1;
    cpp.tracked.references = TrackedReferences::intra;
    options.tracked_from_intra = 1;
    cpp.tracked.simplify = options.simplify = 0.2;
    cpp.tracked.node_spacing = options.node_spacing = 120;
    EXPECT_EQ(bytes_of(person, options), encode(person, cpp).bytes);

    cpp = default_options(Profile::topology);
    options = default_options();
    cpp.rate.bits_per_second = options.bits_per_second = 4e6;
    cpp.rate.buffer_seconds = options.buffer_seconds = 0.5;
    EXPECT_EQ(bytes_of(person, options), encode(person, cpp).bytes);

    cpp = default_options(Profile::topology);
    options = default_options();
    cpp.rate.target_error = options.target_error = 1.5;
    EXPECT_EQ(bytes_of(person, options), encode(person, cpp).bytes);
}

TEST(CEncoder, RunsItsTasksOnTheCallersThreads) {
    const auto person = synthetic(true, 3, 300);
    auto options = default_options();
    options.threads = 3;
    const auto expected = bytes_of(person, options);
    std::size_t calls = 0;
    options.run_tasks_user = &calls;
    options.run_tasks = [](void* user, size_t tasks, void (*task)(void*, size_t), void* context) {
        ++*static_cast<std::size_t*>(user);
        for (std::size_t t = tasks; t-- > 0;) task(context, t);
    };
    EXPECT_EQ(bytes_of(person, options), expected);
    EXPECT_GT(calls, 0u);
}

TEST(CEncoder, TellsOfTheLastFrame) {
    const auto encoder = make_encoder();
    htvm_frame_info info;
    EXPECT_EQ(htvm_encoder_last_frame(encoder.get(), &info, sizeof info), HTVM_AGAIN);
    const auto frame = sequence_of(tfan_test::grid(5, 5), 1, all).frames[0].mesh;
    const auto mesh = c_mesh(frame);
    ASSERT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, 7, 0), HTVM_OK);
    ASSERT_EQ(htvm_encoder_last_frame(encoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.type, std::uint32_t{HTVM_FRAME_INTRA});
    EXPECT_EQ(info.timestamp_us, 7);
    EXPECT_EQ(info.source_vertices, 25u);
    EXPECT_EQ(info.attributes, std::uint32_t{HTVM_COLOURS | HTVM_NORMALS | HTVM_TEXCOORDS});
    EXPECT_GT(info.bytes, 100u);
    ASSERT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, 8, 1), HTVM_OK);
    ASSERT_EQ(htvm_encoder_last_frame(encoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.type, std::uint32_t{HTVM_FRAME_INTRA}) << "forced";
}

TEST(CEncoder, APacketStaysUntilItsBufferIsLargeEnough) {
    const auto encoder = make_encoder();
    const auto frame = sequence_of(tfan_test::grid(5, 5), 1, none).frames[0].mesh;
    const auto mesh = c_mesh(frame);
    ASSERT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, 0, 0), HTVM_OK);
    std::size_t size = 0, again = 0;
    EXPECT_EQ(htvm_encoder_receive_packet(encoder.get(), nullptr, 0, &size), HTVM_BUFFER_TOO_SMALL);
    std::vector<std::uint8_t> buffer(size, 0xAB);
    EXPECT_EQ(htvm_encoder_receive_packet(encoder.get(), buffer.data(), size - 1, &again), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(again, size);
    EXPECT_EQ(buffer, std::vector<std::uint8_t>(size, 0xAB));
    EXPECT_EQ(htvm_encoder_receive_packet(encoder.get(), nullptr, size, &again), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_receive_packet(encoder.get(), buffer.data(), size, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_receive_packet(encoder.get(), buffer.data(), size, &again), HTVM_OK);
    PacketReader reader;
    reader.push(buffer);
    EXPECT_TRUE(reader.pull().has_value());
}

TEST(CEncoder, WrongOptionsAreToldInASentence) {
    htvm_encoder* encoder = nullptr;
    char text[300] = "";
    const auto told = [&](const htvm_encoder_options& options) {
        text[0] = '\0';
        EXPECT_EQ(htvm_encoder_create(&options, &encoder, text, sizeof text), HTVM_BAD_INPUT);
        EXPECT_EQ(encoder, nullptr);
        return std::strlen(text) > 10;
    };
    auto options = default_options();
    options.geometry_step = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(told(options));
    options = default_options();
    options.nearest_vertices = 65;
    EXPECT_TRUE(told(options));
    options = default_options();
    options.frame_choice = 3;
    EXPECT_TRUE(told(options));
    options = default_options();
    options.allocator.allocate = CountingMemory::allocate;
    EXPECT_TRUE(told(options));
    options = default_options();
    htvm_skeleton skeleton{};
    options.skeleton = &skeleton;
    EXPECT_TRUE(told(options)) << "no htvm_skeleton_init()";
    htvm_skeleton_init(&skeleton, sizeof skeleton);
    skeleton.bones = 1;
    EXPECT_TRUE(told(options)) << "no joints of the bones";
    const std::uint16_t joints[] = {0, 5};
    skeleton.bone_joints = joints;
    EXPECT_TRUE(told(options)) << "joints that are not there";
    skeleton.joints = 0xFFFFFFFF;
    EXPECT_TRUE(told(options));
    options.struct_size = offsetof(htvm_encoder_options, skeleton) + sizeof(void*) / 2;
    EXPECT_TRUE(told(options)) << "a size that cuts the pointer in half";
    options.struct_size = 0;
    EXPECT_TRUE(told(options));
    EXPECT_EQ(htvm_encoder_create(&options, &encoder, text, 4), HTVM_BAD_INPUT);
    EXPECT_EQ(std::strlen(text), 3u) << "cut to the caller's array";
    EXPECT_EQ(htvm_encoder_create(&options, &encoder, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_create(nullptr, nullptr, nullptr, 0), HTVM_BAD_INPUT);
}

TEST(CEncoder, WrongMeshesAndPosesAreErrorsAndTheNextFrameIsFine) {
    const auto person = synthetic(true, 1, 300).frames[0];
    const CSkeleton skeleton(synth_skeleton());
    auto options = default_options();
    options.skeleton = &skeleton.skeleton;
    const auto encoder = make_encoder(&options);
    const auto good = c_mesh(person.mesh);
    const auto pose = c_pose(*person.pose);
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), nullptr, &pose, 0, 0), HTVM_BAD_INPUT);
    auto bad = good;
    bad.struct_size = 0;
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &bad, &pose, 0, 0), HTVM_BAD_INPUT);
    bad = good;
    bad.positions = nullptr;
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &bad, &pose, 0, 0), HTVM_BAD_INPUT);
    bad = good;
    bad.vertices /= 2;  // triangles name vertices that are not there
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &bad, &pose, 0, 0), HTVM_BAD_INPUT);
    EXPECT_GT(std::strlen(htvm_encoder_last_error(encoder.get())), 10u);
    auto no_joints = pose;
    no_joints.joints = nullptr;
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &good, &no_joints, 0, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &good, &pose, 0, 0), HTVM_OK);
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &good, &pose, 0, 0), HTVM_BAD_INPUT) << "time stands still";
    EXPECT_EQ(htvm_encoder_finish(encoder.get()), HTVM_OK);
    EXPECT_EQ(htvm_encoder_finish(encoder.get()), HTVM_OK) << "twice is once";
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &good, &pose, 99, 0), HTVM_BAD_INPUT) << "after the end";
    std::vector<std::uint8_t> bytes;
    EXPECT_EQ(receive_all(encoder.get(), bytes), HTVM_END);
    EXPECT_EQ(decode_packets(read_packets(bytes, 100)).frames.size(), 1u);
}

TEST(CEncoder, TheMeshWithoutVerticesIsAFrame) {
    const auto encoder = make_encoder();
    htvm_mesh mesh;
    htvm_mesh_init(&mesh, sizeof mesh);
    EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, 0, 0), HTVM_OK);
}

TEST(CEncoder, SurvivesNullHandles) {
    std::size_t size = 0;
    EXPECT_EQ(htvm_encoder_send_mesh(nullptr, nullptr, nullptr, 0, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_receive_packet(nullptr, nullptr, 0, &size), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_finish(nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_last_frame(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_STREQ(htvm_encoder_last_error(nullptr), "");
    htvm_encoder_destroy(nullptr);
    htvm_quality_steps(50, nullptr, nullptr);
    double geometry = 0, colour = 0;
    htvm_quality_steps(50, &geometry, &colour);
    EXPECT_EQ(geometry, quality_steps(50).geometry_step);
    EXPECT_EQ(colour, quality_steps(50).colour_step);
}

TEST(CEncoder, LivesInTheCallersMemory) {
    CountingMemory memory;
    auto options = default_options();
    options.allocator = memory.allocator();
    make_encoder(&options);
    EXPECT_GE(memory.made, 1);
    EXPECT_EQ(memory.released, memory.made);
    memory.fails_from = 0;
    htvm_encoder* encoder = nullptr;
    EXPECT_EQ(htvm_encoder_create(&options, &encoder, nullptr, 0), HTVM_OUT_OF_MEMORY);
    EXPECT_EQ(encoder, nullptr);
}

}  // namespace
}  // namespace htvm
