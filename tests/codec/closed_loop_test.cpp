// What the encoder says that it sent is, to the bit, what the decoder shows, for any mesh and any number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/test_sequences.h"
#include "codec/tfan_test_meshes.h"

namespace htvm::internal {
namespace {

using namespace test;

// Checks every frame's reconstruction, its info and its bytes, for several numbers of threads and sizes of pieces.
void expect_closed_loop(const TestSequence& sequence, EncoderOptions options) {
    SCOPED_TRACE(sequence.name);
    options.threads = 1;
    const auto coded = encode(sequence, options);
    EXPECT_TRUE(options.intra_coder || coded.errors.empty()) << coded.errors[0];
    for (const unsigned threads : {3u, 7u}) {
        options.threads = threads;
        EXPECT_EQ(encode(sequence, options).bytes, coded.bytes) << threads << " threads";
    }
    for (const auto& [threads, chunk] : std::vector<std::pair<unsigned, std::size_t>>{{1, 1}, {4, 1237}}) {
        DecoderOptions decoder;
        decoder.threads = threads;
        decoder.intra_coder = options.intra_coder;
        const auto decoded = decode_packets(read_packets(coded.bytes, chunk), decoder);
        for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
        ASSERT_EQ(decoded.frames.size(), coded.reconstructions.size());
        std::size_t bytes = 0;
        for (std::size_t t = 0; t < decoded.frames.size(); ++t) {
            SCOPED_TRACE("frame " + std::to_string(t));
            expect_same_mesh(decoded.frames[t].mesh, coded.reconstructions[t]);
            const auto &a = decoded.frames[t].info, &b = coded.infos[t];
            EXPECT_EQ(a.type, b.type);
            EXPECT_EQ(a.frame, b.frame);
            EXPECT_EQ(a.reference, b.reference);
            EXPECT_EQ(a.timestamp_us, b.timestamp_us);
            EXPECT_EQ(a.vertices, decoded.frames[t].mesh.positions.size());
            EXPECT_EQ(a.triangles, decoded.frames[t].mesh.triangles.size());
            bytes += b.bytes.total();
        }
        EXPECT_LE(bytes, coded.bytes.size());
        for (const auto& packet : coded.packets)
            if (packet.kind == PacketKind::sequence || packet.kind == PacketKind::index)
                bytes += packet.payload.size() + packet_overhead;
        EXPECT_EQ(bytes, coded.bytes.size()) << "every byte belongs to a layer";
    }
}

EncoderOptions key_every_third() {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 3;
    return options;
}

// Nothing merges, nothing is traded for rate, and colours are exact: every vertex can be recognised by its colour.
EncoderOptions traceable() {
    auto options = key_every_third();
    options.topology.merge_duplicates = false;
    options.lambda = 0;
    options.colour_step = 1;
    return options;
}

TEST(ClosedLoop, ASyntheticCaptureWithSkeleton) {
    const auto sequence = synthetic(true, 6);
    const auto coded = encode(sequence, key_every_third());
    ASSERT_EQ(coded.infos.size(), 6u);
    for (std::size_t t = 0; t < 6; ++t)
        EXPECT_EQ(coded.infos[t].type, t % 3 == 0 ? FrameType::intra : FrameType::enhanced);
    expect_closed_loop(sequence, key_every_third());
    expect_closed_loop(sequence, traceable());
}

TEST(ClosedLoop, ASyntheticCaptureWithoutSkeleton) { expect_closed_loop(synthetic(false, 6), key_every_third()); }

TEST(ClosedLoop, OtherOptions) {
    auto options = key_every_third();
    options.topology.reference_vertices = ReferenceVertices::bone;
    options.topology.registration = BoneRegistration::point;
    options.topology.nearest_vertices = 1;
    options.lambda = 1000;
    expect_closed_loop(synthetic(true, 4), options);
    options = key_every_third();
    options.geometry_step = 0.0001;
    options.colour_step = 255;
    options.topology.nearest_vertices = 64;
    options.lattice_bits = 12;
    expect_closed_loop(synthetic(true, 4, 500), options);
    options.geometry_step = 1000;
    expect_closed_loop(synthetic(true, 4, 500), options);
}

TEST(ClosedLoop, EveryAwkwardSequence) {
    for (const auto& sequence : awkward_sequences()) {
        expect_closed_loop(sequence, key_every_third());
        expect_closed_loop(sequence, traceable());
    }
}

TEST(ClosedLoop, DracoIntraFrames) {
    auto options = key_every_third();
    options.intra_coder = draco_intra_coder();
    const auto person = synthetic(true, 4);
    const auto coded = encode(person, options);
    EXPECT_TRUE(coded.errors.empty());
    EXPECT_GT(coded.infos.at(0).bytes[Layer::external_intra], 0u);
    expect_closed_loop(person, options);
    for (const auto& sequence : awkward_sequences()) expect_closed_loop(sequence, options);
}

// Predictions, vertices and codewords as far apart as possible: the pose leaps one way while the mesh leaps the other.
TEST(ClosedLoop, VerticesAndPoseAtOppositeEndsOfTheLattice) {
    TestSequence sequence{"opposite ends", {}, {}};
    sequence.skeleton.joint_names = {"a", "b"};
    sequence.skeleton.bones = {{0, 1}};
    for (int t = 0; t < 5; ++t) {
        const float end = t % 2 ? 524280.f : -524280.f;
        Mesh mesh;
        for (int k = 0; k < 5; ++k) mesh.positions.push_back({end, end, end > 0 ? end - static_cast<float>(k) : end});
        if (t == 0) mesh.positions[0] = {524280, 524280, 524280};
        mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
        Pose pose;
        for (const double y : {0.0, 100.0}) pose.joints.push_back({-1.0 * end, y, -1.0 * end});
        sequence.frames.push_back({mesh, pose});
    }
    for (const double lambda : {0.0, 0.12, 1000.0})
        for (const double step : {0.1, 2.0, 1000.0}) {
            EncoderOptions options = test::enhanced_options();
            options.lattice_bits = 4;
            options.lambda = lambda;
            options.geometry_step = step;
            SCOPED_TRACE("lambda " + std::to_string(lambda) + ", step " + std::to_string(step));
            expect_closed_loop(sequence, options);
        }
}

// If a bit is worth more than any error, all residuals get the most common codeword: here one that leads from one end
// of the lattice to the other, and, for the vertex that is there already, beyond it.
TEST(ClosedLoop, NoChoiceOfCodewordLeavesTheLattice) {
    constexpr float end = 127.9f;  // mm; the lattice of 2^-16 mm is small
    TestSequence sequence{"codewords far off", {}, {}};
    Mesh mesh;
    mesh.positions = {{-end, -end, 0}, {end, end, 0}};
    sequence.frames.push_back({mesh, {}});
    mesh.positions.assign(9, {-end, end - 0.1f, 0});
    mesh.positions.push_back({end, end, 0});
    sequence.frames.push_back({mesh, {}});
    EncoderOptions options = test::enhanced_options();
    options.lattice_bits = 16;
    options.lambda = 1000;
    options.geometry_step = 100;
    options.topology.merge_duplicates = false;
    expect_closed_loop(sequence, options);
}

TEST(ClosedLoop, PredictedFrames) {
    auto options = motion_based(0);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 1e6;
    const auto sequence = walking(6, 800);
    EXPECT_EQ(frames_of(encode(sequence, options), FrameType::predicted), 4u) << "all but two I-frames";
    expect_closed_loop(sequence, options);
    options.topology.weight_width = 0;
    options.geometry_step = 0.1;
    expect_closed_loop(sequence, options);
}

TEST(ClosedLoop, MotionBasedFramesByThreshold) {
    const auto sequence = walking(5, 800);
    for (const double still_below : {15.0, 50.0, 120.0}) {
        SCOPED_TRACE("still below " + std::to_string(still_below));
        auto options = motion_based(still_below, 5);
        EXPECT_GT(frames_in_part(encode(sequence, options)), 0u);
        expect_closed_loop(sequence, options);
        options.topology.weight_width = 0;
        options.topology.merge_duplicates = false;
        expect_closed_loop(sequence, options);
    }
}

TEST(ClosedLoop, MotionBasedFramesWhoseAnimationIsChecked) {
    auto options = motion_based(200);
    std::vector<std::size_t> bytes;
    for (const double error : {0.5, 2.0, 20.0}) {
        options.topology.animation_error = error;
        bytes.push_back(encode(walking(4, 800), options).bytes.size());
        expect_closed_loop(walking(4, 800), options);
    }
    EXPECT_GT(bytes.front(), bytes.back()) << "the more error is allowed, the more is animated";
}

TEST(ClosedLoop, MotionBasedFramesOfEveryAwkwardSequence) {
    std::size_t in_part = 0;
    for (const auto& sequence : awkward_sequences()) {
        const auto spokes = with_spokes(sequence);
        for (const double still_below : {20.0, 75.0}) {
            in_part += frames_in_part(encode(spokes, motion_based(still_below)));
            expect_closed_loop(spokes, motion_based(still_below));
        }
    }
    EXPECT_GE(in_part, 20u);
}

TEST(ClosedLoop, EveryChoiceOfFrames) {
    std::map<double, std::set<std::vector<std::uint8_t>>> streams;  // keyed by still_below
    for (const auto choice : {FrameChoice::fixed, FrameChoice::motion, FrameChoice::rate_distortion})
        for (const double still_below : {0.0, 60.0}) {
            auto options = motion_based(still_below, 6);
            options.topology.frame_choice = choice;
            if (choice == FrameChoice::motion) {
                options.topology.predicted_below = 500;
                options.topology.intra_above = 2500;
            }
            options.topology.animation_error = 20;
            streams[still_below].insert(encode(walking(7, 500), options).bytes);
            expect_closed_loop(walking(7, 500), options);
            // Slow, and half of the combinations are covered by other tests.
            if ((choice == FrameChoice::motion) != (still_below > 0) || choice == FrameChoice::fixed) continue;
            for (const auto& sequence : awkward_sequences()) expect_closed_loop(with_spokes(sequence), options);
        }
    for (const auto& [still_below, different] : streams)
        EXPECT_EQ(different.size(), 3u) << "each choice is another one, " << still_below;
}

std::vector<Triangle> by_source_vertex(const Mesh& decoded) {
    std::vector<Triangle> out = decoded.triangles;
    for (auto& t : out)
        for (auto& v : t) v = static_cast<std::uint32_t>(vertex_of(decoded.colours[v]));
    return tfan_test::as_multiset(out);
}

std::vector<TestSequence> make_coloured_sequences() {
    std::vector<TestSequence> out = awkward_sequences();
    out.push_back(synthetic(true, 2, 800));
    out.push_back(synthetic(false, 2, 800));
    for (auto& sequence : out)
        for (auto& frame : sequence.frames) {
            const unsigned more =
                (frame.mesh.normals.empty() ? 0u : normals) + (frame.mesh.texcoords.empty() ? 0u : texcoords);
            give_attributes(frame.mesh, colours + more, 3);
        }
    return out;
}

const std::vector<TestSequence>& coloured_sequences() {
    static const auto sequences = make_coloured_sequences();
    return sequences;
}

TEST(ClosedLoop, WithoutMergingEveryVertexAndOrientedTriangleIsThere) {
    for (const auto& sequence : coloured_sequences()) {
        SCOPED_TRACE(sequence.name);
        const auto coded = encode(sequence, traceable());
        const auto decoded = decode_packets(coded.packets);
        ASSERT_EQ(decoded.frames.size(), sequence.frames.size());
        for (std::size_t t = 0; t < decoded.frames.size(); ++t) {
            const auto &mesh = decoded.frames[t].mesh, &source = sequence.frames[t].mesh;
            ASSERT_EQ(mesh.positions.size(), source.positions.size());
            std::vector<bool> seen(source.positions.size(), false);
            for (const auto& colour : mesh.colours) {
                const auto k = vertex_of(colour);
                ASSERT_LT(k, seen.size());
                EXPECT_FALSE(seen[k]);
                seen[k] = true;
            }
            EXPECT_EQ(by_source_vertex(mesh), tfan_test::as_multiset(source.triangles)) << "frame " << t;
        }
    }
}

TEST(ClosedLoop, WithoutMergingAndAtLambdaZeroErrorsAreBoundedByTheStep) {
    // I-frames round each coordinate to the grid of the step: the error is at most half a step. EP-frames take the
    // nearest codeword or the step's grid, whichever is nearer: at most half the diagonal of a cell. Rounding to the
    // lattice before, and to floats afterwards, comes on top.
    for (const double step : {0.25, 2.0, 7.0})
        for (const auto& sequence : coloured_sequences()) {
            SCOPED_TRACE(sequence.name + ", step " + std::to_string(step));
            auto options = traceable();
            options.geometry_step = step;
            options.lattice_bits = 4;
            const auto decoded = decode_packets(encode(sequence, options).packets);
            for (std::size_t t = 0; t < decoded.frames.size(); ++t) {
                const auto &mesh = decoded.frames[t].mesh, &source = sequence.frames[t].mesh;
                for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
                    const auto& original = source.positions[vertex_of(mesh.colours[k])];
                    double largest = 0, sum = 0;
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        const double d = std::abs(1.0 * mesh.positions[k][axis] - original[axis]);
                        const double slack = 0.5 / 16 + std::abs(original[axis]) * 2e-7;
                        largest = std::max(largest, d - slack);
                        sum += std::max(0.0, d - slack) * std::max(0.0, d - slack);
                    }
                    if (decoded.frames[t].info.type == FrameType::intra)
                        ASSERT_LE(largest, step / 2 + 1e-6);
                    else
                        ASSERT_LE(std::sqrt(sum), step / 2 * std::sqrt(3.0) * (1 + 1e-4) + 1e-6);
                }
            }
        }
}

