// The C interface's decoder gives the same as the C++ one, and survives callers who misuse it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "c_api/c_test_streams.h"
#include "codec/enhanced_options.h"
#include "htvm/dependency.hpp"
#include "htvm/stream_index.hpp"
#include "htvm/texture.hpp"

namespace htvm {
namespace {

using namespace test;

using Handle = std::unique_ptr<htvm_decoder, decltype(&htvm_decoder_destroy)>;

Handle make_decoder(const htvm_decoder_options* options = nullptr) {
    htvm_decoder* decoder = nullptr;
    EXPECT_EQ(htvm_decoder_create(options, &decoder), HTVM_OK);
    return {decoder, htvm_decoder_destroy};
}

htvm_decoder_options default_options() {
    htvm_decoder_options options;
    EXPECT_EQ(htvm_decoder_options_init(&options, sizeof options), HTVM_OK);
    return options;
}

void expect_same_frame(htvm_decoder* decoder, const htvm_frame_info& info, const DecodedFrame& expected) {
    EXPECT_EQ(info.struct_size, sizeof info);
    EXPECT_EQ(info.type, static_cast<std::uint32_t>(expected.info.type));
    EXPECT_EQ(info.frame, expected.info.frame);
    EXPECT_EQ(info.reference, expected.info.reference);
    EXPECT_EQ(info.timestamp_us, expected.info.timestamp_us);
    EXPECT_EQ(info.source_vertices, expected.info.source_vertices);
    EXPECT_EQ(info.source_triangles, expected.info.source_triangles);
    EXPECT_EQ(info.bytes, expected.info.bytes.total());
    EXPECT_EQ(info.concealed, expected.concealed ? 1u : 0u);
    EXPECT_EQ(info.reason, static_cast<std::uint32_t>(expected.info.reason));
    EXPECT_EQ(info.topology, expected.topology);
    EXPECT_EQ(info.sequence, expected.info.sequence);
    EXPECT_EQ(info.reference_topology, expected.reference_topology);
    EXPECT_EQ(info.absent, static_cast<std::uint32_t>(std::ranges::count(expected.presence, 0)));
    expect_same_mesh(copied_mesh(decoder, info), expected.mesh);
    expect_same_mesh(lent_mesh(decoder, info), expected.mesh);
    const auto pose = copied_pose(decoder, info);
    EXPECT_EQ(pose.joints, expected.pose.joints);
    EXPECT_EQ(pose.orientations, expected.pose.orientations);
}

// Receives every complete frame, and compares it with those expected from `next` on.
void receive_all(htvm_decoder* decoder, const std::vector<DecodedFrame>& expected, std::size_t& next) {
    htvm_frame_info info;
    htvm_status status;
    while ((status = htvm_decoder_receive_frame(decoder, &info, sizeof info)) != HTVM_AGAIN) {
        ASSERT_EQ(status, HTVM_OK) << htvm_decoder_last_error(decoder);
        ASSERT_LT(next, expected.size());
        expect_same_frame(decoder, info, expected[next++]);
    }
}

TEST(CDecoder, BytesInPiecesGiveTheFramesOfTheCppDecoder) {
    for (const auto* coded : {&coded_person(), &coded_grid()}) {
        const auto expected = decode_packets(coded->packets).frames;
        for (const std::size_t chunk : {std::size_t{1}, std::size_t{997}, coded->bytes.size()}) {
            const auto decoder = make_decoder();
            std::size_t next = 0;
            for (std::size_t at = 0; at < coded->bytes.size(); at += chunk) {
                const std::size_t count = std::min(chunk, coded->bytes.size() - at);
                ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded->bytes.data() + at, count), HTVM_OK);
                receive_all(decoder.get(), expected, next);
            }
            EXPECT_EQ(next, expected.size());
            std::uint64_t damaged = 1, pending = 1;
            EXPECT_EQ(htvm_decoder_unused_bytes(decoder.get(), &damaged, &pending), HTVM_OK);
            EXPECT_EQ(damaged + pending, 0u);
        }
    }
}

TEST(CDecoder, PacketsGiveTheFramesOfTheCppDecoder) {
    const auto expected = decode_packets(coded_person().packets).frames;
    auto options = default_options();
    options.threads = 2;
    const auto decoder = make_decoder(&options);
    std::size_t next = 0;
    for (const auto& packet : coded_person().packets) {
        const auto bytes = write_packet(packet);
        ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
        EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_AGAIN);
        receive_all(decoder.get(), expected, next);
    }
    EXPECT_EQ(next, expected.size());
}

