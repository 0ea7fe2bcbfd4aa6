// Sequences of awkward meshes of every kind, and their way through encoder, packets and decoder.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "codec/random_numbers.h"
#include "codec/tfan_test_meshes.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "surface/other_meshings.h"
#include "synth/synth.h"

namespace htvm::test {

using namespace internal;

struct SequenceFrame {
    Mesh mesh;
    std::optional<Pose> pose;
};

struct TestSequence {
    std::string name;
    Skeleton skeleton;  // no bones: none is tracked
    std::vector<SequenceFrame> frames;
};

// The vertex's number as its colour, by which a test recognises it.
inline Colour colour_of(std::size_t vertex) {
    return {static_cast<std::uint8_t>(vertex), static_cast<std::uint8_t>(vertex >> 8),
            static_cast<std::uint8_t>(vertex >> 16)};
}
inline std::size_t vertex_of(Colour c) { return c[0] + (std::size_t{c[1]} << 8) + (std::size_t{c[2]} << 16); }

enum Attributes : unsigned { none = 0, colours = 1, normals = 2, texcoords = 4, all = 7 };

inline void give_attributes(Mesh& mesh, unsigned which, unsigned seed) {
    std::mt19937 random(seed);
    mesh.colours.clear();
    mesh.normals.clear();
    mesh.texcoords.clear();
    for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
        if (which & colours) mesh.colours.push_back(colour_of(k));
        if (which & normals) {
            const double turn = below(random, 1000) / 159.0, up = below(random, 1000) / 318.0;
            mesh.normals.push_back({static_cast<float>(std::cos(turn) * std::sin(up)),
                                    static_cast<float>(std::sin(turn) * std::sin(up)),
                                    static_cast<float>(std::cos(up))});
        }
        if (which & texcoords)
            mesh.texcoords.push_back({static_cast<float>(k % 7) / 7, static_cast<float>(below(random, 5000)) / 4000});
    }
}

// The connectivity with its own positions (or random ones), turned and perturbed a little from frame to frame.
inline TestSequence sequence_of(const tfan_test::TestMesh& shape, int frames, unsigned attributes) {
    TestSequence out{shape.name, {}, {}};
    const auto positions = tfan_test::positions_of(shape, 11);
    for (int t = 0; t < frames; ++t) {
        std::mt19937 random(static_cast<unsigned>(t));
        Mesh mesh;
        const double c = std::cos(0.05 * t), s = std::sin(0.05 * t);
        for (const auto p : positions)
            mesh.positions.push_back(
                {static_cast<float>((c * p.x - s * p.y) / 4 + 5 * t + between(random, -20, 20) / 20.0),
                 static_cast<float>((s * p.x + c * p.y) / 4 + between(random, -20, 20) / 20.0),
                 static_cast<float>(p.z / 4.0 + between(random, -20, 20) / 20.0)});
        mesh.triangles = shape.triangles;
        give_attributes(mesh, attributes, static_cast<unsigned>(t));
        out.frames.push_back({std::move(mesh), {}});
    }
    return out;
}

// The same vertices with other triangles in each frame: nothing says then that they were kept.
inline TestSequence meshed_anew(TestSequence sequence) {
    for (std::size_t t = 0; t < sequence.frames.size(); ++t)
        flip_edges(sequence.frames[t].mesh, 24, static_cast<std::uint32_t>(t));
    return sequence;
}

// The same surfaces with vertices and triangles in another order in each frame, as programs between leave them.
inline TestSequence numbered_anew(TestSequence sequence) {
    for (std::size_t t = 0; t < sequence.frames.size(); ++t)
        sequence.frames[t].mesh = renumbered(std::move(sequence.frames[t].mesh), t);
    return sequence;
}

// A frame of the synthetic person with colours and normals. Kept, since making it takes longer than most tests that use
// it.
inline SynthFrame synthetic_frame(int vertices, int frame) {
    static std::map<std::pair<int, int>, SynthFrame> made;
    const auto [entry, is_new] = made.try_emplace({vertices, frame});
    if (is_new) {
        SynthOptions options;
        options.vertices = vertices;
        options.normals = true;
        entry->second = synth_frame(options, frame);
    }
    return entry->second;
}

inline TestSequence synthetic(bool skeleton, int frames, int vertices = 1500) {
    TestSequence out{skeleton ? "synthetic" : "synthetic without skeleton", {}, {}};
    if (skeleton) out.skeleton = synth_skeleton();
    for (int t = 0; t < frames; ++t) {
        auto frame = synthetic_frame(vertices, 10 * t);
        if (skeleton)
            out.frames.push_back({std::move(frame.mesh), std::move(frame.pose)});
        else
            out.frames.push_back({std::move(frame.mesh), {}});
    }
    return out;
}

