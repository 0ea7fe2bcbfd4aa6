// T-frames: the I-frame's mesh laid on the captured surface.
#include "codec/tracked/tracked_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "codec/encoder/tracked/node_motion.h"
#include "codec/encoder/tracked/tracked_frame.h"
#include "codec/enhanced_options.h"
#include "codec/format/sequence.h"
#include "codec/hostile_bytes.h"
#include "codec/intra/intra_frame.h"
#include "codec/reference/quantiser_cells.h"
#include "codec/reference/reference.h"
#include "codec/test_sequences.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;

EncoderOptions tracked(TrackedReferences references = TrackedReferences::previous) {
    EncoderOptions options = default_options(Profile::tracked);
    options.profile = Profile::tracked;
    options.tracked.references = references;
    options.key_interval = 6;
    return options;
}

// Frames a thirtieth of a second apart, with colours and normals.
TestSequence walking(int frames, bool skeleton, int vertices = 1500) {
    SynthOptions options;
    options.vertices = vertices;
    options.normals = true;
    TestSequence out{"walking", {}, {}};
    if (skeleton) out.skeleton = synth_skeleton();
    for (int t = 0; t < frames; ++t) {
        auto frame = synth_frame(options, 50 + t);
        out.frames.push_back({std::move(frame.mesh), {}});
        if (skeleton) out.frames.back().pose = std::move(frame.pose);
    }
    return out;
}

std::size_t frames_of(const CodedSequence& coded, FrameType type) {
    return static_cast<std::size_t>(std::count_if(coded.infos.begin(), coded.infos.end(),
                                                  [&](const FrameInfo& info) { return info.type == type; }));
}

double surface_error(const Mesh& a, const Mesh& b) {
    return surface_errors({a.positions, a.triangles, {}}, {b.positions, b.triangles, {}}).geometry_rms;
}

TEST(TrackedFrames, KeepTheConnectivityOfTheirIntraFrame) {
    const auto coded = encode(walking(5, true), tracked());
    ASSERT_EQ(frames_of(coded, FrameType::tracked), 4u);
    for (const auto& mesh : coded.reconstructions) EXPECT_EQ(mesh.triangles, coded.reconstructions[0].triangles);
}

TEST(TrackedFrames, HaveASimplifiedIntraFrameUnlessToldNotTo) {
    const auto sequence = walking(2, true, 6000);
    auto options = tracked();
    options.tracked.levels = ReferenceLevels::off;
    const auto simplified = encode(sequence, options);
    options.tracked.simplify = 0;
    const auto whole = encode(sequence, options);
    const auto captured = sequence.frames[0].mesh.positions.size();
    EXPECT_EQ(whole.infos[0].vertices, captured);
    EXPECT_LT(simplified.infos[0].vertices, captured);
    EXPECT_EQ(simplified.infos[0].source_vertices, captured);
    EXPECT_EQ(simplified.infos[0].source_triangles, sequence.frames[0].mesh.triangles.size());
}

TEST(TrackedFrames, TakeAFractionOfTheBitsForTheSameSurface) {
    for (const bool skeleton : {false, true}) {
        const auto sequence = walking(5, skeleton);
        const auto coded = encode(sequence, tracked());
        const auto enhanced = encode(sequence, test::enhanced_options());
        for (std::size_t t = 1; t < 5; ++t) {
            EXPECT_EQ(coded.infos[t].type, FrameType::tracked);
            EXPECT_LT(coded.infos[t].bytes.total() * 2, enhanced.infos[t].bytes.total());
            // With 30 mm between vertices and 1.5 mm of noise in every frame; consecutive frames are about 30 mm apart.
            EXPECT_LT(surface_error(coded.reconstructions[t], sequence.frames[t].mesh), 4);
            EXPECT_GT(surface_error(coded.reconstructions[0], sequence.frames[t].mesh), 4);
        }
    }
}