TEST(CDecoder, RunsItsTasksOnTheCallersThreads) {
    const auto expected = decode_packets(coded_person().packets).frames;
    auto options = default_options();
    options.threads = 3;
    std::size_t calls = 0;
    options.run_tasks_user = &calls;
    options.run_tasks = [](void* user, size_t tasks, void (*task)(void*, size_t), void* context) {
        ++*static_cast<std::size_t*>(user);
        for (std::size_t t = tasks; t-- > 0;) task(context, t);
    };
    const auto decoder = make_decoder(&options);
    std::size_t next = 0;
    for (const auto& packet : coded_person().packets) {
        const auto bytes = write_packet(packet);
        ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
        receive_all(decoder.get(), expected, next);
    }
    EXPECT_EQ(next, expected.size());
    EXPECT_GT(calls, 0u);
}

TEST(CDecoder, TellsWhatTheSequenceHeaderSays) {
    const auto decoder = make_decoder();
    htvm_sequence_info info;
    EXPECT_EQ(htvm_decoder_sequence(decoder.get(), &info, sizeof info), HTVM_AGAIN);
    Decoder cpp;
    ASSERT_TRUE(cpp.decode_copy(coded_person().packets[0]).has_value());
    const auto bytes = write_packet(coded_person().packets[0]);
    ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
    ASSERT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_AGAIN);
    ASSERT_EQ(htvm_decoder_sequence(decoder.get(), &info, sizeof info), HTVM_OK);
    const auto& expected = *cpp.sequence();
    EXPECT_EQ(info.joints, expected.skeleton.joint_names.size());
    EXPECT_EQ(info.bones, expected.skeleton.bones.size());
    EXPECT_EQ(info.skeleton_tracked, 1u);
    EXPECT_EQ(info.fps_numerator, expected.fps_numerator);
    EXPECT_EQ(info.fps_denominator, expected.fps_denominator);
    EXPECT_EQ(info.unit_micrometres, expected.unit_micrometres);
    EXPECT_EQ(info.nearest_vertices, 16u);
    EXPECT_EQ(info.lattice_step, expected.lattice_step);
    for (std::uint32_t j = 0; j < info.joints; ++j) {
        char name[256];
        EXPECT_EQ(htvm_decoder_joint_name(decoder.get(), j, name, sizeof name), HTVM_OK);
        EXPECT_EQ(name, expected.skeleton.joint_names[j]);
        EXPECT_EQ(htvm_decoder_joint_name(decoder.get(), j, name, std::strlen(name)), HTVM_BUFFER_TOO_SMALL);
    }
    for (std::uint32_t b = 0; b < info.bones; ++b) {
        std::uint32_t first = 0, second = 0;
        double radius = -1;
        EXPECT_EQ(htvm_decoder_bone(decoder.get(), b, &first, &second, &radius), HTVM_OK);
        EXPECT_EQ(first, expected.skeleton.bones[b].first);
        EXPECT_EQ(second, expected.skeleton.bones[b].second);
        EXPECT_EQ(radius, expected.radii[b]);
    }
    EXPECT_EQ(htvm_decoder_bone(decoder.get(), info.bones, nullptr, nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_joint_name(decoder.get(), 0, nullptr, 0), HTVM_BAD_INPUT);
}

TEST(CDecoder, ConcealsAsTheCppDecoder) {
    Decoder cpp;
    const auto decoder = make_decoder();
    htvm_frame_info info;
    EXPECT_EQ(htvm_decoder_conceal(decoder.get(), 1, 5, &info, sizeof info), HTVM_AGAIN);
    for (const auto& packet : {coded_person().packets[0], coded_person().packets[1]}) {
        ASSERT_TRUE(cpp.decode_copy(packet).has_value());
        const auto bytes = write_packet(packet);
        ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
        (void)htvm_decoder_receive_frame(decoder.get(), nullptr, 0);
    }
    ASSERT_EQ(htvm_decoder_conceal(decoder.get(), 9, 300000, &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.frame, 9u);
    EXPECT_EQ(info.concealed, 1u);
    expect_same_frame(decoder.get(), info, *cpp.conceal_copy(9, 300000));
}

TEST(CDecoder, PreparingLeavesTheCurrentFrameAndChangesNone) {
    Decoder cpp;
    const auto decoder = make_decoder();
    EXPECT_EQ(htvm_decoder_prepare(nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_prepare(decoder.get()), HTVM_OK);  // before anything has come
    for (const auto& packet : coded_person().packets) {
        const auto expected = cpp.decode_copy(packet);
        ASSERT_TRUE(expected.has_value());
        const auto bytes = write_packet(packet);
        ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
        htvm_frame_info info;
        const auto status = htvm_decoder_receive_frame(decoder.get(), &info, sizeof info);
        EXPECT_EQ(htvm_decoder_prepare(decoder.get()), HTVM_OK);
        if (!*expected) continue;
        ASSERT_EQ(status, HTVM_OK);
        expect_same_frame(decoder.get(), info, **expected);
    }
}

TEST(CDecoder, DamagedPacketsAreErrorsWithASentenceAndCostThemselvesOnly) {
    const auto decoder = make_decoder();
    auto bytes = write_packet(coded_grid().packets[0]);
    bytes[40] ^= 1;
    EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), bytes.size()), HTVM_CORRUPT_STREAM);
    EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), 10), HTVM_CORRUPT_STREAM);
    EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), bytes.data(), 0), HTVM_CORRUPT_STREAM);
    std::size_t frames = 0, errors = 0;
    for (const auto& packet : coded_grid().packets) {
        auto broken = packet;
        if (packet.kind == PacketKind::enhanced && errors == 0)
            broken.payload.resize(broken.payload.size() / 3);  // with a good checksum
        const auto sent = write_packet(broken);
        ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), sent.data(), sent.size()), HTVM_OK);
        const auto status = htvm_decoder_receive_frame(decoder.get(), nullptr, 0);
        frames += status == HTVM_OK;
        if (status < 0) {
            ++errors;
            EXPECT_EQ(status, HTVM_CORRUPT_STREAM);
            EXPECT_GT(std::strlen(htvm_decoder_last_error(decoder.get())), 10u);
            EXPECT_EQ(htvm_decoder_copy_positions(decoder.get(), nullptr, 0), HTVM_BAD_INPUT) << "no current frame";
        }
    }
    EXPECT_EQ(errors, 1u);
    EXPECT_EQ(frames, decode_packets(coded_grid().packets).frames.size() - 1);
}

