// Streams that every version must decode to the same integers, with a digest of each frame beside them: *.htvm and
// *.digests in tests/data/conformance. HTVM_WRITE_CONFORMANCE=1 in the environment writes them anew.
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "codec/test_sequences.h"
#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm {
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

// CRC-32 of what was decoded, little-endian: positions (32-bit floats, mm), triangles (32-bit indices), colours
// (bytes), normals and texture coordinates (32-bit floats), one array behind the other.
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
    char line[80];
    std::snprintf(line, sizeof line, "%u %c %zu %zu %08x", frame.info.frame,
                  frame.info.type == FrameType::intra ? 'I' : 'E', frame.mesh.positions.size(),
                  frame.mesh.triangles.size(), digest(frame.mesh));
    return line;
}

// One line a frame: its number, I or E, its vertices, its triangles, its digest.
std::vector<std::string> digests(const std::vector<std::uint8_t>& bytes) {
    const auto decoded = decode_packets(read_packets(bytes, 1000));
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

void write_stream(const std::string& name, const TestSequence& sequence, const EncoderOptions& options) {
    const auto coded = encode(sequence, options);
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    ASSERT_LE(coded.bytes.size(), 40000u) << name << ": the repository holds small streams only";
    std::ofstream(folder / (name + ".htvm"), std::ios::binary)
        .write(reinterpret_cast<const char*>(coded.bytes.data()), static_cast<std::streamsize>(coded.bytes.size()));
    std::ofstream text(folder / (name + ".digests"));
    for (const auto& line : digests(coded.bytes)) text << line << "\n";
}

void write_all() {
    fs::create_directories(folder);
    EncoderOptions options;
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

    // Every awkward connectivity, one after the other, each coded twice: an I-frame and an EP-frame.
    TestSequence awkward{"awkward", {}, {}};
    for (const auto& shape : tfan_test::special_meshes()) {
        if (shape.vertex_count > 200) continue;
        for (auto& frame : sequence_of(shape, 2, none).frames) awkward.frames.push_back(std::move(frame));
    }
    options.key_interval = 2;
    options.merge_duplicates = false;
    options.nearest_vertices = 3;
    write_stream("awkward", awkward, options);
}

TEST(Conformance, StoredStreamsDecodeToTheirDigests) {
    if (folder.empty()) GTEST_SKIP() << "built without HTVM_TEST_DATA";
    if (const char* write = std::getenv("HTVM_WRITE_CONFORMANCE"); write && std::string(write) == "1") write_all();
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing; HTVM_WRITE_CONFORMANCE=1 makes it";
    int streams = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".htvm") continue;
        SCOPED_TRACE(entry.path().filename().string());
        ++streams;
        EXPECT_EQ(digests(stream_in(entry.path())), lines_in(fs::path(entry.path()).replace_extension(".digests")));
    }
    EXPECT_GE(streams, 3);
}

}  // namespace
}  // namespace htvm
