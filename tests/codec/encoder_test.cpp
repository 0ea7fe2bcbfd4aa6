#include "htvm/encoder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "codec/enhanced_options.h"
#include "codec/format/sequence.h"
#include "codec/test_sequences.h"
#include "codec/without_reason.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

void expect_refused(const EncoderOptions& options, const char* what) {
    const auto encoder = Encoder::create(options);
    ASSERT_FALSE(encoder.has_value()) << what;
    EXPECT_EQ(encoder.error().kind, ErrorKind::bad_input) << what;
    EXPECT_NE(encoder.error().message.find(what), std::string::npos) << encoder.error().message;
}

TEST(EncoderOptions, DefaultsAreLegal) { EXPECT_TRUE(Encoder::create({}).has_value()); }

// Numbers in the list are covered by OptionList.RangesEndWhereTheySay.
TEST(EncoderOptions, OutOfRangeIsRefusedAndNamed) {
    const auto with = [](const std::function<void(EncoderOptions&)>& change) {
        EncoderOptions options = test::enhanced_options();
        change(options);
        return options;
    };
    const double not_a_number = std::nan("");
    for (const int interval : {0, -1})
        expect_refused(with([&](auto& o) { o.key_interval = interval; }), "key_interval");
    for (const int m : {0, -1, 65})
        expect_refused(with([&](auto& o) { o.topology.nearest_vertices = m; }), "nearest_vertices");
    for (const int bits : {-1, 17}) expect_refused(with([&](auto& o) { o.lattice_bits = bits; }), "lattice_bits");
    expect_refused(with([](auto& o) { o.fps_numerator = 0; }), "fps_numerator");
    expect_refused(with([](auto& o) { o.fps_denominator = 0; }), "fps_denominator");
    expect_refused(with([](auto& o) { o.unit_micrometres = 0; }), "unit_micrometres");
    expect_refused(with([](auto& o) { o.skeleton.joint_names.resize(1025); }), "1024");
    expect_refused(with([](auto& o) { o.skeleton.bones.resize(1025); }), "1024");
    expect_refused(with([](auto& o) { o.skeleton.bones = {{0, 0}}; }), "joint");
    expect_refused(with([](auto& o) { o.radii = {1}; }), "radii");
    for (const double radius : {-1.0, 1e9, not_a_number})
        expect_refused(with([&](auto& o) {
                           o.skeleton = synth_skeleton();
                           o.radii.assign(o.skeleton.bones.size(), radius);
                       }),
                       "radius");
    expect_refused(with([](auto& o) {
                       o.intra_coder = draco_intra_coder();
                       o.intra_coder->number = 0;
                   }),
                   "intra coder");
    expect_refused(with([](auto& o) {
                       o.intra_coder = draco_intra_coder();
                       o.intra_coder->encode = nullptr;
                   }),
                   "intra coder");
    expect_refused(with([](auto& o) {
                       o.intra_coder = draco_intra_coder();
                       o.intra_coder->decode = nullptr;
                   }),
                   "intra coder");
}

TEST(QualitySteps, HalveAsPromised) {
    EXPECT_DOUBLE_EQ(quality_steps(0).geometry_step, 16);
    EXPECT_DOUBLE_EQ(quality_steps(50).geometry_step, 2);
    EXPECT_DOUBLE_EQ(quality_steps(100).geometry_step, 0.25);
    EXPECT_DOUBLE_EQ(quality_steps(0).colour_step, 32);
    EXPECT_NEAR(quality_steps(50).colour_step, 5.657, 1e-3);
    EXPECT_DOUBLE_EQ(quality_steps(100).colour_step, 1);
    EXPECT_EQ(quality_steps(-5).geometry_step, 16);
    EXPECT_EQ(quality_steps(500).geometry_step, 0.25);
}

// A frame that cannot be coded, among valid ones.
struct Fault {
    const char* message;
    std::function<void(SequenceFrame&)> make;
};