TEST(CDecoder, HoldsTheLimitsOfItsOptions) {
    auto options = default_options();
    options.max_vertices = 20;
    auto decoder = make_decoder(&options);
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_LIMIT);
    options = default_options();
    options.max_bones = 3;
    decoder = make_decoder(&options);
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_person().bytes.data(), 2000), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_LIMIT);
    options = default_options();
    options.max_memory = 1000;
    decoder = make_decoder(&options);
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_LIMIT);
    options = default_options();
    options.max_packet_bytes = 10;
    decoder = make_decoder(&options);
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_AGAIN);
    std::uint64_t damaged = 0;
    EXPECT_EQ(htvm_decoder_unused_bytes(decoder.get(), &damaged, nullptr), HTVM_OK);
    EXPECT_GT(damaged, 0u);
}

TEST(CDecoder, WritesToArraysThatAreLargeEnoughOnly) {
    const auto decoder = make_decoder();
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    htvm_frame_info info;
    ASSERT_EQ(htvm_decoder_receive_frame(decoder.get(), &info, sizeof info), HTVM_OK);
    std::vector<float> numbers(3 * info.vertices + 1, -7.f);
    EXPECT_EQ(htvm_decoder_copy_positions(decoder.get(), numbers.data(), 3 * info.vertices - 1), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(numbers, std::vector<float>(numbers.size(), -7.f)) << "nothing is written to an array too short";
    EXPECT_EQ(htvm_decoder_copy_positions(decoder.get(), nullptr, numbers.size()), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_copy_positions(decoder.get(), numbers.data(), numbers.size()), HTVM_OK);
    EXPECT_EQ(numbers.back(), -7.f);
    EXPECT_EQ(htvm_decoder_copy_texcoords(decoder.get(), numbers.data(), 2 * info.vertices - 1), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(htvm_decoder_copy_joints(decoder.get(), nullptr, 0), HTVM_BUFFER_TOO_SMALL);
}

TEST(CDecoder, SaysWhichAttributesAFrameHas) {
    EncoderOptions options = test::enhanced_options();
    const auto coded = encode(sequence_of(tfan_test::grid(4, 4), 1, none), options);
    const auto decoder = make_decoder();
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded.bytes.data(), coded.bytes.size()), HTVM_OK);
    htvm_frame_info info;
    ASSERT_EQ(htvm_decoder_receive_frame(decoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.attributes, 0u);
    std::vector<std::uint8_t> colours(1000);
    EXPECT_EQ(htvm_decoder_copy_colours(decoder.get(), colours.data(), colours.size()), HTVM_BAD_INPUT);
    EXPECT_STREQ(htvm_decoder_last_error(decoder.get()), "the frame has no colours");
}

TEST(CDecoder, KindsOfFramesHaveNames) {
    for (const auto& kind : frame_kinds) {
        EXPECT_STREQ(htvm_frame_kind_name(static_cast<std::uint32_t>(kind.type)), kind.name);
        EXPECT_STREQ(htvm_frame_kind_letter(static_cast<std::uint32_t>(kind.type)), kind.letter);
    }
    EXPECT_STREQ(htvm_frame_kind_letter(HTVM_FRAME_ENHANCED), "EP");
    EXPECT_STREQ(htvm_frame_kind_name(HTVM_FRAME_KINDS), "unknown");
    EXPECT_STREQ(htvm_frame_kind_letter(0xFFFFFFFF), "?");
}

TEST(CDecoder, ReasonsOfFramesHaveNames) {
    for (const auto& reason : frame_reasons)
        EXPECT_STREQ(htvm_frame_reason_name(static_cast<std::uint32_t>(reason.reason)), reason.name);
    EXPECT_STREQ(htvm_frame_reason_name(HTVM_REASON_BORDER), "border");
    EXPECT_STREQ(htvm_frame_reason_name(HTVM_REASONS), "unknown");
}

TEST(CDecoder, BytesOfLayersAddUpToThoseOfThePacket) {
    const auto decoder = make_decoder();
    std::uint64_t bytes[HTVM_LAYERS] = {};
    EXPECT_EQ(htvm_decoder_layer_bytes(decoder.get(), bytes, HTVM_LAYERS), HTVM_BAD_INPUT);  // no frame yet
    const auto& stream = coded_person().bytes;
    htvm_decoder_send_bytes(decoder.get(), stream.data(), stream.size());
    htvm_frame_info info;
    ASSERT_EQ(htvm_decoder_receive_frame(decoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(htvm_decoder_layer_bytes(decoder.get(), bytes, HTVM_LAYERS - 1), HTVM_BUFFER_TOO_SMALL);
    ASSERT_EQ(htvm_decoder_layer_bytes(decoder.get(), bytes, HTVM_LAYERS), HTVM_OK);
    std::uint64_t sum = 0;
    for (const auto layer : bytes) sum += layer;
    EXPECT_EQ(sum, info.bytes);
    EXPECT_GT(bytes[static_cast<int>(Layer::geometry)], 0u);
    EXPECT_STREQ(htvm_layer_name(0), "overhead");
    EXPECT_STREQ(htvm_layer_name(3), "geometry");
    EXPECT_EQ(htvm_layer_name(HTVM_LAYERS), nullptr);
}

TEST(CInterface, ReadsAnIndex) {
    const auto& stream = coded_person().bytes;
    PacketReader reader;
    reader.push(stream);
    std::vector<std::uint8_t> index;
    std::vector<std::pair<std::uint32_t, std::uint64_t>> intra;  // frame, offset
    std::uint64_t offset = 0;
    while (const auto packet = reader.pull()) {
        if (packet->kind == PacketKind::index) index = write_packet(*packet);
        if (packet->kind == PacketKind::intra) intra.emplace_back(packet->frame, offset);
        offset += packet->payload.size() + packet_overhead;
    }
    std::size_t count = 0;
    EXPECT_EQ(htvm_index_read(index.data(), index.size(), nullptr, 0, &count), HTVM_BUFFER_TOO_SMALL);
    ASSERT_EQ(count, intra.size());
    std::vector<htvm_index_entry> entries(count);
    ASSERT_EQ(htvm_index_read(index.data(), index.size(), entries.data(), count, &count), HTVM_OK);
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(entries[i].frame, intra[i].first);
        EXPECT_EQ(entries[i].offset, intra[i].second);
        EXPECT_EQ(entries[i].back, 0u);
        EXPECT_EQ(entries[i].flags, 0u);
    }
    EXPECT_EQ(htvm_index_read(index.data(), index.size() - 1, entries.data(), count, &count), HTVM_CORRUPT_STREAM);
    EXPECT_EQ(htvm_index_read(stream.data(), stream.size(), entries.data(), count, &count), HTVM_CORRUPT_STREAM);
    EXPECT_EQ(htvm_index_read(nullptr, 0, nullptr, 0, &count), HTVM_BAD_INPUT);
}

TEST(CInterface, ReadsAnIndexInFront) {
    PacketReader reader;
    reader.push(coded_person().bytes);
    StreamIndexer indexer;
    std::vector<std::uint8_t> body;
    std::vector<std::uint64_t> intra;  // offsets
    while (const auto packet = reader.pull()) {
        if (packet->kind == PacketKind::intra) intra.push_back(body.size());
        indexer.add(*packet, body.size());
        const auto bytes = write_packet(*packet);
        body.insert(body.end(), bytes.begin(), bytes.end());
    }
    const auto index = indexer.finish(body.size());
    const auto packet = write_packet(write_index(index));
    std::vector<htvm_index_entry> entries(intra.size());
    std::size_t count = 0;
    ASSERT_EQ(htvm_index_read(packet.data(), packet.size(), entries.data(), entries.size(), &count), HTVM_OK);
    ASSERT_EQ(count, intra.size());
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(entries[i].frame, index.points[i].frame);
        EXPECT_EQ(entries[i].timestamp_us, index.points[i].timestamp_us);
        EXPECT_EQ(entries[i].offset, packet.size() + intra[i]);
    }
}

TEST(CInterface, AnIndexInFrontTellsWhichEntriesAnEntryRefersTo) {
    StreamIndex index;
    index.frames = 60;
    index.bytes = 5000;
    index.sequences.push_back({0, 0});
    const std::uint8_t told = packet_flag::flags_valid | packet_flag::referred | packet_flag::access;
    index.points = {
        {0, 0, 100, 0, told}, {20, 666667, 2000, 1, told}, {50, 1666667, 4000, 2, packet_flag::flags_valid}};
    const auto packet = write_packet(write_index(index));
    std::array<htvm_index_entry, 3> entries{};
    std::size_t count = 0;
    ASSERT_EQ(htvm_index_read(packet.data(), packet.size(), entries.data(), entries.size(), &count), HTVM_OK);
    ASSERT_EQ(count, 3u);
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(entries[i].back, index.points[i].back);
        EXPECT_EQ(entries[i].flags, index.points[i].flags);
    }
}