TEST(TrackedFrames, DecodeToWhatTheEncoderSaysForAnyNumberOfThreads) {
    auto sequences = awkward_sequences();
    sequences.push_back(walking(8, true));
    sequences.push_back(walking(4, false));
    for (const auto& sequence : sequences) {
        SCOPED_TRACE(sequence.name);
        for (const auto references : {TrackedReferences::intra, TrackedReferences::previous}) {
            auto options = tracked(references);
            options.threads = 1;
            const auto coded = encode(sequence, options);
            options.threads = 3;
            EXPECT_EQ(encode(sequence, options).bytes, coded.bytes);
            for (const unsigned threads : {1u, 4u}) {
                DecoderOptions decoder;
                decoder.threads = threads;
                const auto decoded = decode_packets(read_packets(coded.bytes, 1237), decoder);
                for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
                ASSERT_EQ(decoded.frames.size(), coded.reconstructions.size());
                for (std::size_t t = 0; t < decoded.frames.size(); ++t)
                    expect_same_mesh(decoded.frames[t].mesh, coded.reconstructions[t]);
            }
        }
    }
}

TEST(TrackedFrames, OfIntraReferencesMayAnyBeLost) {
    const auto coded = encode(walking(4, true, 800), tracked(TrackedReferences::intra));
    ASSERT_EQ(frames_of(coded, FrameType::tracked), 3u);
    for (std::size_t lost = 0; lost < coded.packets.size(); ++lost) {
        if (coded.packets[lost].kind != PacketKind::tracked) continue;
        auto packets = coded.packets;
        packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(lost));
        const auto decoded = decode_packets(packets);
        EXPECT_TRUE(decoded.errors.empty());
        ASSERT_EQ(decoded.frames.size(), 3u);
        for (const auto& frame : decoded.frames) expect_same_mesh(frame.mesh, coded.reconstructions[frame.info.frame]);
    }
}

TEST(TrackedFrames, OfTheFrameBeforeAreLostUntilTheNextIntraFrame) {
    const auto coded = encode(walking(8, true, 800), tracked());
    auto packets = coded.packets;
    std::erase_if(packets,
                  [](const Packet& packet) { return packet.kind == PacketKind::tracked && packet.frame == 2; });
    const auto decoded = decode_packets(packets);
    std::vector<std::uint32_t> shown;
    for (const auto& frame : decoded.frames) {
        shown.push_back(frame.info.frame);
        expect_same_mesh(frame.mesh, coded.reconstructions[frame.info.frame]);
    }
    EXPECT_EQ(shown, (std::vector<std::uint32_t>{0, 1, 6, 7}));
    ASSERT_EQ(decoded.errors.size(), 3u);
    EXPECT_NE(decoded.errors[0].message.find("frame 2"), std::string::npos) << decoded.errors[0].message;
}

TEST(TrackedFrames, ThatAreLostAreConcealedByTheLastOne) {
    const auto coded = encode(walking(3, true, 800), tracked());
    Decoder decoder;
    for (const auto& packet : coded.packets) ASSERT_TRUE(decoder.decode_copy(packet).has_value());
    const auto stand_in = decoder.conceal_copy(3, 0);
    ASSERT_TRUE(stand_in.has_value());
    EXPECT_TRUE(stand_in->concealed);
    expect_same_mesh(stand_in->mesh, coded.reconstructions[2]);
}

TEST(TrackedFrames, GiveWayToAnIntraFrameWhereTheSurfaceIsAnother) {
    auto sequence = walking(4, false);
    for (std::size_t t = 2; t < 4; ++t) {  // another person stands next to the first
        auto& mesh = sequence.frames[t].mesh;
        const auto one = mesh;
        for (const auto& p : one.positions) mesh.positions.push_back({p[0] + 1500, p[1], p[2]});
        for (const auto& tri : one.triangles) {
            const auto n = static_cast<std::uint32_t>(one.positions.size());
            mesh.triangles.push_back({tri[0] + n, tri[1] + n, tri[2] + n});
        }
        mesh.colours.insert(mesh.colours.end(), one.colours.begin(), one.colours.end());
        mesh.normals.insert(mesh.normals.end(), one.normals.begin(), one.normals.end());
    }
    const auto coded = encode(sequence, tracked());
    std::vector<FrameType> types;
    for (const auto& info : coded.infos) types.push_back(info.type);
    EXPECT_EQ(types, (std::vector{FrameType::intra, FrameType::tracked, FrameType::intra, FrameType::tracked}));
}

