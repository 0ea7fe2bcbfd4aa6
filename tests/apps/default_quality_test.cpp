// The library's defaults are those of `htvm encode`: the same capture becomes the same packets.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "commands.h"
#include "htvm/encoder.hpp"
#include "io/mesh_file.h"
#include "synth/synth.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;

constexpr int frames = 6;

std::vector<Mesh> capture() {
    SynthOptions person;
    person.vertices = 800;
    std::vector<Mesh> out;
    for (int frame = 0; frame < frames; ++frame) out.push_back(synth_frame(person, 40 + frame).mesh);
    return out;
}

// All but indexes, which a file has in front and a stream at the end.
void add(std::vector<Bytes>& out, const Packet& packet) {
    if (packet.kind != PacketKind::index && packet.kind != PacketKind::front_index) out.push_back(write_packet(packet));
}

std::vector<Bytes> by_library(const std::vector<Mesh>& meshes) {
    auto encoder = *Encoder::create({});
    std::vector<Bytes> out;
    for (std::size_t i = 0; i < meshes.size(); ++i)
        EXPECT_TRUE(encoder.push(meshes[i], nullptr, std::llround(static_cast<double>(i) * 1e6 / 30)));
    EXPECT_TRUE(encoder.finish());
    while (const auto packet = encoder.pull()) add(out, *packet);
    return out;
}

std::vector<Bytes> by_program(const std::vector<Mesh>& meshes) {
    const auto folder = fs::path(::testing::TempDir()) / "default_quality";
    fs::remove_all(folder);
    fs::create_directories(folder / "capture");
    for (std::size_t i = 0; i < meshes.size(); ++i)
        EXPECT_TRUE(write_mesh(folder / "capture" / (std::to_string(i) + ".ply"), meshes[i]));
    std::array<std::string, 10> words = {"htvm", "encode", folder / "capture",     "--unit", "mm", "--group",
                                         "1",    "-o",     folder / "stream.htvm", "--quiet"};
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    Program program{"htvm", "", "", {add_encode}, {}};
    EXPECT_EQ(run_program(program, static_cast<int>(arguments.size()), arguments.data()), 0);
    PacketReader reader;
    reader.push(*read_file(folder / "stream.htvm"));
    std::vector<Bytes> out;
    while (const auto packet = reader.pull()) add(out, *packet);
    fs::remove_all(folder);
    return out;
}

TEST(DefaultQuality, TheLibraryMakesTheStreamOfTheCommandLineWithoutGroups) {
    const auto meshes = capture();
    const auto library = by_library(meshes);
    EXPECT_GE(library.size(), std::size_t{1 + frames});
    EXPECT_EQ(library, by_program(meshes));
}

}  // namespace
}  // namespace htvm::app