std::vector<Fault> faults() {
    const float not_a_number = std::nanf("");
    return {{"vertex 3", [=](auto& f) { f.mesh.positions[3][1] = not_a_number; }},
            {"vertex 5", [](auto& f) { f.mesh.positions[5][2] = 3e9f; }},
            {"triangle 2 names vertex", [](auto& f) { f.mesh.triangles[2][1] = 1u << 30; }},
            {"colours", [](auto& f) { f.mesh.colours.pop_back(); }},
            {"normals",
             [](auto& f) {
                 f.mesh.normals.push_back({0, 0, 1});
             }},
            {"texture coordinates",
             [](auto& f) {
                 f.mesh.texcoords.assign(1, {0, 0});
             }},
            {"normal that is not", [=](auto& f) { f.mesh.normals[0][0] = not_a_number; }},
            {"joint 4 is not finite", [](auto& f) { f.pose->joints[4][0] = std::nan(""); }},
            {"joint 4", [](auto& f) { f.pose->joints[4][0] = 1e12; }},
            {"the pose has", [](auto& f) { f.pose->joints.pop_back(); }},
            {"the pose has", [](auto& f) { f.pose->orientations.resize(1); }}};
}

EncoderOptions with_synthetic_skeleton() {
    EncoderOptions options = test::enhanced_options();
    options.skeleton = synth_skeleton();
    options.key_interval = 3;
    options.threads = 1;
    return options;
}