// The first two frames of a stream, an I-frame and a T-frame that refers to it, in the form in which the decoder
// processes them.
struct FirstTrackedFrame {
    NodeReference reference;
    std::vector<std::uint8_t> payload;
};

FirstTrackedFrame first_tracked_frame() {
    const auto coded = encode(walking(2, true, 300), tracked());
    const auto header = read_sequence_header(coded.packets[0].payload).value();
    const auto intra = read_frame_payload(coded.packets[1].payload).value();
    auto mesh = decode_intra_frame(intra, nullptr).value();
    smooth_as_shown(mesh, static_cast<std::int32_t>(intra.header.geometry_step), false, header);
    auto reference = make_node_reference(mesh, header.node_spacing, 1).value();
    reference.captured = {intra.header.source_vertices, intra.header.source_triangles};
    return {std::move(reference), coded.packets[2].payload};
}

void expect_on_lattice(const DecodedTrackedFrame& frame, const NodeReference& reference) {
    ASSERT_EQ(frame.positions.size(), reference.mesh.positions.size());
    for (const auto p : frame.positions) ASSERT_TRUE(on_lattice(p)) << p.x << " " << p.y << " " << p.z;
}

TEST(TrackedFrames, ThatAreDamagedAreRefusedOrStayWithinTheLattice) {
    const auto [reference, whole] = first_tracked_frame();
    std::mt19937 random(5);
    int decoded = 0, refused = 0;
    for (int i = 0; i < 300; ++i) {
        auto damaged = whole;
        auto& byte = damaged[below(random, static_cast<std::uint32_t>(damaged.size()))];
        byte = static_cast<std::uint8_t>(byte ^ (1u << below(random, 8)));
        if (i % 3 == 0) damaged.resize(below(random, static_cast<std::uint32_t>(damaged.size())));
        DecodedTrackedFrame frame;
        const bool good = decode_tracked_frame(damaged, reference, nullptr, {}, frame).has_value();
        ++(good ? decoded : refused);
        if (!good) continue;
        expect_on_lattice(frame, reference);
        EXPECT_LE(frame.shares.total(), damaged.size());
    }
    EXPECT_GT(decoded, 0);
    EXPECT_GT(refused, 0);
}

// A run that is cut off goes on as zeros: where these happen to say that nothing more differs, it is a whole one.
TEST(TrackedFrames, ThatEndEarlyAreRefusedButForFewByChance) {
    const auto [reference, whole] = first_tracked_frame();
    DecodedTrackedFrame frame;
    EXPECT_TRUE(decode_tracked_frame(whole, reference, nullptr, {}, frame).has_value());
    std::size_t cuts = 0, taken = 0;
    // Four bytes are read ahead, and four zeros taken for what an encoder cut off.
    for (std::size_t size = 0; size + 8 < whole.size(); size += 5, ++cuts)
        if (decode_tracked_frame(std::span(whole).first(size), reference, nullptr, {}, frame)) ++taken;
    EXPECT_GT(cuts, 100u);
    EXPECT_LE(20 * taken, cuts);
}

