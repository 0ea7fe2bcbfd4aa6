// The C interface's encoder gives the same bytes as the C++ one, and survives callers who misuse it.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "c_api/c_test_streams.h"
#include "htvm/option_list.hpp"
#include "htvm/stream_index.hpp"

namespace htvm {
namespace {

using namespace test;

using Handle = std::unique_ptr<htvm_encoder, decltype(&htvm_encoder_destroy)>;
using Options = std::unique_ptr<htvm_encoder_options, decltype(&htvm_encoder_options_destroy)>;

Options make_options(std::uint32_t profile = HTVM_PROFILE_TRACKED, const htvm_allocator* allocator = nullptr) {
    htvm_encoder_options* options = nullptr;
    EXPECT_EQ(htvm_encoder_options_create(profile, allocator, &options), HTVM_OK);
    return {options, htvm_encoder_options_destroy};
}

Handle make_encoder(const htvm_encoder_options* options = nullptr) {
    htvm_encoder* encoder = nullptr;
    char text[200] = "";
    EXPECT_EQ(htvm_encoder_create(options, &encoder, text, sizeof text), HTVM_OK) << text;
    return {encoder, htvm_encoder_destroy};
}

// The mesh in the form of the C interface; it refers to the mesh's arrays.
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

// A skeleton in the form of the C interface, with the arrays that it refers to.
struct CSkeleton {
    Skeleton cpp;  // owns the names that the C struct points to
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

// Appends the packets that are ready; returns the status at which it stopped.
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

std::vector<std::uint8_t> bytes_of(const TestSequence& sequence, const Options& options) {
    const CSkeleton skeleton(sequence.skeleton);
    if (!sequence.skeleton.bones.empty()) {
        EXPECT_EQ(htvm_encoder_options_set_skeleton(options.get(), &skeleton.skeleton), HTVM_OK);
    }
    const auto encoder = make_encoder(options.get());
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
        EXPECT_EQ(bytes_of(sequence, make_options()), encode(sequence, {}).bytes) << sequence.name;
}

TEST(CEncoder, OptionsGiveTheBytesOfTheCppEncoder) {
    struct Case {
        Profile profile;
        std::vector<std::pair<const char*, const char*>> changed;
    };
    const auto person = synthetic(true, 5, 300);
    for (const auto& [profile, changed] :
         std::vector<Case>{{Profile::paper, {}},
                           {Profile::topology,
                            {{"key_interval", "3"},
                             {"topology.frame_choice", "motion"},
                             {"topology.predicted_below", "30"},
                             {"topology.merge_duplicates", "off"}}},
                           {Profile::tracked, {{"tracked.references", "intra"}, {"tracked.simplify", "0.2"}}},
                           {Profile::tracked, {{"tracked.group", "3"}}},
                           {Profile::tracked, {{"rate.bits_per_second", "4e6"}, {"rate.buffer_seconds", "0.5"}}}}) {
        const auto options = make_options(static_cast<std::uint32_t>(profile));
        auto cpp = default_options(profile);
        for (const auto& [name, value] : changed) {
            EXPECT_EQ(htvm_encoder_options_set(options.get(), name, value), HTVM_OK)
                << htvm_encoder_options_last_error(options.get());
            ASSERT_TRUE(set_option(cpp, name, value));
        }
        EXPECT_EQ(bytes_of(person, options), encode(person, cpp).bytes) << profile_name(profile);
    }
}

// The list of options in C equals the C++ one, and each can be set and read by text and by number.
TEST(CEncoder, EveryOptionOfTheListCanBeAskedForSetAndRead) {
    ASSERT_EQ(htvm_encoder_option_count(), option_list().size());
    for (const auto profile : {Profile::tracked, Profile::topology, Profile::paper}) {
        const auto number = static_cast<std::uint32_t>(profile);
        const auto options = make_options(number);
        for (std::uint32_t i = 0; i < htvm_encoder_option_count(); ++i) {
            const auto& row = option_list()[i];
            htvm_option_info info;
            ASSERT_EQ(htvm_encoder_option(i, number, &info, sizeof info), HTVM_OK);
            EXPECT_EQ(info.struct_size, sizeof info);
            EXPECT_STREQ(info.name, row.name);
            EXPECT_STREQ(info.group, group_name(row.group));
            EXPECT_STREQ(info.unit, row.unit);
            EXPECT_STREQ(info.meaning, row.meaning);
            EXPECT_STREQ(info.zero, row.zero);
            EXPECT_EQ(info.serves != 0, serves(row.group, profile));
            EXPECT_EQ(info.default_value, row.get(default_options(profile))) << row.name;
            for (std::uint32_t w = 0; w < info.words; ++w)
                EXPECT_STREQ(htvm_encoder_option_word(i, w), row.words[w]) << row.name;
            EXPECT_EQ(htvm_encoder_option_word(i, info.words), nullptr);
            double value = -1;
            EXPECT_EQ(htvm_encoder_options_get_number(options.get(), row.name, &value), HTVM_OK);
            EXPECT_EQ(value, info.default_value) << row.name;
            for (const double end : {info.most, info.least}) {
                EXPECT_EQ(htvm_encoder_options_set_number(options.get(), row.name, end), HTVM_OK) << row.name;
                char text[32] = "";
                EXPECT_EQ(htvm_encoder_options_get(options.get(), row.name, text, sizeof text), HTVM_OK);
                EXPECT_EQ(text, value_text(row, end));
                EXPECT_EQ(htvm_encoder_options_get_number(options.get(), row.name, &value), HTVM_OK);
                EXPECT_EQ(value, end) << row.name;
                EXPECT_EQ(htvm_encoder_options_set_number(options.get(), row.name, info.most + 1), HTVM_BAD_INPUT);
            }
        }
    }
}

TEST(CEncoder, SaysWhatIsWrongWithAnOption) {
    const auto options = make_options();
    const auto said = [&](const char* name, const char* value) {
        EXPECT_EQ(htvm_encoder_options_set(options.get(), name, value), HTVM_BAD_INPUT);
        return std::string(htvm_encoder_options_last_error(options.get()));
    };
    EXPECT_EQ(said("keyinterval", "4"), "there is no option 'keyinterval'; the nearest is 'key_interval'");
    EXPECT_EQ(said("key_interval", "often"), "key_interval must be 1 to 1000000 frames, not 'often'");
    EXPECT_NE(said(nullptr, "4"), "");
    EXPECT_NE(said("key_interval", nullptr), "");
    char text[4] = "abc";
    EXPECT_EQ(htvm_encoder_options_get(options.get(), "tracked.references", text, sizeof text), HTVM_BUFFER_TOO_SMALL);
    EXPECT_STREQ(text, "abc");
    EXPECT_EQ(htvm_encoder_options_get(options.get(), "tracked.references", nullptr, 100), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_get(options.get(), "nothing", text, sizeof text), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_get_number(options.get(), "lambda", nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_get_number(options.get(), nullptr, nullptr), HTVM_BAD_INPUT);
    htvm_encoder_options* none = nullptr;
    EXPECT_EQ(htvm_encoder_options_create(3, nullptr, &none), HTVM_BAD_INPUT);
    EXPECT_EQ(none, nullptr);
    EXPECT_EQ(htvm_encoder_options_create(0, nullptr, nullptr), HTVM_BAD_INPUT);
    htvm_option_info info;
    EXPECT_EQ(htvm_encoder_option(htvm_encoder_option_count(), 0, &info, sizeof info), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_option(0, 3, &info, sizeof info), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_option(0, 0, nullptr, sizeof info), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_option_word(0, 0), nullptr) << "a number has no words";
}

TEST(CEncoder, RunsItsTasksOnTheCallersThreads) {
    const auto person = synthetic(true, 3, 300);
    const auto options = make_options();
    EXPECT_EQ(htvm_encoder_options_set(options.get(), "threads", "3"), HTVM_OK);
    const auto expected = bytes_of(person, options);
    std::size_t calls = 0;
    const auto run_tasks = [](void* user, size_t tasks, void (*task)(void*, size_t), void* context) {
        ++*static_cast<std::size_t*>(user);
        for (std::size_t t = tasks; t-- > 0;) task(context, t);
    };
    EXPECT_EQ(htvm_encoder_options_set_run_tasks(options.get(), run_tasks, &calls), HTVM_OK);
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
    EXPECT_EQ(info.reason, std::uint32_t{HTVM_REASON_DUE});
}

TEST(CEncoder, WithLatencyAFrameComesACallLaterAndTheLastOnesAtTheEnd) {
    const auto options = make_options();
    ASSERT_EQ(htvm_encoder_options_set(options.get(), "latency_frames", "1"), HTVM_OK);
    const auto encoder = make_encoder(options.get());
    const auto sequence = sequence_of(tfan_test::grid(5, 5), 2, all);
    std::vector<std::uint8_t> packets;
    htvm_frame_info info;
    const auto send = [&](const Mesh& frame, std::int64_t timestamp_us) {
        const auto mesh = c_mesh(frame);
        EXPECT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, timestamp_us, 0), HTVM_OK);
        EXPECT_EQ(receive_all(encoder.get(), packets), HTVM_AGAIN);
    };
    send(sequence.frames[0].mesh, -6667);
    EXPECT_TRUE(packets.empty());
    EXPECT_EQ(htvm_encoder_last_frame(encoder.get(), &info, sizeof info), HTVM_AGAIN) << "none is coded yet";
    send(sequence.frames[1].mesh, 26666);
    EXPECT_FALSE(packets.empty());
    ASSERT_EQ(htvm_encoder_last_frame(encoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.timestamp_us, -6667);
    ASSERT_EQ(htvm_encoder_finish(encoder.get()), HTVM_OK);
    EXPECT_EQ(receive_all(encoder.get(), packets), HTVM_END);
    EXPECT_EQ(packets, bytes_of(sequence, make_options()));
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

// As `htvm encode` puts it in front of a file: of everything but the index at the end.
TEST(CEncoder, GivesTheIndexForTheFrontOfAFile) {
    const auto encoder = make_encoder();
    const auto frames = sequence_of(tfan_test::grid(5, 5), 3, none).frames;
    std::size_t size = 0;
    std::vector<std::uint8_t> buffer(1 << 16);
    const auto front = [&] { return htvm_encoder_front_index(encoder.get(), buffer.data(), buffer.size(), &size); };
    std::vector<std::vector<std::uint8_t>> packets;
    const auto receive = [&] {
        htvm_status status;
        while ((status = htvm_encoder_receive_packet(encoder.get(), buffer.data(), buffer.size(), &size)) == HTVM_OK)
            packets.emplace_back(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
        return status;
    };
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto mesh = c_mesh(frames[k].mesh);
        ASSERT_EQ(htvm_encoder_send_mesh(encoder.get(), &mesh, nullptr, 40000 * static_cast<int>(k), k == 2), HTVM_OK);
        ASSERT_EQ(receive(), HTVM_AGAIN);
    }
    ASSERT_EQ(htvm_encoder_finish(encoder.get()), HTVM_OK);
    EXPECT_EQ(front(), HTVM_AGAIN) << "not all packets were received";
    ASSERT_EQ(receive(), HTVM_END);

    Decoder decoder;
    StreamIndexer expected;
    std::uint64_t offset = 0;
    packets.pop_back();
    for (const auto& bytes : packets) {
        PacketReader reader;
        reader.push(bytes);
        const auto packet = *reader.pull();
        expected.add(packet, offset);
        offset += bytes.size();
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame.has_value());
        if (*frame) expected.add(*bounds_of((*frame)->mesh.positions));
    }
    ASSERT_EQ(front(), HTVM_OK);
    const auto index = write_packet(write_index(expected.finish(offset)));
    EXPECT_EQ(std::vector<std::uint8_t>(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)), index);
    EXPECT_EQ(htvm_encoder_front_index(encoder.get(), buffer.data(), size - 1, &size), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(htvm_encoder_front_index(encoder.get(), buffer.data(), buffer.size(), nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_front_index(nullptr, buffer.data(), buffer.size(), &size), HTVM_BAD_INPUT);

    const auto empty = make_encoder();
    ASSERT_EQ(htvm_encoder_finish(empty.get()), HTVM_OK);
    EXPECT_EQ(htvm_encoder_receive_packet(empty.get(), buffer.data(), buffer.size(), &size), HTVM_END);
    EXPECT_EQ(htvm_encoder_front_index(empty.get(), buffer.data(), buffer.size(), &size), HTVM_END);
}

TEST(CEncoder, OptionsThatDoNotGoTogetherAreToldInASentence) {
    htvm_encoder* encoder = nullptr;
    const auto options = make_options();
    ASSERT_EQ(htvm_encoder_options_set(options.get(), "topology.frame_choice", "rd"), HTVM_OK);
    char text[300] = "";
    EXPECT_EQ(htvm_encoder_create(options.get(), &encoder, text, sizeof text), HTVM_BAD_INPUT);
    EXPECT_EQ(encoder, nullptr);
    EXPECT_STREQ(text, "topology.frame_choice does nothing with the tracked profile; choose the topology profile");
    EXPECT_EQ(htvm_encoder_create(options.get(), &encoder, text, 4), HTVM_BAD_INPUT);
    EXPECT_STREQ(text, "top") << "cut to the caller's array";
    EXPECT_EQ(htvm_encoder_create(options.get(), &encoder, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_create(nullptr, nullptr, nullptr, 0), HTVM_BAD_INPUT);
}

TEST(CEncoder, WrongSkeletonsAreToldInASentence) {
    const auto options = make_options();
    htvm_skeleton skeleton{};
    const auto refused = [&] {
        EXPECT_EQ(htvm_encoder_options_set_skeleton(options.get(), &skeleton), HTVM_BAD_INPUT);
        return std::strlen(htvm_encoder_options_last_error(options.get())) > 10;
    };
    EXPECT_TRUE(refused()) << "no htvm_skeleton_init()";
    htvm_skeleton_init(&skeleton, sizeof skeleton);
    skeleton.bones = 1;
    EXPECT_TRUE(refused()) << "no joints of the bones";
    skeleton.struct_size = offsetof(htvm_skeleton, bone_joints) + sizeof(void*) / 2;
    EXPECT_TRUE(refused()) << "a size that cuts the pointer in half";
    skeleton.struct_size = sizeof skeleton;
    skeleton.joints = 0xFFFFFFFF;
    EXPECT_TRUE(refused());
    skeleton.joints = 0;
    const std::uint16_t joints[] = {0, 5};
    skeleton.bone_joints = joints;
    ASSERT_EQ(htvm_encoder_options_set_skeleton(options.get(), &skeleton), HTVM_OK);
    htvm_encoder* encoder = nullptr;
    char text[300] = "";
    EXPECT_EQ(htvm_encoder_create(options.get(), &encoder, text, sizeof text), HTVM_BAD_INPUT);
    EXPECT_NE(std::string(text).find("joint"), std::string::npos) << "joints that are not there";
    ASSERT_EQ(htvm_encoder_options_set_skeleton(options.get(), nullptr), HTVM_OK);
    make_encoder(options.get());
}

TEST(CEncoder, WrongMeshesAndPosesAreErrorsAndTheNextFrameIsFine) {
    const auto person = synthetic(true, 1, 300).frames[0];
    const CSkeleton skeleton(synth_skeleton());
    const auto options = make_options();
    ASSERT_EQ(htvm_encoder_options_set_skeleton(options.get(), &skeleton.skeleton), HTVM_OK);
    const auto encoder = make_encoder(options.get());
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
    bad.vertices /= 2;  // triangles name vertices that no longer exist
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

TEST(CEncoder, ABitrateIsChangedWhereOneWasGiven) {
    const auto free = make_encoder();
    EXPECT_EQ(htvm_encoder_set_bitrate(free.get(), 1e6), HTVM_BAD_INPUT);
    EXPECT_NE(std::string(htvm_encoder_last_error(free.get())).find("rate.bits_per_second"), std::string::npos);
    const auto options = make_options();
    ASSERT_EQ(htvm_encoder_options_set_number(options.get(), "rate.bits_per_second", 1e6), HTVM_OK);
    const auto encoder = make_encoder(options.get());
    EXPECT_EQ(htvm_encoder_set_bitrate(encoder.get(), 2e6), HTVM_OK);
    EXPECT_EQ(htvm_encoder_set_bitrate(encoder.get(), -1), HTVM_BAD_INPUT);
}

TEST(CEncoder, AnEffortIsSetFromZeroToNine) {
    const auto encoder = make_encoder();
    EXPECT_EQ(htvm_encoder_set_effort(encoder.get(), 0), HTVM_OK);
    EXPECT_EQ(htvm_encoder_set_effort(encoder.get(), 9), HTVM_OK);
    EXPECT_EQ(htvm_encoder_set_effort(encoder.get(), 10), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_set_effort(encoder.get(), 0xffffffffu), HTVM_BAD_INPUT);
    EXPECT_EQ(std::string(htvm_encoder_last_error(encoder.get())), "an effort is 0 to 9, not 10");
    EXPECT_EQ(htvm_encoder_set_effort(nullptr, 5), HTVM_BAD_INPUT);
}

TEST(CEncoder, RepairsAreAskedForInTheTrackedProfileAlone) {
    const auto never = [](void*) { return 0; };
    const auto encoder = make_encoder();
    EXPECT_EQ(htvm_encoder_set_repair(encoder.get(), never, nullptr), HTVM_OK);
    EXPECT_EQ(htvm_encoder_set_repair(encoder.get(), nullptr, nullptr), HTVM_OK);
    const auto options = make_options(HTVM_PROFILE_TOPOLOGY);
    const auto topology = make_encoder(options.get());
    EXPECT_EQ(htvm_encoder_set_repair(topology.get(), never, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_set_repair(nullptr, never, nullptr), HTVM_BAD_INPUT);
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
    EXPECT_EQ(htvm_encoder_set_bitrate(nullptr, 1e6), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_last_frame(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_STREQ(htvm_encoder_last_error(nullptr), "");
    htvm_encoder_destroy(nullptr);
    EXPECT_EQ(htvm_encoder_options_set(nullptr, "lambda", "1"), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_set_number(nullptr, "lambda", 1), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_get(nullptr, "lambda", nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_get_number(nullptr, "lambda", nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_set_skeleton(nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_set_run_tasks(nullptr, nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_STREQ(htvm_encoder_options_last_error(nullptr), "");
    htvm_encoder_options_destroy(nullptr);
    htvm_quality_steps(50, nullptr, nullptr);
    double geometry = 0, colour = 0;
    htvm_quality_steps(50, &geometry, &colour);
    EXPECT_EQ(geometry, quality_steps(50).geometry_step);
    EXPECT_EQ(colour, quality_steps(50).colour_step);
}

TEST(CEncoder, LivesInTheCallersMemory) {
    CountingMemory memory;
    auto allocator = memory.allocator();
    auto options = make_options(HTVM_PROFILE_TOPOLOGY, &allocator);
    EXPECT_EQ(memory.made, 1);
    make_encoder(options.get());
    EXPECT_EQ(memory.made, 2);
    EXPECT_EQ(memory.released, 1);
    memory.fails_from = 0;
    htvm_encoder* encoder = nullptr;
    EXPECT_EQ(htvm_encoder_create(options.get(), &encoder, nullptr, 0), HTVM_OUT_OF_MEMORY);
    EXPECT_EQ(encoder, nullptr);
    options.reset();
    EXPECT_EQ(memory.released, memory.made);
    htvm_encoder_options* none = nullptr;
    EXPECT_EQ(htvm_encoder_options_create(0, &allocator, &none), HTVM_OUT_OF_MEMORY);
    EXPECT_EQ(none, nullptr);
    allocator.release = nullptr;
    EXPECT_EQ(htvm_encoder_options_create(0, &allocator, &none), HTVM_BAD_INPUT);
}

}  // namespace
}  // namespace htvm