TEST(CDecoder, DiscardForgetsWhatWasSent) {
    const auto decoder = make_decoder();
    const auto& bytes = coded_grid().bytes;
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), bytes.data(), bytes.size() / 2), HTVM_OK);
    EXPECT_EQ(htvm_decoder_discard(decoder.get()), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_AGAIN);
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
    std::size_t next = 0;
    receive_all(decoder.get(), decode_packets(coded_grid().packets).frames, next);
    EXPECT_EQ(next, 4u);
}

TEST(CDecoder, SurvivesMisuse) {
    htvm_frame_info info;
    EXPECT_EQ(htvm_decoder_create(nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_send_packet(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_send_bytes(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_receive_frame(nullptr, &info, sizeof info), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_conceal(nullptr, 0, 0, &info, sizeof info), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_discard(nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_unused_bytes(nullptr, nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_copy_positions(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_copy_triangles(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_copy_joints(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_sequence(nullptr, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_joint_name(nullptr, 0, nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_bone(nullptr, 0, nullptr, nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_STREQ(htvm_decoder_last_error(nullptr), "");
    htvm_decoder_destroy(nullptr);

    const auto decoder = make_decoder();
    EXPECT_STREQ(htvm_decoder_last_error(decoder.get()), "");
    EXPECT_EQ(htvm_decoder_copy_positions(decoder.get(), nullptr, 0), HTVM_BAD_INPUT) << "nothing was received yet";
    EXPECT_EQ(htvm_decoder_copy_triangles(decoder.get(), nullptr, 0), HTVM_BAD_INPUT);
    htvm_mesh_view view;
    EXPECT_EQ(htvm_decoder_view(decoder.get(), &view, sizeof view), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_view(nullptr, &view, sizeof view), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_copy_orientations(decoder.get(), nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), nullptr, 5), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_send_bytes(decoder.get(), nullptr, 5), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_send_bytes(decoder.get(), nullptr, 0), HTVM_OK);
    const auto packet = write_packet(coded_grid().packets[0]);
    EXPECT_EQ(htvm_decoder_send_packet(decoder.get(), packet.data(), packet.size()), HTVM_BAD_INPUT)
        << "bytes were sent before";
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), &info, 3), HTVM_BAD_INPUT) << "a struct of 3 bytes";
}

TEST(CDecoder, LendsWhichVerticesAreThere) {
    std::ifstream in(HTVM_TEST_DATA "/conformance/presence_7.htvm", std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
    const auto decoder = make_decoder();
    ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), bytes.data(), bytes.size()), HTVM_OK);
    htvm_frame_info info;
    std::size_t parts = 0, whole = 0;
    while (htvm_decoder_receive_frame(decoder.get(), &info, sizeof info) == HTVM_OK) {
        htvm_mesh_view view;
        ASSERT_EQ(htvm_decoder_view(decoder.get(), &view, sizeof view), HTVM_OK);
        EXPECT_EQ(view.presence == nullptr, info.absent == 0);
        EXPECT_EQ(info.topology == info.reference_topology, info.absent == 0);
        if (!view.presence) {
            ++whole;
            continue;
        }
        ++parts;
        EXPECT_EQ(std::count(view.presence, view.presence + view.vertices, 0), info.absent);
        for (std::uint32_t i = 0; i < 3 * view.triangles; ++i) ASSERT_EQ(view.presence[view.indices[i]], 1);
    }
    EXPECT_GT(parts, 0u);
    EXPECT_GT(whole, 0u);
    // To a program whose htvm_mesh_view ends with the texture coordinates, nothing is written behind them.
    ASSERT_EQ(htvm_decoder_conceal(decoder.get(), 99, 0, nullptr, 0), HTVM_OK);
    htvm_mesh_view older;
    std::memset(&older, 0xAB, sizeof older);
    ASSERT_EQ(htvm_decoder_view(decoder.get(), &older, offsetof(htvm_mesh_view, presence)), HTVM_OK);
    EXPECT_EQ(older.struct_size, offsetof(htvm_mesh_view, presence));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(older.presence) & 0xFF, 0xABu);
}

TEST(CDecoder, StructsOfOtherVersionsAreRead) {
    // Like an older program: a struct of the first 16 bytes only.
    unsigned char older[16 + 8];
    std::memset(older, 0xAB, sizeof older);
    ASSERT_EQ(htvm_decoder_options_init(reinterpret_cast<htvm_decoder_options*>(older), 16), HTVM_OK);
    for (std::size_t i = 16; i < sizeof older; ++i) EXPECT_EQ(older[i], 0xAB) << "beyond the caller's struct";
    EXPECT_NE(make_decoder(reinterpret_cast<htvm_decoder_options*>(older)), nullptr);

    // Like a newer program: longer, and 0 in what this version does not know.
    struct Newer {
        htvm_decoder_options options;
        std::uint64_t more[3];
    } newer;
    ASSERT_EQ(htvm_decoder_options_init(&newer.options, sizeof newer), HTVM_OK);
    EXPECT_EQ(newer.options.struct_size, sizeof newer);
    EXPECT_NE(make_decoder(&newer.options), nullptr);
    newer.more[2] = 1;
    htvm_decoder* decoder = nullptr;
    EXPECT_EQ(htvm_decoder_create(&newer.options, &decoder), HTVM_UNSUPPORTED);
    EXPECT_EQ(decoder, nullptr);

    htvm_decoder_options unset{};
    EXPECT_EQ(htvm_decoder_create(&unset, &decoder), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_options_init(nullptr, 100), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_decoder_options_init(&unset, 4), HTVM_BAD_INPUT);

    // The same for structs that the library fills: the first 12 bytes, and no more.
    const auto receiver = make_decoder();
    ASSERT_EQ(htvm_decoder_send_bytes(receiver.get(), coded_grid().bytes.data(), coded_grid().bytes.size()), HTVM_OK);
    unsigned char info[20];
    std::memset(info, 0xAB, sizeof info);
    ASSERT_EQ(htvm_decoder_receive_frame(receiver.get(), reinterpret_cast<htvm_frame_info*>(info), 12), HTVM_OK);
    EXPECT_EQ(info[0], 12);
    EXPECT_EQ(info[12], 0xAB);
}

TEST(CDecoder, LivesInTheCallersMemory) {
    CountingMemory memory;
    auto options = default_options();
    options.allocator = memory.allocator();
    {
        const auto decoder = make_decoder(&options);
        EXPECT_GE(memory.made, 1);
        ASSERT_EQ(htvm_decoder_send_bytes(decoder.get(), coded_grid().bytes.data(), coded_grid().bytes.size()),
                  HTVM_OK);
        EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_OK);
    }
    EXPECT_EQ(memory.released, memory.made);

    memory = {};
    memory.fails_from = 0;
    htvm_decoder* decoder = nullptr;
    EXPECT_EQ(htvm_decoder_create(&options, &decoder), HTVM_OUT_OF_MEMORY);
    EXPECT_EQ(decoder, nullptr);
    options.allocator.release = nullptr;
    EXPECT_EQ(htvm_decoder_create(&options, &decoder), HTVM_BAD_INPUT) << "one function without the other";
}

TEST(CInterface, TellsItsVersion) {
    const std::string text = std::to_string(HTVM_VERSION_MAJOR) + "." + std::to_string(HTVM_VERSION_MINOR) + "." +
                             std::to_string(HTVM_VERSION_PATCH);
    EXPECT_EQ(htvm_version_string(), text);
    EXPECT_EQ(text, HTVM_PROJECT_VERSION);
    EXPECT_EQ(htvm_version(), std::uint32_t{HTVM_VERSION_MAJOR} << 16 | HTVM_VERSION_MINOR << 8 | HTVM_VERSION_PATCH);
    EXPECT_EQ(htvm_stream_version(), 4u);
}

TEST(CInterface, TellsWhatFramesNeedAsTheCppOneDoes) {
    htvm_dependencies* dependencies = nullptr;
    ASSERT_EQ(htvm_dependencies_create(nullptr, &dependencies), HTVM_OK);
    Dependencies cpp;
    std::vector<std::uint64_t> places(10);
    std::size_t count = 0;
    for (const auto& packet : coded_person().packets) {
        const auto bytes = write_packet(packet);
        htvm_packet_info info;
        ASSERT_EQ(htvm_packet_read(bytes.data(), bytes.size(), &info, sizeof info), HTVM_OK);
        EXPECT_EQ(info.kind, static_cast<std::uint32_t>(packet.kind));
        EXPECT_EQ(info.flags, packet.flags);
        EXPECT_EQ(info.frame, packet.frame);
        EXPECT_EQ(info.reference, packet.reference);
        EXPECT_EQ(info.timestamp_us, packet.timestamp_us);
        EXPECT_EQ(info.bytes, bytes.size());
        std::uint64_t place = 99;
        ASSERT_EQ(htvm_dependencies_push(dependencies, &info, &place), HTVM_OK);
        EXPECT_EQ(place, cpp.push(packet));
        ASSERT_EQ(htvm_dependencies_closure(dependencies, places.data(), places.size(), &count), HTVM_OK);
        EXPECT_EQ(std::vector<std::uint64_t>(places.begin(), places.begin() + count), cpp.closure());
        ASSERT_EQ(htvm_dependencies_kept(dependencies, places.data(), places.size(), &count), HTVM_OK);
        EXPECT_EQ(std::vector<std::uint64_t>(places.begin(), places.begin() + count), cpp.kept());
        EXPECT_EQ(htvm_packet_read(bytes.data(), bytes.size() - 1, &info, sizeof info), HTVM_CORRUPT_STREAM);
        htvm_packet_info from_header;
        ASSERT_EQ(htvm_packet_header_read(bytes.data(), HTVM_PACKET_HEADER, &from_header, sizeof from_header), HTVM_OK);
        EXPECT_EQ(std::memcmp(&from_header, &info, sizeof info), 0);
        EXPECT_EQ(htvm_packet_header_read(bytes.data(), HTVM_PACKET_HEADER - 1, &info, sizeof info), HTVM_AGAIN);
        EXPECT_EQ(htvm_packet_header_read(bytes.data() + 1, HTVM_PACKET_HEADER, &info, sizeof info),
                  HTVM_CORRUPT_STREAM);
    }
    EXPECT_EQ(htvm_dependencies_kept(dependencies, nullptr, 0, &count), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(count, cpp.kept().size());
    EXPECT_EQ(htvm_dependencies_push(dependencies, nullptr, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_dependencies_kept(nullptr, places.data(), places.size(), &count), HTVM_BAD_INPUT);
    htvm_dependencies_destroy(dependencies);
    htvm_dependencies_destroy(nullptr);
}

TEST(CInterface, ReadsAPictureOnLoanFromItsPacket) {
    const std::vector<std::uint8_t> coded = {1, 2, 3};
    const TexturePicture given = {PictureCoder::vp9, ColourMatrix::bt601, true, 640, 480, {4096, 1, 65535}, coded};
    auto bytes = write_packet(write_texture_picture(given, {7, 6, 5, true}));
    htvm_texture_picture picture;
    ASSERT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size(), &picture, sizeof picture), HTVM_OK);
    EXPECT_EQ(picture.struct_size, sizeof picture);
    EXPECT_EQ(picture.coder, static_cast<std::uint32_t>(HTVM_PICTURE_VP9));
    EXPECT_EQ(picture.matrix, 6u);
    EXPECT_EQ(picture.full_range, 1u);
    EXPECT_EQ(picture.width, 640u);
    EXPECT_EQ(picture.height, 480u);
    EXPECT_EQ(picture.frame, 7u);
    EXPECT_EQ(picture.reference, 6u);
    EXPECT_EQ(picture.timestamp_us, 5);
    EXPECT_EQ(picture.gain_red, 4096u);
    EXPECT_EQ(picture.gain_green, 1u);
    EXPECT_EQ(picture.gain_blue, 65535u);
    ASSERT_EQ(picture.coded_bytes, coded.size());
    EXPECT_EQ(picture.coded, bytes.data() + bytes.size() - 4 - coded.size());
    EXPECT_TRUE(std::equal(coded.begin(), coded.end(), picture.coded));
    EXPECT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size() - 1, &picture, sizeof picture), HTVM_CORRUPT_STREAM);
    EXPECT_EQ(htvm_texture_picture_read(nullptr, 0, &picture, sizeof picture), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size(), nullptr, 0), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size(), &picture, 8), HTVM_BAD_INPUT);
    auto unknown = write_texture_picture(given, {7, 6, 5, true});
    unknown.payload[0] = 9;
    bytes = write_packet(unknown);
    EXPECT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size(), &picture, sizeof picture), HTVM_UNSUPPORTED);
    unknown.kind = PacketKind::audio;
    bytes = write_packet(unknown);
    EXPECT_EQ(htvm_texture_picture_read(bytes.data(), bytes.size(), &picture, sizeof picture), HTVM_CORRUPT_STREAM);
}