// A frame by chance, or one of which nothing but the colours changes.
TEST(TrackedFrames, DecodeToTheSameWithTheColoursInARunOfTheirOwn) {
    const auto reference = first_tracked_frame().reference;
    std::mt19937 random(6);
    for (const bool still : {false, true}) {
        std::vector<QuantisedTransform> wanted(reference.graph.pivots.size());
        std::vector<std::int32_t> displacement, colour;
        for (std::size_t v = 0; v < reference.mesh.positions.size(); ++v) {
            displacement.push_back(still ? 0 : static_cast<std::int32_t>(below(random, 100)));
            for (int c = 0; c < 3; ++c) colour.push_back(static_cast<std::int32_t>(below(random, 60)) - 30);
        }
        const auto motion = encode_node_motion(wanted, reference.graph, {}, {});
        const auto moved = encode_field(reference.hierarchy, displacement, 1).value();
        const auto recoloured = encode_field(reference.hierarchy, colour, 3).value();
        TrackedHead head;
        head.motion = NodeMotionOptions{}.steps;
        head.displacement = moved.steps;
        head.colour = recoloured.steps;
        const auto write = [&](std::size_t least_run) {
            return write_tracked_runs(head, {nullptr, reference.captured, true},
                                      {motion.decisions, moved.decisions, &recoloured.decisions}, nullptr, least_run);
        };
        const auto together = write(1 << 20);
        EXPECT_EQ(head.colour_run, 0u);
        const auto apart = write(100);
        EXPECT_GT(head.colour_run, 100u);
        EXPECT_NEAR(static_cast<double>(apart.payload.size()), static_cast<double>(together.payload.size()), 8);
        DecodedTrackedFrame one, other;
        ASSERT_TRUE(decode_tracked_frame(together.payload, reference, nullptr, {}, one).has_value());
        const ThreadPool two(2);
        for (const Threads threads : {Threads{}, two.threads()}) {
            ASSERT_TRUE(decode_tracked_frame(apart.payload, reference, nullptr, threads, other).has_value());
            EXPECT_EQ(other.positions, one.positions);
            EXPECT_EQ(other.colours, one.colours);
            EXPECT_EQ(other.shares.of_layer, apart.shares.of_layer);
            EXPECT_EQ(other.shares[Layer::colour], head.colour_run);
        }
        const std::span<const std::uint8_t> bytes = apart.payload;
        EXPECT_FALSE(decode_tracked_frame(bytes.first(20), reference, nullptr, {}, other).has_value());
    }
}