TEST(ClosedLoop, NormalsAndTextureCoordinatesAreThoseOfTheSource) {
    for (const auto& sequence : coloured_sequences()) {
        const auto decoded = decode_packets(encode(sequence, traceable()).packets);
        for (std::size_t t = 0; t < decoded.frames.size(); ++t) {
            const auto &mesh = decoded.frames[t].mesh, &source = sequence.frames[t].mesh;
            ASSERT_EQ(mesh.normals.size(), source.normals.size());
            ASSERT_EQ(mesh.texcoords.size(), source.texcoords.size());
            for (std::size_t k = 0; k < mesh.normals.size(); ++k) {
                const auto &a = mesh.normals[k], &b = source.normals[vertex_of(mesh.colours[k])];
                ASSERT_GT(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], 0.9999) << sequence.name;
            }
            for (std::size_t k = 0; k < mesh.texcoords.size(); ++k)
                for (std::size_t c = 0; c < 2; ++c)
                    ASSERT_NEAR(mesh.texcoords[k][c], source.texcoords[vertex_of(mesh.colours[k])][c], 0.5001 / 4096);
        }
    }
}

// An EP-frame's residuals are quantised after its vertices have merged, and if they are coarse two vertices may
// coincide after all. The sequence for which this happens has scene changes instead if it is of adult size.
TEST(ClosedLoop, MergingLeavesNoTwoEqualVerticesAndNoCollapsedTriangle) {
    auto options = key_every_third();
    options.subject_size = 1750;
    options.geometry_step = 40;
    for (const auto& sequence : awkward_sequences())
        for (const auto& mesh : encode(sequence, options).reconstructions) {
            std::vector<std::tuple<Vector3f, Colour, Vector3f, Vector2f>> vertices;
            for (std::size_t k = 0; k < mesh.positions.size(); ++k)
                vertices.emplace_back(mesh.positions[k], mesh.colours.empty() ? Colour{} : mesh.colours[k],
                                      mesh.normals.empty() ? Vector3f{} : mesh.normals[k],
                                      mesh.texcoords.empty() ? Vector2f{} : mesh.texcoords[k]);
            std::sort(vertices.begin(), vertices.end());
            EXPECT_EQ(std::adjacent_find(vertices.begin(), vertices.end()), vertices.end()) << sequence.name;
            for (const auto& t : mesh.triangles) EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        }
}

TEST(ClosedLoop, ACapturedMeshCodedTwiceGivesTheSameBytes) {
    const auto sequence = synthetic(true, 4);
    EXPECT_EQ(encode(sequence, key_every_third()).bytes, encode(sequence, key_every_third()).bytes);
}

}  // namespace
}  // namespace htvm::internal