std::vector<std::uint8_t> drained(Encoder& encoder) {
    std::vector<std::uint8_t> out;
    while (auto packet = encoder.pull()) {
        const auto bytes = write_packet(*packet);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return out;
}

// Which of the decoded frames have normals, of a capture that has them.
std::vector<bool> frames_with_normals(EncoderOptions options) {
    auto encoder = Encoder::create(std::move(options));
    Decoder decoder;
    std::vector<bool> out;
    const auto sequence = synthetic(false, 3, 300);
    for (std::size_t t = 0; t < 3; ++t) {
        EXPECT_FALSE(sequence.frames[t].mesh.normals.empty());
        EXPECT_TRUE(encoder->push(sequence.frames[t].mesh, nullptr, static_cast<std::int64_t>(t) * 33333));
    }
    EXPECT_TRUE(encoder->finish());
    while (const auto packet = encoder->pull())
        if (const auto decoded = decoder.decode(*packet); decoded && *decoded)
            out.push_back(!(*decoded)->mesh.normals.empty());
    return out;
}

TEST(Encoder, LeavesCapturedNormalsOutWhereFramesBetweenIFramesCouldNotKeepThem) {
    EncoderOptions tracked;
    tracked.threads = 1;
    EXPECT_EQ(frames_with_normals(tracked), (std::vector<bool>{false, false, false}));
    tracked.normals = CapturedNormals::keep;
    EXPECT_TRUE(frames_with_normals(tracked)[0]);
    EncoderOptions topology = test::enhanced_options();
    topology.threads = 1;
    EXPECT_EQ(frames_with_normals(topology), (std::vector<bool>{true, true, true}));
    topology.normals = CapturedNormals::none;
    EXPECT_EQ(frames_with_normals(topology), (std::vector<bool>{false, false, false}));
}

TEST(Encoder, OfATrackedSurfaceTakesDoubledAndMixedTrianglesForTheSurfaceThatTheyAre) {
    const auto sequence = synthetic(false, 3, 800);
    const auto stream_of = [&](const std::function<void(Mesh&)>& change) {
        EncoderOptions options;
        options.threads = 1;
        auto encoder = Encoder::create(options);
        for (std::size_t t = 0; t < 3; ++t) {
            auto mesh = sequence.frames[t].mesh;
            change(mesh);
            EXPECT_TRUE(encoder->push(mesh, nullptr, static_cast<std::int64_t>(t) * 33333));
        }
        EXPECT_TRUE(encoder->finish());
        return drained(*encoder);
    };
    const auto turn = [](Triangle t) { return Triangle{t[0], t[2], t[1]}; };
    const auto clean = stream_of([](Mesh&) {});
    EXPECT_EQ(stream_of([&](Mesh& mesh) {
                  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
                      mesh.triangles[t] = turn(mesh.triangles[t]);
              }).size(),
              clean.size());
    const auto doubled = stream_of([&](Mesh& mesh) {
        const auto before = mesh.triangles;
        for (const auto& t : before) mesh.triangles.push_back(turn(t));
    });
    // The counts of the captured mesh in its frames are those of what is left.
    EXPECT_EQ(doubled.size(), clean.size());
}

TEST(Encoder, AFrameThatCannotBeCodedIsNamedAndTheStreamGoesOnAsIfItHadNotBeen) {
    const auto sequence = synthetic(true, 4, 300);
    std::vector<std::uint8_t> expected;
    {
        auto encoder = Encoder::create(with_synthetic_skeleton());
        for (int t = 0; t < 4; ++t)
            ASSERT_TRUE(encoder->push(sequence.frames[t].mesh, &*sequence.frames[t].pose, 1000 * (t + 1)).has_value());
        expected = drained(*encoder);
    }
    for (const auto& fault : faults())
        for (int at = 0; at < 4; ++at) {  // before the first frame, an EP-frame and the second I-frame
            SCOPED_TRACE(std::string(fault.message) + " at " + std::to_string(at));
            auto encoder = Encoder::create(with_synthetic_skeleton());
            for (int t = 0; t < 4; ++t) {
                if (t == at) {
                    auto broken = sequence.frames[0];
                    fault.make(broken);
                    const auto pushed = encoder->push(broken.mesh, &*broken.pose, 1000 * (t + 1));
                    ASSERT_FALSE(pushed.has_value());
                    EXPECT_EQ(pushed.error().kind, ErrorKind::bad_input);
                    // In the first frame, either the joint or the mesh as a whole may be reported first.
                    EXPECT_TRUE(at == 0 || pushed.error().message.find(fault.message) != std::string::npos)
                        << pushed.error().message;
                }
                ASSERT_TRUE(
                    encoder->push(sequence.frames[t].mesh, &*sequence.frames[t].pose, 1000 * (t + 1)).has_value());
            }
            EXPECT_EQ(drained(*encoder), expected);
        }
}

TEST(Encoder, TimestampsMustAscend) {
    auto encoder = Encoder::create({});
    const Mesh mesh = sequence_of(tfan_test::grid(3, 3), 1, none).frames[0].mesh;
    ASSERT_TRUE(encoder->push(mesh, nullptr, 100).has_value());
    for (const std::int64_t time : {std::int64_t{100}, std::int64_t{99}, std::numeric_limits<std::int64_t>::min()}) {
        const auto pushed = encoder->push(mesh, nullptr, time);
        ASSERT_FALSE(pushed.has_value());
        EXPECT_EQ(pushed.error().kind, ErrorKind::bad_input);
        EXPECT_NE(pushed.error().message.find("timestamps"), std::string::npos);
    }
    EXPECT_TRUE(encoder->push(mesh, nullptr, 101).has_value());
}

TEST(Encoder, AnyAscendingTimestampsAreLegal) {
    auto encoder = Encoder::create({});
    const Mesh mesh = sequence_of(tfan_test::grid(3, 3), 1, none).frames[0].mesh;
    ASSERT_TRUE(encoder->push(mesh, nullptr, std::numeric_limits<std::int64_t>::min(), true).has_value());
    ASSERT_TRUE(encoder->push(mesh, nullptr, std::numeric_limits<std::int64_t>::max(), true).has_value());
    encoder->finish();
    while (auto packet = encoder->pull()) {
        if (packet->kind != PacketKind::index) continue;
        const auto index = read_sequence_index(packet->payload);
        ASSERT_TRUE(index.has_value());
        EXPECT_EQ(index->at(1).timestamp_us, std::numeric_limits<std::int64_t>::max());
    }
}

TEST(Encoder, AFirstFrameWithoutItsPoseIsRefusedAndTheNextBegins) {
    const auto sequence = synthetic(true, 2, 300);
    auto encoder = Encoder::create(with_synthetic_skeleton());
    const auto pushed = encoder->push(sequence.frames[0].mesh, nullptr, 0);
    ASSERT_FALSE(pushed.has_value());
    EXPECT_NE(pushed.error().message.find("pose"), std::string::npos);
    EXPECT_FALSE(encoder->pull().has_value());
    EXPECT_TRUE(encoder->push(sequence.frames[1].mesh, &*sequence.frames[1].pose, 0).has_value());
    EXPECT_EQ(encoder->last_frame().frame, 0u);
}

TEST(Encoder, AnIntraFrameComesEveryKeyIntervalOrWhenForced) {
    const auto sequence = synthetic(false, 7, 300);
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 4;
    auto encoder = Encoder::create(options);
    std::vector<bool> intra;
    std::vector<std::uint32_t> references;
    for (int t = 0; t < 7; ++t) {
        ASSERT_TRUE(encoder->push(sequence.frames[t].mesh, nullptr, t, t == 2).has_value());
        intra.push_back(encoder->last_frame().type == FrameType::intra);
        references.push_back(encoder->last_frame().reference);
    }
    EXPECT_EQ(intra, (std::vector<bool>{true, false, true, false, false, false, true}));
    EXPECT_EQ(references, (std::vector<std::uint32_t>{0, 0, 2, 2, 2, 2, 6}));
}

TEST(Encoder, TheIndexSaysWhereTheIntraFramesAre) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 2;
    const auto coded = encode(synthetic(false, 5, 300), options);
    ASSERT_EQ(coded.packets.back().kind, PacketKind::index);
    const auto index = read_sequence_index(coded.packets.back().payload);
    ASSERT_TRUE(index.has_value());
    ASSERT_EQ(index->size(), 3u);
    for (const auto& entry : *index) {
        PacketReader reader;
        reader.push(std::span(coded.bytes).subspan(entry.offset));
        const auto packet = reader.pull();
        ASSERT_TRUE(packet.has_value());
        EXPECT_EQ(reader.damaged_bytes(), 0u);
        EXPECT_EQ(packet->kind, PacketKind::intra);
        EXPECT_EQ(packet->frame, entry.frame);
        EXPECT_EQ(packet->timestamp_us, entry.timestamp_us);
    }
}