TEST(CInterface, CarriesSessionSceneAndMetadata) {
    htvm_encoder_options* options = nullptr;
    ASSERT_EQ(htvm_encoder_options_create(HTVM_PROFILE_TRACKED, nullptr, &options), HTVM_OK);
    EXPECT_EQ(htvm_encoder_options_set(options, "session", "4711"), HTVM_OK);
    EXPECT_EQ(htvm_encoder_options_set(options, "up", "-z"), HTVM_OK);
    EXPECT_EQ(htvm_encoder_options_set(options, "tracked.presence", "off"), HTVM_OK);  // a triangle has borders
    EXPECT_EQ(htvm_encoder_options_set_floor(options, 12.5), HTVM_OK);
    const int64_t shift[3] = {500000000, -1, 4649776000};
    EXPECT_EQ(htvm_encoder_options_set_global_shift(options, shift), HTVM_OK);
    EXPECT_EQ(htvm_encoder_options_set_global_shift(options, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_encoder_options_add_metadata(options, "title", "a walk"), HTVM_OK);
    EXPECT_EQ(htvm_encoder_options_add_metadata(options, nullptr, "a walk"), HTVM_BAD_INPUT);
    htvm_encoder* encoder = nullptr;
    ASSERT_EQ(htvm_encoder_create(options, &encoder, nullptr, 0), HTVM_OK);
    const float positions[] = {0, 0, 0, 100, 0, 0, 0, 100, 0};
    const std::uint32_t indices[] = {0, 1, 2};
    htvm_mesh mesh;
    htvm_mesh_init(&mesh, sizeof mesh);
    mesh.vertices = 3;
    mesh.triangles = 1;
    mesh.positions = positions;
    mesh.indices = indices;
    ASSERT_EQ(htvm_encoder_send_mesh(encoder, &mesh, nullptr, 0, 0), HTVM_OK);
    std::vector<std::uint8_t> packet(100000);
    std::size_t size = 0;
    ASSERT_EQ(htvm_encoder_receive_packet(encoder, packet.data(), packet.size(), &size), HTVM_OK);
    const auto decoder = make_decoder();
    ASSERT_EQ(htvm_decoder_send_packet(decoder.get(), packet.data(), size), HTVM_OK);
    EXPECT_EQ(htvm_decoder_receive_frame(decoder.get(), nullptr, 0), HTVM_AGAIN);
    htvm_sequence_info info;
    ASSERT_EQ(htvm_decoder_sequence(decoder.get(), &info, sizeof info), HTVM_OK);
    EXPECT_EQ(info.session, 4711u);
    EXPECT_EQ(info.sequence, 0u);
    EXPECT_EQ(info.stream_version, htvm_stream_version());
    EXPECT_EQ(info.up, std::uint32_t{HTVM_UP_MINUS_Z});
    EXPECT_EQ(info.floor_known, 1u);
    EXPECT_EQ(info.floor, 12.5);
    int64_t decoded_shift[3] = {};
    EXPECT_EQ(htvm_decoder_global_shift(decoder.get(), decoded_shift), HTVM_OK);
    EXPECT_TRUE(std::equal(shift, shift + 3, decoded_shift));
    EXPECT_EQ(htvm_decoder_global_shift(decoder.get(), nullptr), HTVM_BAD_INPUT);
    ASSERT_EQ(info.metadata, 1u);
    char key[256], value[4096];
    ASSERT_EQ(htvm_decoder_metadata(decoder.get(), 0, key, sizeof key, value, sizeof value), HTVM_OK);
    EXPECT_STREQ(key, "title");
    EXPECT_STREQ(value, "a walk");
    EXPECT_EQ(htvm_decoder_metadata(decoder.get(), 0, key, sizeof key, value, 6), HTVM_BUFFER_TOO_SMALL);
    EXPECT_EQ(htvm_decoder_metadata(decoder.get(), 1, key, sizeof key, value, sizeof value), HTVM_BAD_INPUT);
    htvm_encoder_destroy(encoder);
    EXPECT_EQ(htvm_encoder_options_add_metadata(options, "title", "\xff"), HTVM_OK);
    EXPECT_EQ(htvm_encoder_create(options, &encoder, nullptr, 0), HTVM_BAD_INPUT) << "not UTF-8";
    htvm_encoder_options_destroy(options);
}

// Joined streams: the numbers of the second start again, and are counted on.
TEST(CInterface, NumbersTheFramesOfAllSequences) {
    htvm_dependencies* dependencies = nullptr;
    ASSERT_EQ(htvm_dependencies_create(nullptr, &dependencies), HTVM_OK);
    std::uint32_t number = 99;
    EXPECT_EQ(htvm_dependencies_frame(dependencies, &number), HTVM_AGAIN);
    std::vector<std::uint32_t> numbers;
    for (const auto* coded : {&coded_grid(), &coded_person()})
        for (const auto& packet : coded->packets) {
            const auto bytes = write_packet(packet);
            htvm_packet_info info;
            ASSERT_EQ(htvm_packet_read(bytes.data(), bytes.size(), &info, sizeof info), HTVM_OK);
            ASSERT_EQ(htvm_dependencies_push(dependencies, &info, nullptr), HTVM_OK);
            const auto status = htvm_dependencies_frame(dependencies, &number);
            ASSERT_EQ(status, frame_type(packet.kind) ? HTVM_OK : HTVM_AGAIN);
            if (status == HTVM_OK) numbers.push_back(number);
        }
    EXPECT_EQ(numbers, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
    EXPECT_EQ(htvm_dependencies_frame(dependencies, nullptr), HTVM_BAD_INPUT);
    EXPECT_EQ(htvm_dependencies_frame(nullptr, &number), HTVM_BAD_INPUT);
    htvm_dependencies_destroy(dependencies);
}

TEST(CInterface, HasWordsForEveryStatus) {
    for (htvm_status status = HTVM_INTERNAL; status <= HTVM_END; ++status)
        EXPECT_STRNE(htvm_status_text(status), htvm_status_text(99)) << status;
    EXPECT_STRNE(htvm_status_text(99), "");
}

}  // namespace
}  // namespace htvm