// Captures with defects that occur in practice.
inline std::vector<TestSequence> make_awkward_sequences() {
    std::vector<TestSequence> out;
    unsigned attributes = 0;
    for (const auto& shape : tfan_test::special_meshes()) out.push_back(sequence_of(shape, 4, attributes++ % 8));
    for (unsigned seed = 0; seed < 6; ++seed)
        out.push_back(sequence_of(tfan_test::random_soup(seed), 4, attributes++ % 8));

    TestSequence changing{"attributes that come and go", {}, {}};
    for (const unsigned which : {0u, 1u, 1u, 3u, 3u, 2u, 7u, 7u, 0u, 0u})
        changing.frames.push_back(sequence_of(tfan_test::grid(6, 6), 1, which).frames[0]);
    out.push_back(changing);

    TestSequence point{"all vertices in one point", {}, {}};
    for (int t = 0; t < 4; ++t) {
        auto frame = sequence_of(tfan_test::grid(20, 20), 1, all).frames[0];
        for (auto& p : frame.mesh.positions) p = {10.f * static_cast<float>(t), 5, 5};
        point.frames.push_back(frame);
    }
    out.push_back(point);

    TestSequence huge{"as far out as the lattice goes", {}, {}};
    for (int t = 0; t < 4; ++t) {
        std::mt19937 random(static_cast<unsigned>(t));
        auto frame = sequence_of(tfan_test::grid(9, 9), 1, colours).frames[0];
        for (auto& p : frame.mesh.positions)
            for (auto& c : p) c = static_cast<float>(between(random, -520000, 520000));
        huge.frames.push_back(frame);
    }
    out.push_back(huge);

    TestSequence gaps{"empty frames between full ones", {}, {}};
    for (const bool full : {false, true, true, false, false, true, true})
        gaps.frames.push_back(full ? sequence_of(tfan_test::grid(7, 5), 1, colours).frames[0] : SequenceFrame{});
    out.push_back(gaps);

    TestSequence sizes{"another number of vertices in every frame", {}, {}};
    for (const std::uint32_t size : {2u, 30u, 5u, 1u, 25u})
        sizes.frames.push_back(sequence_of(tfan_test::grid(size, size), 1, all).frames[0]);
    out.push_back(sizes);

    auto lost = synthetic(true, 5, 400);
    lost.name = "the tracker loses the pose";
    lost.frames[1].pose.reset();
    lost.frames[3].pose.reset();
    lost.frames[4].pose.reset();
    out.push_back(lost);
    return out;
}

inline const std::vector<TestSequence>& awkward_sequences() {
    static const auto sequences = make_awkward_sequences();
    return sequences;
}

struct CodedSequence {
    std::vector<Packet> packets;
    std::vector<std::uint8_t> bytes;
    std::vector<Mesh> reconstructions;  // of the frames that were coded
    std::vector<FrameInfo> infos;
    std::vector<std::string> errors;  // of those that were not
};

inline CodedSequence encode(const TestSequence& sequence, EncoderOptions options) {
    options.skeleton = sequence.skeleton;
    CodedSequence out;
    auto encoder = Encoder::create(options);
    EXPECT_TRUE(encoder.has_value());
    if (!encoder) return out;
    const auto drain = [&] {
        const auto coded = encoder->coded_frames();
        for (std::size_t i = 0; i < coded.size(); ++i) {
            out.reconstructions.push_back(encoder->reconstruction(i));
            out.infos.push_back(coded[i].info);
        }
        while (auto packet = encoder->pull()) {
            const auto bytes = write_packet(*packet);
            out.bytes.insert(out.bytes.end(), bytes.begin(), bytes.end());
            out.packets.push_back(std::move(*packet));
        }
    };
    std::int64_t time = -40000;
    for (const auto& frame : sequence.frames) {
        const auto pushed = encoder->push(frame.mesh, frame.pose ? &*frame.pose : nullptr, time += 33333);
        if (pushed)
            drain();
        else
            out.errors.push_back(pushed.error().message);
    }
    EXPECT_TRUE(encoder->finish().has_value());
    drain();
    return out;
}

struct DecodedSequence {
    std::vector<DecodedFrame> frames;
    std::vector<Error> errors;
};

// prepares: whether Decoder::prepare() is called behind each packet.
inline DecodedSequence decode_packets(const std::vector<Packet>& packets, const DecoderOptions& options = {},
                                      bool prepares = false) {
    DecodedSequence out;
    Decoder decoder(options);
    for (const auto& packet : packets) {
        auto frame = decoder.decode_copy(packet);
        if (!frame)
            out.errors.push_back(frame.error());
        else if (*frame)
            out.frames.push_back(std::move(**frame));
        if (prepares) decoder.prepare();
    }
    return out;
}

inline std::vector<Packet> read_packets(const std::vector<std::uint8_t>& bytes, std::size_t chunk) {
    PacketReader reader;
    std::vector<Packet> out;
    for (std::size_t at = 0; at < bytes.size(); at += chunk) {
        reader.push(std::span(bytes).subspan(at, std::min(chunk, bytes.size() - at)));
        while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    }
    return out;
}

inline void expect_same_mesh(const Mesh& a, const Mesh& b) {
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.colours, b.colours);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.texcoords, b.texcoords);
}

}  // namespace htvm::test