TEST(TrackedFrames, WhoseColoursWouldBeginWithinTheHeadAreRefused) {
    const auto reference = first_tracked_frame().reference;
    const KnownOfHead known{nullptr, reference.captured, true};
    TrackedHead head;
    head.captured = reference.captured;
    for (head.colour_run = 94; head.colour_run < 200; ++head.colour_run) {
        RangeEncoder encoder;
        write_tracked_head(encoder, head, known);
        auto payload = encoder.finish();
        payload.resize(100);
        DecodedTrackedFrame frame;
        const auto refused = decode_tracked_frame(payload, reference, nullptr, {}, frame);
        ASSERT_FALSE(refused.has_value());
        EXPECT_EQ(refused.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(TrackedFrames, HaveTheSameSharesAndCountsInTheEncoderAndTheDecoderWhichAddUp) {
    for (const auto references : {TrackedReferences::intra, TrackedReferences::previous}) {
        auto sequence = walking(4, false, 800);
        for (auto& frame : sequence.frames)
            if (references == TrackedReferences::intra) frame.mesh.colours.clear();
        const auto coded = encode(sequence, tracked(references));
        Decoder decoder;
        std::size_t at = 0;
        for (const auto& packet : coded.packets) {
            const auto frame = decoder.decode_copy(packet);
            ASSERT_TRUE(frame.has_value());
            if (!*frame) continue;
            const auto& here = (*frame)->info;
            const auto& there = coded.infos[at];
            EXPECT_EQ(here.bytes.of_layer, there.bytes.of_layer);
            EXPECT_EQ(here.bytes.total(), packet.payload.size() + packet_overhead);
            EXPECT_EQ(there.bytes.total(), packet.payload.size() + packet_overhead);
            EXPECT_EQ(here.source_vertices, sequence.frames[at].mesh.positions.size());
            EXPECT_EQ(here.source_triangles, sequence.frames[at].mesh.triangles.size());
            EXPECT_EQ(there.source_vertices, here.source_vertices);
            if (here.type == FrameType::tracked) {
                EXPECT_LE(here.bytes.overhead, packet_overhead + 16);
                EXPECT_GT(here.bytes[Layer::transforms], 0u);
                EXPECT_GT(here.bytes[Layer::geometry], 0u);
                EXPECT_EQ(here.bytes[Layer::colour] > 0, references == TrackedReferences::previous);
            }
            ++at;
        }
        EXPECT_EQ(at, 4u);
    }
}

TEST(TrackedFrames, ThatMoveBeyondTheLatticeEndAtItsEdge) {
    const auto reference = first_tracked_frame().reference;
    NodeMotionOptions options;
    options.steps.shift_exponent = 20;
    const std::vector<QuantisedTransform> far(reference.graph.pivots.size(),
                                              {{}, {2 * lattice_limit, -2 * lattice_limit, 0}});
    const auto moved = moved_by_nodes(reference, encode_node_motion(far, reference.graph, {}, options).transforms, {});
    for (const auto p : moved) {
        EXPECT_EQ(p.x, lattice_limit);
        EXPECT_EQ(p.y, -lattice_limit);
    }
}

TEST(SmoothedWithinCells, MovesNoCoordinateByMoreThanHalfAStep) {
    const auto mesh = tfan_test::grid(8, 8);
    std::mt19937 random(3);
    std::vector<LatticePoint> positions;
    for (int k = 0; k < 81; ++k)
        positions.push_back({between(random, -900, 900), between(random, -900, 900), between(random, -900, 900)});
    for (const int step : {1, 7, 64, 100000}) {
        const auto smooth = smoothed_within_cells(positions, mesh.triangles, {step});
        ASSERT_EQ(smooth.size(), positions.size());
        for (std::size_t v = 0; v < positions.size(); ++v) {
            EXPECT_LE(std::abs(smooth[v].x - positions[v].x), step / 2);
            EXPECT_LE(std::abs(smooth[v].y - positions[v].y), step / 2);
            EXPECT_LE(std::abs(smooth[v].z - positions[v].z), step / 2);
        }
    }
    EXPECT_EQ(smoothed_within_cells(positions, {}, {64}), positions);
}

TEST(SmoothedWithinCells, MovesWhatIsNotSettledAsIfNothingWere) {
    const auto mesh = tfan_test::grid(8, 8);
    std::mt19937 random(4);
    std::vector<LatticePoint> positions;
    for (int k = 0; k < 81; ++k)
        positions.push_back({between(random, -900, 900), between(random, -900, 900), between(random, -900, 900)});
    const auto all = smoothed_within_cells(positions, mesh.triangles, {64});
    for (const std::uint32_t settled : {1u, 40u, 80u, 81u}) {
        auto expected = all;
        std::copy_n(positions.begin(), settled, expected.begin());
        EXPECT_EQ(smoothed_within_cells(positions, mesh.triangles, {.step = 64, .settled = settled}), expected);
    }
}

TEST(SmoothedWithinCells, TakesAnEighthOffWhatBendsMoreThanTheNeighboursDo) {
    // The hub of four triangles stands 40 above its rim, whose vertices' neighbours are 20 above them.
    const std::vector<LatticePoint> positions = {{0, 0, 40}, {100, 0, 0}, {0, 100, 0}, {-100, 0, 0}, {0, -100, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
    EXPECT_EQ(smoothed_within_cells(positions, triangles, {64})[0], (LatticePoint{0, 0, 32}));
    EXPECT_EQ(smoothed_within_cells(positions, triangles, {10})[0], (LatticePoint{0, 0, 35}));
    EXPECT_EQ(smoothed_within_cells(positions, triangles, {.step = 64, .settled = 1})[0], positions[0]);
    EXPECT_EQ(averaged_within_cells(positions, triangles, 64)[0], (LatticePoint{0, 0, 20}));
    EXPECT_EQ(averaged_within_cells(positions, triangles, 10)[0], (LatticePoint{0, 0, 35}));
}

TEST(SmoothedWithinCells, LeavesARoundSurfaceAsItIs) {
    // A trough: all vertices inside bend alike.
    const auto mesh = tfan_test::grid(9, 9);
    std::vector<LatticePoint> positions;
    for (int k = 0; k < 81; ++k) positions.push_back({100 * (k % 9), 100 * (k / 9), 10 * (k % 9 - 4) * (k % 9 - 4)});
    const auto smooth = smoothed_within_cells(positions, mesh.triangles, {64});
    const auto averaged = averaged_within_cells(positions, mesh.triangles, 64);
    for (const int k : {20, 30, 40, 50, 60}) {  // two rings from the border
        EXPECT_EQ(smooth[static_cast<std::size_t>(k)], positions[static_cast<std::size_t>(k)]);
        EXPECT_NE(averaged[static_cast<std::size_t>(k)], positions[static_cast<std::size_t>(k)]);
    }
}

TEST(SmoothedWithinCells, VerticesAtASeamMoveAsOne) {
    // Two triangles whose common side was cut.
    const std::vector<LatticePoint> positions = {{0, 0, 0},  {90, 0, 0},  {0, 90, 31},
                                                 {90, 0, 0}, {0, 90, 31}, {99, 99, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 5, 4}};
    const auto smooth = smoothed_within_cells(positions, triangles, {.step = 64, .at_seams = true});
    EXPECT_EQ(smooth[1], smooth[3]);
    EXPECT_EQ(smooth[2], smooth[4]);
    EXPECT_NE(smooth[2], positions[2]);
    const auto apart = smoothed_within_cells(positions, triangles, {.step = 64});
    EXPECT_NE(apart[2], apart[4]);
}

// Each node has some of the lower ones as neighbours; some surfaces have no normal.
NodeGraph any_graph(std::mt19937& random, std::size_t nodes) {
    NodeGraph out;
    for (std::uint32_t i = 0; i < nodes; ++i) {
        out.pivots.push_back(
            {between(random, -9999, 9999), between(random, -9999, 9999), between(random, -9999, 9999)});
        auto& lower = out.lower.emplace_back();
        for (std::uint32_t other = 0; other < i; ++other)
            if (below(random, i) < 3) lower.push_back(other);
        Vector3d normal{};
        for (auto& c : normal) c = between(random, -1, 1);
        const double length = std::hypot(normal[0], normal[1], normal[2]);
        for (auto& c : normal) c = length > 0 ? c / length : 0;
        out.normals.push_back(normal);
    }
    return out;
}

double distance(LatticePoint a, LatticePoint b) {
    return std::hypot(1.0 * a.x - b.x, 1.0 * a.y - b.y, 1.0 * a.z - b.z);
}

TEST(NodeMotion, ComesBackWithinAStepForAnyGraph) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        const std::size_t nodes = below(random, 40);
        const auto graph = any_graph(random, nodes);
        std::vector<QuantisedTransform> wanted, before;
        const auto transform = [&] {
            QuantisedTransform out;
            out.rotation.largest = static_cast<std::uint8_t>(below(random, 4));
            for (auto& c : out.rotation.others) c = static_cast<std::int16_t>(between(random, -8192, 8192));
            out.shift = {between(random, -90000, 90000), between(random, -9000, 9000), between(random, -9, 9)};
            return out;
        };
        for (std::uint32_t i = 0; i < nodes; ++i) {
            wanted.push_back(transform());
            before.push_back(transform());
        }
        for (const bool temporal : {false, true}) {
            const auto of_before =
                temporal ? std::span<const QuantisedTransform>(before) : std::span<const QuantisedTransform>{};
            const NodeMotionOptions options{.steps = {3, 2}};
            const auto encoded = encode_node_motion(wanted, graph, of_before, options);
            const auto run = encoded.decisions.run();
            RangeDecoder decoder(run);
            const auto decoded = decode_node_motion(decoder, options.steps, graph, of_before);
            ASSERT_TRUE(decoded.has_value());
            EXPECT_EQ(*decoded, encoded.transforms);
            for (std::size_t i = 0; i < nodes; ++i) {
                EXPECT_EQ((*decoded)[i].rotation.largest, wanted[i].rotation.largest);
                for (std::size_t c = 0; c < 3; ++c)
                    EXPECT_LE(std::abs((*decoded)[i].rotation.others[c] - wanted[i].rotation.others[c]), 8);
                // 0.6 steps of 4 along each of three axes, and the rounding to the lattice.
                EXPECT_LE(distance((*decoded)[i].shift, wanted[i].shift), 0.6 * 4 * std::sqrt(3.0) + 0.9);
            }
        }
    }
}

// Three nodes in a row on a floor whose normal is up.
NodeGraph floor_graph() {
    NodeGraph out;
    out.pivots = {{0, 0, 0}, {1000, 0, 0}, {2000, 0, 0}};
    out.lower = {{}, {0}, {0, 1}};
    out.normals.assign(3, {0, 0, 1});
    return out;
}

TEST(NodeMotion, IsPredictedByTheMeanStepOfAllLowerNeighbours) {
    const auto graph = floor_graph();
    const std::vector<QuantisedTransform> before(3);
    // The third moves by the mean of the others' steps: three numbers that are zero instead of two that are 60.
    const std::vector<QuantisedTransform> mean = {{{}, {400, 0, 80}}, {{}, {800, 0, 160}}, {{}, {600, 0, 120}}};
    const std::vector<QuantisedTransform> as_one = {{{}, {400, 0, 80}}, {{}, {800, 0, 160}}, {{}, {400, 0, 80}}};
    const NodeMotionOptions options{.steps = {0, 0}};
    EXPECT_LT(encode_node_motion(mean, graph, before, options).decisions.bits(),
              encode_node_motion(as_one, graph, before, options).decisions.bits());
}

// The form of nodes that the data hold across a floor only, and hardly against turning.
DeformationForm held_across(std::size_t nodes) {
    DeformationForm out;
    Matrix6 form = Matrix6::Zero();
    form.diagonal() << 1, 1, 1, 1e-4, 1e-4, 1;
    out.diagonal.assign(nodes, form);
    return out;
}

TEST(NodeMotion, WhereTheDataLeaveItOpenIsNotSentButThatAcrossIs) {
    const auto graph = floor_graph();
    const std::vector<QuantisedTransform> wanted = {{{}, {20, -20, 24}}, {{}, {20, -20, 24}}, {{}, {60, 0, 24}}};
    const std::vector<QuantisedTransform> before(3);
    auto form = held_across(3);
    form.diagonal[2](3, 3) = 1;  // the third is held along x, too
    const NodeMotionOptions options{.steps = {.rotation_exponent = 0, .shift_exponent = 2}, .form = &form, .price = 1};
    const auto coded = encode_node_motion(wanted, graph, before, options).transforms;
    EXPECT_EQ(coded[0].shift, (LatticePoint{0, 0, 24}));
    EXPECT_EQ(coded[1].shift, (LatticePoint{0, 0, 24}));
    EXPECT_EQ(coded[2].shift, (LatticePoint{60, 0, 24}));
}

TEST(NodeMotion, MakesUpForWhatTheNodesBeforeItWereSentWith) {
    const auto graph = floor_graph();
    // What lies between the first two follows both alike, so that only the sum of their shifts counts.
    const std::vector<QuantisedTransform> wanted = {{{}, {0, 0, 4}}, {{}, {0, 0, 4}}, {}};
    const std::vector<QuantisedTransform> before(3);
    auto form = held_across(3);
    Matrix6 between = Matrix6::Zero();
    between(5, 5) = 1;
    const NodeMotionOptions options{
        .steps = {.rotation_exponent = 0, .shift_exponent = 3}, .form = &form, .price = 0.01};
    const auto height = [&] {
        const auto coded = encode_node_motion(wanted, graph, before, options).transforms;
        return coded[0].shift.z + coded[1].shift.z;
    };
    EXPECT_NE(height(), 8);
    form.above.push_back({0, 1, between});
    EXPECT_EQ(height(), 8);
}

TEST(NodeMotion, IsSentMoreCoarselyTheMoreABitIsWorth) {
    std::mt19937 random(1);
    const auto graph = any_graph(random, 60);
    const std::vector<QuantisedTransform> before(60);
    auto wanted = before;
    for (auto& transform : wanted) {
        transform.shift = {between(random, -90, 90), between(random, -90, 90), between(random, -90, 90)};
        for (auto& c : transform.rotation.others) c = static_cast<std::int16_t>(between(random, -300, 300));
    }
    DeformationForm form;
    form.diagonal.assign(60, Vector6(1e6, 1e6, 1e6, 1, 1, 1).asDiagonal().toDenseMatrix());
    double last = std::numeric_limits<double>::max();
    for (const double price : {0.0, 10.0, 100.0, 1e9}) {
        const NodeMotionOptions options{.steps = {4, 3}, .form = &form, .price = price};
        const auto encoded = encode_node_motion(wanted, graph, before, options);
        EXPECT_LT(encoded.decisions.bits(), last) << price;
        last = encoded.decisions.bits();
        if (price > 0) continue;
        for (std::size_t i = 0; i < wanted.size(); ++i)
            EXPECT_LE(distance(encoded.transforms[i].shift, wanted[i].shift), 0.5 * 8 * std::sqrt(3.0) + 0.9);
    }
    EXPECT_LT(last, 30);  // nothing but that all is as predicted
}

// A floor that slides under the nodes and rises: nothing tells how far it slides, and nothing is sent of that.
TEST(NodeMotion, AlongAFloorThatSlidesIsNotSent) {
    constexpr std::uint32_t side = 41, nodes = 3;
    constexpr std::int32_t spacing = 400;
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            positions.push_back({static_cast<float>(100 * x), static_cast<float>(100 * y), 0});
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t a = y * side + x;
            triangles.push_back({a, a + 1, a + side});
            triangles.push_back({a + 1, a + side + 1, a + side});
        }
    NodeGraph graph;
    std::vector<Eigen::Vector3d> handles;
    std::vector<HandlePair> pairs;
    for (std::uint32_t i = 0; i < nodes; ++i) {
        const std::int32_t at = 2000 + spacing * (static_cast<std::int32_t>(i) - 1);
        graph.pivots.push_back({at, 2000, 0});
        graph.lower.emplace_back(i > 0 ? 1 : 0, i - 1);
        graph.normals.push_back({0, 0, 1});
        handles.emplace_back(at, 2000, 0);
        if (i > 0)
            pairs.push_back(
                {static_cast<std::uint16_t>(i - 1), static_cast<std::uint16_t>(i), {at - spacing / 2.0, 2000, 0}});
    }
    // Each strip of the floor follows one node.
    HandleWeights weights(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const auto nearest = std::clamp((positions[v][0] - 1800) / spacing, 0.0f, 2.0f);
        weights[v].handle[0] = static_cast<std::uint16_t>(nearest);
        weights[v].weight[0] = 1 << weight_bits;
    }
    const DeformationOptions options;
    const auto mesh = make_deformable(positions, triangles, weights, handles, pairs, options);
    for (auto& p : positions) p = {p[0] + 90, p[1] - 70, p[2] + 64};
    const SurfaceIndex target(positions, triangles, {.cell = 320, .samples = options.back_samples});
    DeformationForm form;
    const auto motion = register_deformation(mesh, target, {}, options, &form);
    std::vector<QuantisedTransform> wanted;
    for (std::size_t i = 0; i < nodes; ++i) {
        const Eigen::Vector3d shift = motion[i](handles[i]) - handles[i];
        EXPECT_NEAR(shift.z(), 64, 1);
        // As jitter has it along the floor.
        wanted.push_back(
            {{}, {i == 1 ? 14 : -9, i == 0 ? 11 : -16, static_cast<std::int32_t>(std::lround(shift.z()))}});
    }
    const std::vector<QuantisedTransform> before(nodes);
    const double step = 32;
    const NodeMotionOptions of_motion{.steps = {.rotation_exponent = 5, .shift_exponent = 4},
                                      .form = &form,
                                      .price = 0.036 * step * step * form.weight / nodes};
    for (const auto& coded : encode_node_motion(wanted, graph, before, of_motion).transforms)
        EXPECT_EQ(coded.shift, (LatticePoint{0, 0, 64}));
}

TEST(NodeMotion, ThatIsAsBeforeTakesNextToNothing) {
    const std::vector<QuantisedTransform> before(300, {{0, {40, -3, 7}}, {100, 200, -300}});
    NodeGraph graph;
    graph.pivots.resize(300);
    graph.lower.resize(300);
    graph.normals.resize(300);
    EXPECT_LT(encode_node_motion(before, graph, before, {}).decisions.run().size(), 17u);
}

}  // namespace
}  // namespace htvm::internal