TEST(Encoder, AfterFinishNothingMayBePushed) {
    auto encoder = Encoder::create({});
    const Mesh mesh = sequence_of(tfan_test::grid(3, 3), 1, none).frames[0].mesh;
    ASSERT_TRUE(encoder->push(mesh, nullptr, 0).has_value());
    encoder->finish();
    encoder->finish();
    const auto pushed = encoder->push(mesh, nullptr, 1);
    ASSERT_FALSE(pushed.has_value());
    EXPECT_EQ(pushed.error().kind, ErrorKind::bad_input);
    int indices = 0;
    while (auto packet = encoder->pull()) indices += packet->kind == PacketKind::index;
    EXPECT_EQ(indices, 1);
}

// Each I-frame by itself, with the frames that refer to it; but the first frame of a part says no reason.
TEST(Encoder, PartsThatBeginWithTheSameFrameAreThoseOfTheWhole) {
    const auto source = synthetic(true, 6, 300);
    const auto options = with_synthetic_skeleton();
    const auto whole = encode(source, options).packets;
    const auto frame_payloads = [](const std::vector<Packet>& packets) {
        std::vector<std::vector<std::uint8_t>> out;
        for (const auto& packet : packets)
            if (frame_type(packet.kind)) out.push_back(without_reason(packet.payload));
        return out;
    };
    const auto& first = source.frames[0];
    std::vector<Packet> parts;
    for (const std::size_t begin : {0u, 3u}) {
        auto encoder = Encoder::create(options);
        ASSERT_TRUE(encoder->begin(first.mesh, &*first.pose).has_value());
        for (std::size_t t = begin; t < begin + 3; ++t) {
            const auto& frame = source.frames[t];
            ASSERT_TRUE(encoder->push(frame.mesh, &*frame.pose, static_cast<std::int64_t>(t)).has_value());
        }
        while (auto packet = encoder->pull()) {
            if (packet->kind == PacketKind::sequence) {
                EXPECT_EQ(packet->payload, whole[0].payload);
            }
            parts.push_back(std::move(*packet));
        }
        EXPECT_FALSE(encoder->begin(first.mesh, &*first.pose).has_value()) << "after frames were pushed";
    }
    EXPECT_EQ(frame_payloads(parts), frame_payloads(whole));
}

TEST(Encoder, AnEmptySequenceHasNoPackets) {
    auto encoder = Encoder::create({});
    encoder->finish();
    EXPECT_FALSE(encoder->pull().has_value());
    EXPECT_TRUE(encoder->reconstruction().positions.empty());
}

TEST(Encoder, AnIntraCoderThatFailsCostsItsFrameAlone) {
    auto options = test::enhanced_options();
    options.key_interval = 1;
    int calls = 0;
    auto coder = draco_intra_coder();
    const auto encode_well = coder.encode;
    coder.encode = [&, encode_well](const LatticeMesh& mesh) -> Result<std::vector<std::uint8_t>> {
        if (++calls == 2) return fail(ErrorKind::unsupported, "not today");
        return encode_well(mesh);
    };
    options.intra_coder = coder;
    const auto coded = encode(synthetic(false, 3, 300), options);
    EXPECT_EQ(coded.errors, std::vector<std::string>{"not today"});
    DecoderOptions decoder;
    decoder.intra_coder = draco_intra_coder();
    const auto decoded = decode_packets(coded.packets, decoder);
    EXPECT_TRUE(decoded.errors.empty());
    ASSERT_EQ(decoded.frames.size(), 2u);
    for (std::size_t t = 0; t < 2; ++t) expect_same_mesh(decoded.frames[t].mesh, coded.reconstructions[t]);
}

}  // namespace
}  // namespace htvm::internal
