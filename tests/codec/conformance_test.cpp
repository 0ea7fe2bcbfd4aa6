// Streams that every version must decode to the same integers, each with a digest per frame: *.htvm and *.digests in
// tests/data/conformance. Those whose names have no number are of the stream's version 1, NAME_2 and NAME_3 of versions
// 2 and 3, and no encoder writes them any more; NAME_4 are of version 4, NAME_5 of 5, NAME_6 of 6,
// NAME_7 of 7, NAME_8 of 8. HTVM_WRITE_CONFORMANCE=1 in the environment rewrites all of versions 4 to 8 that are there;
// NAME_4 writes that one, whether it is there or not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "codec/enhanced_options.h"
#include "codec/filmed_sequences.h"
#include "codec/format/sequence.h"
#include "codec/levels_by_chance.h"
#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "codec/patches_by_chance.h"
#include "codec/presence_by_chance.h"
#include "codec/test_sequences.h"
#include "codec/tracked_sequences.h"
#include "core/bytes.h"
#include "core/crc32.h"
#include "htvm/audio.hpp"

namespace htvm::internal {
namespace {

using namespace test;
namespace fs = std::filesystem;

#ifdef HTVM_TEST_DATA
const fs::path folder = fs::path(HTVM_TEST_DATA) / "conformance";
#else
const fs::path folder;
#endif

void add_floats(ByteWriter& out, const auto& values) {
    for (const auto& value : values)
        for (const float c : value) out.u32(std::bit_cast<std::uint32_t>(c));
}

// CRC-32 of the decoded arrays, little-endian: positions (32-bit floats, mm), triangles (32-bit indices), colours
// (bytes), normals and texture coordinates (32-bit floats), one array after another.
std::uint32_t digest(const Mesh& mesh) {
    ByteWriter out;
    add_floats(out, mesh.positions);
    for (const auto& t : mesh.triangles)
        for (const auto v : t) out.u32(v);
    for (const auto& colour : mesh.colours) out.bytes(colour);
    add_floats(out, mesh.normals);
    add_floats(out, mesh.texcoords);
    return crc32(out.data());
}

std::string line_of(const DecodedFrame& frame) {
    const char letter = kind_of(frame.info.type).letter[0];
    char line[80];
    std::snprintf(line, sizeof line, "%u %c %zu %zu %08x", frame.info.frame, letter, frame.mesh.positions.size(),
                  frame.mesh.triangles.size(), digest(frame.mesh));
    return line;
}

// One line per frame: its number, its kind, its vertices, its triangles, its digest.
std::vector<std::string> digests(const std::vector<std::uint8_t>& bytes, bool prepares = false) {
    const auto decoded = decode_packets(read_packets(bytes, 1000), {}, prepares);
    for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
    std::vector<std::string> out;
    for (const auto& frame : decoded.frames) out.push_back(line_of(frame));
    return out;
}

std::vector<std::uint8_t> stream_in(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<std::string> lines_in(const fs::path& path) {
    std::ifstream in(path);
    std::vector<std::string> out;
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
}

// HTVM_WRITE_CONFORMANCE
std::string asked_for() {
    const char* name = std::getenv("HTVM_WRITE_CONFORMANCE");
    return name ? name : "";
}

void write_packets(const std::string& unnumbered, const std::vector<Packet>& packets) {
    const std::string name = unnumbered + "_" + std::to_string(read_sequence_header(packets[0].payload)->version);
    if (asked_for() != name && !(asked_for() == "1" && fs::exists(folder / (name + ".htvm")))) return;
    std::vector<std::uint8_t> bytes;
    for (const auto& packet : packets) {
        const auto more = write_packet(packet);
        bytes.insert(bytes.end(), more.begin(), more.end());
    }
    ASSERT_LE(bytes.size(), 40000u) << name << ": the repository holds small streams only";
    std::ofstream(folder / (name + ".htvm"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::ofstream text(folder / (name + ".digests"));
    for (const auto& line : digests(bytes)) text << line << "\n";
}

void write_stream(const std::string& name, const TestSequence& sequence, const EncoderOptions& options) {
    const auto coded = encode(sequence, options);
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    write_packets(name, coded.packets);
}

// P-frames, and EP-frames in which some bones are coded; at the end one with no bone, one with bones without any
// vertex, and one with vertices without any triangle.
void write_moving() {
    auto options = motion_based(40, 5);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 800;
    auto coded = encode(walking(5, 400), options);
    ASSERT_GE(frames_in_part(coded), 2u);
    ASSERT_GE(frames_of(coded, FrameType::predicted), 1u);
    coded.packets.pop_back();  // the index
    const auto model = std::find_if(coded.packets.rbegin(), coded.packets.rend(), is_in_part);
    ASSERT_NE(model, coded.packets.rend());
    const Packet last = *model;
    const auto add = [&](const std::optional<std::vector<std::uint8_t>>& bones) {
        auto payload = copy_of(*read_frame_payload(last.payload));
        payload.header.triangles = 0;
        for (const auto layer : {Layer::fans, Layer::distance_orders}) payload.set(layer, {});
        if (bones) {
            payload.set(Layer::coded_bones, *bones);
            payload.header.vertices = 0;
            for (const auto layer : {Layer::mapping, Layer::geometry, Layer::colour}) payload.set(layer, {});
        }
        Packet packet = last;
        packet.frame = coded.packets.back().frame + 1;
        packet.timestamp_us = coded.packets.back().timestamp_us + 33333;
        packet.payload = write_frame_payload(payload);
        coded.packets.push_back(std::move(packet));
    };
    add(std::vector<std::uint8_t>{0, 0});
    add(std::vector<std::uint8_t>{0x55, 0x15});
    add(std::nullopt);
    write_packets("moving", coded.packets);
}

// T-frames as the encoder writes them, and from version 4 on an I-frame of the tracked mesh.
void write_tracked() {
    EncoderOptions options = test::options_at_2_mm(Profile::tracked);
    options.profile = Profile::tracked;
    options.key_interval = 4;
    options.tracked.access_interval = 2;
    write_stream("tracked", horned_ball(7, never), options);
}

// T-frames on every awkward connectivity and on a person, moved at random: in the second sequence by nodes that are as
// close together as possible, in the third by few nodes and with fields of every kind.
void write_tracked_by_chance() {
    TestSequence awkward{"awkward", {}, {}};
    unsigned attributes = 0;
    for (const auto& shape : tfan_test::special_meshes())
        if (shape.vertex_count <= 80) awkward.frames.push_back(sequence_of(shape, 1, attributes++ % 8).frames[0]);
    awkward.frames.push_back(synthetic(false, 1, 150).frames[0]);
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    options.topology.merge_duplicates = false;
    options.geometry_step = 6;
    const auto intra = encode(awkward, options).packets;
    std::vector<Packet> packets;
    const auto add = [&](std::int32_t spacing, const ChanceMotion& motion) {
        const auto first = static_cast<std::uint32_t>(std::count_if(packets.begin(), packets.end(), is_frame));
        for (auto& packet : with_tracked_frames(intra, spacing, motion, first, first))
            packets.push_back(std::move(packet));
    };
    ChanceMotion motion;
    add(1500, motion);
    motion.fields.step = {200, 40, 40};
    motion.turn = 3000;
    add(1, motion);
    motion = {50, 1e6, 500000, 4000, {}};
    motion.fields.step = {64, 0, 20};
    motion.fields.turned = true;
    add(20000, motion);
    write_packets("tracked_by_chance", packets);
}

// What version 4 brought: TP-frames as the encoder writes them where tracking is lost.
void write_patched() {
    const auto coded = encode(horned_ball(5), patched_options());
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    ASSERT_GE(frames_of(coded, FrameType::patched), 1u);
    write_packets("patched", coded.packets);
}

// What version 5 brought: T-frames in groups of several lengths, after an I-frame, after a place to start, after an
// I-frame of the tracked mesh.
void write_grouped() {
    auto person = walking(14, 200, 20);
    for (auto& frame : person.frames) frame.mesh.texcoords.clear();  // another layout in each would make I-frames
    auto options = test::options_at_2_mm(Profile::tracked);
    options.tracked.group = 5;
    options.tracked.access_interval = 6;
    options.key_interval = 11;
    options.geometry_step = 4;
    write_stream("grouped", person, options);
}

// TP-frames with any patches on every awkward connectivity.
void write_patched_by_chance() {
    TestSequence awkward{"awkward", {}, {}};
    unsigned attributes = 0;
    for (const auto& shape : tfan_test::special_meshes())
        if (shape.vertex_count <= 60) awkward.frames.push_back(sequence_of(shape, 1, attributes++ % 4).frames[0]);
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    options.topology.merge_duplicates = false;
    options.geometry_step = 6;
    write_packets("patched_by_chance", with_patched_frames(encode(awkward, options).packets, 1500, {}, 7));
}

// Rare cases: meshes without vertices or triangles among others, attributes that come and go, all vertices at one
// point, the ends of the lattice, sizes that jump, many components.
void write_corner_cases() {
    TestSequence corners{"corner cases", {}, {}};
    for (const auto& sequence : awkward_sequences())
        for (const auto* wanted : {"attributes that come and go", "all vertices in one point", "many components",
                                   "as far out as the lattice goes", "empty frames between full ones",
                                   "another number of vertices in every frame", "isolated vertices"})
            if (sequence.name == wanted)
                corners.frames.insert(corners.frames.end(), sequence.frames.begin(), sequence.frames.end());
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 2;
    options.geometry_step = 8;
    options.colour_step = 40;
    write_stream("corner_cases", corners, options);
    options.key_interval = 1;
    options.topology.merge_duplicates = false;
    options.topology.nearest_vertices = 64;
    write_stream("corner_cases_intra", corners, options);
}

// Choices of the encoder that affect the decoder: the paper's, a fine lattice, steps that change from frame to frame.
void write_choices() {
    auto person = synthetic(true, 4, 500);
    for (auto& frame : person.frames) frame.mesh.normals.clear();
    EncoderOptions paper = test::options_at_2_mm(Profile::paper);
    paper.key_interval = 4;
    paper.topology.nearest_vertices = 8;
    write_stream("paper", person, paper);

    EncoderOptions fine = test::enhanced_options();
    fine.key_interval = 2;
    fine.geometry_step = 0.1;
    fine.colour_step = 1;
    fine.lattice_bits = 9;
    fine.unit_micrometres = 1000000;
    fine.topology.nearest_vertices = 1;
    fine.topology.weight_width = 1000;
    write_stream("fine_lattice", synthetic(true, 2, 300), fine);

    // EP-frames, whole and in part, with changing steps: the skeleton walks, and jumps.
    auto all = walking(6, 300, 20);
    for (const int later : {60, 61, 200}) all.frames.push_back(walking(1, 300, later).frames[0]);
    EncoderOptions rate = test::enhanced_options();
    rate.topology.frame_choice = FrameChoice::motion;
    rate.topology.predicted_below = 50;
    rate.topology.still_below = 40;
    rate.rate.bits_per_second = 600e3;
    write_stream("rate_controlled", all, rate);
}

// What version 2 brought: a header with everything, frames that nothing refers to, of both kinds, between those that
// are, a header that is repeated, sequences with a session and without, joined.
void write_sequences() {
    auto person = walking(6, 200, 20);
    for (auto& frame : person.frames) frame.mesh.texcoords.clear();
    person.frames[2].mesh = {};
    EncoderOptions options = test::options_at_2_mm(Profile::tracked);
    options.up = UpAxis::plus_y;
    options.floor = -12.5;
    options.metadata = {{"title", "a walk"}, {"rights", "\xc2\xa9 nobody"}, {"timecode", "10:00:00:12"}};
    auto packets = encode(person, options).packets;
    const auto header = packets[0];
    const auto join = [&](const std::vector<Packet>& more) { packets.insert(packets.end(), more.begin(), more.end()); };
    auto again = header;
    again.frame = 4;
    packets.insert(std::find_if(packets.begin(), packets.end(), [](const Packet& p) { return p.frame == 4; }), again);
    join(encode(person, options).packets);  // the same header: numbers that begin again begin a sequence
    options.session = 9007199254740991;
    options.tracked.references = TrackedReferences::intra;
    auto live = encode(person, options).packets;
    live.insert(live.begin() + 4, live[0]);  // sent again to newcomers
    join(live);
    options = test::enhanced_options();
    options.key_interval = 3;
    join(encode(person, options).packets);
    write_packets("sequences", packets);
}

// Frames with audio between them, silence of both numbers of channels, and with audio of a coder that nobody knows.
void write_audio_between() {
    const auto coded = encode(walking(3, 200, 20), test::options_at_2_mm(Profile::tracked));
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    std::vector<Packet> packets;
    for (const auto& packet : coded.packets) {
        packets.push_back(packet);
        if (!is_frame(packet)) continue;
        const bool first = packet.frame == 0, stereo = packet.frame == 1;
        AudioPacket audio{1, -256, 0, 0, {{0xf8, 0xff, 0xfe}, {0xf8, 0xff, 0xfe}}};
        if (stereo) audio = {2, 0, 0, 320, {{0xfc, 0xff, 0xfe}, {0xfc, 0xff, 0xfe}}};
        if (first) audio.skip_begin = 312;
        packets.push_back(htvm::write_audio(audio, packet.frame, packet.timestamp_us - (first ? 6500 : 0)));
        auto unknown = packets.back();
        unknown.payload[0] = 200;
        if (packet.frame == 2) packets.push_back(unknown);
    }
    write_packets("audio", packets);
}

// What version 6 brought: charts, of an I-frame, T-frames in groups, a patch and what follows it; the first frame shows
// vertices without triangles, too.
void write_charts() {
    auto options = patched_options();
    options.texture = {TextureLayout::charts, 256, 192};
    options.tracked.group = 2;
    auto ball = horned_ball(7, 3);
    auto& first = ball.frames[0].mesh;
    first.positions.push_back({0, 500, 0});
    first.colours.push_back({1, 2, 3});
    write_stream("charts", ball, options);
}

// I- and TP-frames that say why they were sent, the last of them for a reason that nobody knows.
void write_reasons() {
    auto options = patched_options();
    options.key_interval = 4;
    auto packets = encode(horned_ball(9), options).packets;
    const auto last = std::find_if(packets.rbegin(), packets.rend(),
                                   [](const Packet& packet) { return packet.kind == PacketKind::intra; });
    ASSERT_EQ(last->frame, 8u);
    auto payload = copy_of(*read_frame_payload(last->payload));
    payload.set(Layer::reason, {200});
    last->payload = write_frame_payload(payload);
    packets.pop_back();  // the index, which tells where packets lie
    write_packets("reasons", packets);
}

// What version 7 brought: frames that say what is there. Of a person with colours and normals, of an open surface with
// neither, and of meshes without vertices or triangles.
void write_presence() {
    TestSequence meshes{"presence", {}, {}};
    auto person = synthetic(false, 1, 150).frames[0];
    person.mesh.texcoords.clear();
    meshes.frames.push_back(person);
    meshes.frames.push_back(sequence_of(tfan_test::grid(11, 9), 1, none).frames[0]);
    for (const auto& shape : tfan_test::special_meshes())
        if (shape.name == "no vertex" || shape.name == "isolated vertices" || shape.name == "three at an edge")
            meshes.frames.push_back(sequence_of(shape, 1, colours).frames[0]);
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    options.topology.merge_duplicates = false;
    options.geometry_step = 6;
    ChanceMotion motion;
    motion.fields.step = {64, 20, 20};
    write_packets("presence", with_presence(encode(meshes, options).packets, 1500, motion, 7));
}

// A person whose elbow folds, so that a part is patched; large enough for levels to pay.
CodedSequence person_in_levels(const StreamTexture& texture) {
    auto person = walking(3, 6000, 50);
    for (auto& frame : person.frames) frame.mesh.texcoords.clear();
    auto options = default_options(Profile::tracked);
    options.tracked.levels = ReferenceLevels::on;
    options.texture = texture;
    auto coded = encode(person, options);
    EXPECT_TRUE(coded.errors.empty()) << coded.errors[0];
    EXPECT_GE(frames_of(coded, FrameType::patched), 1u);
    EXPECT_EQ(read_frame_payload(coded.packets[1].payload)->header.intra_coder, intra_coder_levels);
    return coded;
}

// I-frames with levels as the encoder writes them, and T- and TP-frames that are shown with detail.
void write_levels() { write_packets("levels", person_in_levels({}).packets); }

// The same with charts, in which the detail lies on the reference's triangles; and a patch, behind which a part of it
// stays.
void write_leveled_charts() {
    const auto coded = person_in_levels({TextureLayout::charts, 768, 512});
    ASSERT_TRUE(read_frame_payload(coded.packets[1].payload)->has(Layer::charts));
    write_packets("leveled_charts", coded.packets);
}

// I-frames with any levels of any mesh, and behind each what may follow it: T-, TP- and P-frames and groups, of which
// a part is there.
void write_levels_by_chance() {
    TestSequence meshes{"levels", {}, {}};
    meshes.frames.push_back(synthetic(false, 1, 60).frames[0]);
    meshes.frames.push_back(sequence_of(tfan_test::grid(5, 4), 1, none).frames[0]);
    for (const auto& shape : tfan_test::special_meshes())
        if (shape.name == "no vertex" || shape.name == "isolated vertices" || shape.name == "three at an edge")
            meshes.frames.push_back(sequence_of(shape, 1, colours).frames[0]);
    EncoderOptions encoder_options = test::enhanced_options();
    encoder_options.key_interval = 1;
    encoder_options.topology.merge_duplicates = false;
    encoder_options.geometry_step = 6;
    auto packets = encode(meshes, encoder_options).packets;
    std::mt19937 random(5);
    unsigned number = 0;
    for (auto& packet : packets) {
        if (packet.kind != PacketKind::intra) continue;
        const auto plain = *read_frame_payload(packet.payload);
        const auto base = *decode_intra_frame(plain, nullptr);
        LeveledByChanceOptions options;
        options.levels.depth = {1 + number % 3, 500};
        options.levels.step = 128;
        options.levels.rules.fill({number % 3, 8 - number % 2});
        options.levels.rules[1] = {8, 0};
        options.levels.rounded = number % 2 == 0 ? 40 : 0;
        options.referred = number % 2;
        options.colours = number != 1;
        options.normals = number % 3 == 0;
        auto coded = leveled_by_chance(base, options, random);
        ++number;
        ASSERT_TRUE(coded);
        coded->payload.header.source_vertices = plain.header.source_vertices;
        coded->payload.header.source_triangles = plain.header.source_triangles;
        coded->payload.set(Layer::pose, {plain.of(Layer::pose).begin(), plain.of(Layer::pose).end()});
        packet.payload = write_frame_payload(coded->payload);
    }
    ChanceMotion motion;
    motion.fields.step = {64, 20, 20};
    write_packets("levels_by_chance", with_presence(packets, 1500, motion, 7));
}

// One camera's film, of a camera that moves in some frames: T-frames in groups and alone, a patch, frames that refer to
// the reference; with levels of detail.
void write_projection() {
    auto sequence = filmed(horned_ball(6, 4));
    const auto moving = filmed(horned_ball(9, 4), 15);
    sequence.frames.insert(sequence.frames.end(), moving.frames.begin() + 6, moving.frames.end());
    auto options = filmed_options();
    options.tracked.group = 2;
    write_stream("projection", sequence, options);
}

void write_all() {
    fs::create_directories(folder);
    write_levels();
    write_leveled_charts();
    write_levels_by_chance();
    write_audio_between();
    write_corner_cases();
    write_choices();
    write_moving();
    write_tracked();
    write_tracked_by_chance();
    write_patched();
    write_patched_by_chance();
    write_grouped();
    write_charts();
    write_presence();
    write_projection();
    write_reasons();
    write_sequences();

    TestSequence spokes{"awkward, moving", {}, {}};
    for (const auto& shape : tfan_test::special_meshes()) {
        if (shape.vertex_count < 4 || shape.vertex_count > 200) continue;
        for (auto& frame : sequence_of(shape, 3, none).frames) spokes.frames.push_back(std::move(frame));
    }
    spokes = with_spokes(std::move(spokes));
    auto moving = motion_based(40, 3);
    moving.topology.nearest_vertices = 5;
    write_stream("awkward_moving", spokes, moving);

    EncoderOptions options = test::enhanced_options();
    options.key_interval = 3;
    auto person = synthetic(true, 5, 800);
    for (auto& frame : person.frames) frame.mesh.normals.clear();
    write_stream("person", person, options);

    auto attributes = synthetic(false, 4, 400);
    for (std::size_t t = 0; t < attributes.frames.size(); ++t) {
        auto& mesh = attributes.frames[t].mesh;
        const auto captured_colours = mesh.colours;
        const auto captured_normals = mesh.normals;
        give_attributes(mesh, all, static_cast<unsigned>(t));
        mesh.colours = captured_colours;
        mesh.normals = captured_normals;
    }
    write_stream("no_skeleton_all_attributes", attributes, options);

    // Every awkward connectivity, one after another, each coded twice: an I-frame and an EP-frame.
    TestSequence awkward{"awkward", {}, {}};
    for (const auto& shape : tfan_test::special_meshes()) {
        if (shape.vertex_count > 200) continue;
        for (auto& frame : sequence_of(shape, 2, none).frames) awkward.frames.push_back(std::move(frame));
    }
    options.key_interval = 2;
    options.topology.merge_duplicates = false;
    options.topology.nearest_vertices = 3;
    write_stream("awkward", awkward, options);
}

TEST(Conformance, StoredStreamsDecodeToTheirDigests) {
    if (folder.empty()) GTEST_SKIP() << "built without HTVM_TEST_DATA";
    if (!asked_for().empty()) write_all();
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
    int streams = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".htvm") continue;
        SCOPED_TRACE(entry.path().filename().string());
        ++streams;
        const auto expected = lines_in(fs::path(entry.path()).replace_extension(".digests"));
        EXPECT_EQ(digests(stream_in(entry.path())), expected);
        EXPECT_EQ(digests(stream_in(entry.path()), true), expected) << "prepared between frames";
    }
    EXPECT_GE(streams, 16);
}

}  // namespace
}  // namespace htvm::internal
