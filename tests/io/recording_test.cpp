#include "io/recording.h"

#include <bit>
#include <fstream>

#include "core/bytes.h"
#include "gmock/gmock.h"
#include "io/mesh_samples.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;
using samples::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

class Recordings : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "htvm_recording_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { fs::remove_all(folder); }
    void write(const std::string& name, std::string_view content = "") const {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name, std::ios::binary) << content;
    }
    Recording found(const std::string& name = "") const {
        auto recording = find_recording(folder / name);
        EXPECT_TRUE(recording && *recording) << (recording ? "nothing" : recording.error().message);
        return recording && *recording ? std::move(**recording) : Recording();
    }
    Error error(const std::string& name = "") const {
        const auto recording = find_recording(folder / name);
        EXPECT_FALSE(recording);
        return recording ? Error{} : recording.error();
    }
    static std::vector<std::string> names(const std::vector<fs::path>& paths) {
        std::vector<std::string> out;
        for (const auto& path : paths) out.push_back(path.filename().string());
        return out;
    }
    fs::path folder;
};

constexpr const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST_F(Recordings, OtherFoldersAndFilesAreNone) {
    write("a.obj", triangle);
    write("notes.json", R"({"frames": [1, 2]})");
    write("readme.txt", "Hello.");
    for (const char* name : {"", "a.obj", "notes.json", "readme.txt", "not there"}) {
        const auto recording = find_recording(folder / name);
        ASSERT_TRUE(recording) << name;
        EXPECT_FALSE(*recording) << name;
    }
}

TEST_F(Recordings, ScandysListMeshesImagesAndDelays) {
    for (const char* name : {"1.draco", "2.draco", "3.obj", "1.jpg", "2.jpg", "3.jpg", "sound.wav"}) write(name);
    write("3.obj", triangle);
    write("scvv_animation.json", R"({"audio": "sound.wav", "average_fps": "15", "frames": [
        {"mesh_path": "2.draco", "texture_path": "2.jpg", "delay_us": 5},
        {"mesh_path": "1.draco", "texture_path": "1.jpg", "delay_us": 66128},
        {"mesh_path": "/phone/3.obj", "texture_path": "3.jpg", "delay_us": 64962}]})");
    for (const char* name : {"", "scvv_animation.json"}) {
        const auto recording = found(name);
        EXPECT_THAT(names(recording.meshes), ElementsAre("2.draco", "1.draco", "3.obj"));
        EXPECT_THAT(names(recording.images), ElementsAre("2.jpg", "1.jpg", "3.jpg"));
        EXPECT_THAT(recording.microseconds, ElementsAre(0, 66128, 131090));
        EXPECT_EQ(recording.sound, folder / "sound.wav");
        EXPECT_EQ(recording.rate.per_second(), 15);
        EXPECT_EQ(frame_count(recording), 3u);
        EXPECT_EQ(read_frame(recording, 2)->triangles.size(), 1u);
        EXPECT_THAT(read_frame(recording, 0).error().message, HasSubstr("2.draco: the Draco file"));
        EXPECT_FALSE(read_frame(recording, 3));
    }
    fs::remove(folder / "2.jpg");
    EXPECT_THAT(error().message, HasSubstr("names \"2.jpg\""));
}

TEST_F(Recordings, NamesInManifestsDoNotLeadOutOfTheFolder) {
    write("outside.obj", triangle);
    write("in/scvv_animation.json", R"({"frames": [{"mesh_path": "../outside.obj"}]})");
    EXPECT_THAT(error("in").message, HasSubstr("not in its folder"));
}

TEST_F(Recordings, UniversalVolumetricHasPathTemplates) {
    for (const char* name : {"geometry_fine/000000.drc", "geometry_fine/000001.drc", "geometry_rough/000000.drc",
                             "texture_hd_baseColor_default.mp4", "sound.mp3"})
        write(name);
    const std::string geometry = R"("version": "v2", "audio": {"path": "sound[ext]"}, "geometry": {"targets": {
        "fine": {"frameRate": 30, "frameCount": 2, "format": "draco"},
        "rough": {"frameRate": 15, "frameCount": 1, "format": "draco"}}, "path": "geometry_[target]/[######][ext]"})";
    write("dance.json", "{" + geometry + R"(, "texture": {"targets": {"hd": {"format": "mp4"}, "k": {"format": "ktx2"}},
        "path": "out/texture_[target]_[type]_[tag][ext]"}})");
    const auto recording = found();
    EXPECT_THAT(names(recording.meshes), ElementsAre("000000.drc", "000001.drc"));
    EXPECT_EQ(recording.meshes[0].parent_path().filename(), "geometry_fine");
    EXPECT_EQ(recording.rate.per_second(), 30);
    EXPECT_EQ(recording.video, folder / "texture_hd_baseColor_default.mp4");
    EXPECT_EQ(recording.sound, folder / "sound.mp3");
    EXPECT_TRUE(recording.unread_texture.empty());
    write("dance.json", "{" + geometry + R"(, "texture": {"baseColor": {"targets": {"k": {"format": "ktx2"}},
        "path": "[target]/[######][ext]"}}})");
    EXPECT_THAT(found().unread_texture, HasSubstr("KTX2"));
    fs::remove(folder / "geometry_fine/000001.drc");
    EXPECT_THAT(error().message, HasSubstr("geometry_fine/000001.drc"));
}

TEST_F(Recordings, WhatHoldsNoMeshThatIsReadSaysSo) {
    for (const auto& [name, what] : {std::pair{"a.uvol", "Corto"}, std::pair{"a.drcs", "Corto"},
                                     std::pair{"a.crt", "Corto"}, std::pair{"a.r3d", "Record3D"}}) {
        write(name);
        EXPECT_EQ(error(name).kind, ErrorKind::unsupported);
        EXPECT_THAT(error(name).message, HasSubstr(what));
    }
    write("one.json", R"({"maxVertices": 3, "maxTriangles": 1, "frameData": [], "frameRate": 30})");
    EXPECT_THAT(error("one.json").message, HasSubstr("version 1"));
    write("clip/clip.txt", R"({"_versionMajor": 0, "_versionMinor": 5, "perspectives": []})");
    write("clip/clip.mp4");
    EXPECT_THAT(error("clip").message, HasSubstr("combined per pixel"));
}

TEST_F(Recordings, DepthkitsMeshesHaveOneVideo) {
    write("clip.txt", R"({"_versionMajor": 0, "_versionMinor": 5, "perspectives": [], "frameRate": 29.97})");
    for (const char* name : {"clip.mp4", "m_10.obj", "m_9.obj"}) write(name);
    const auto recording = found();
    EXPECT_THAT(names(recording.meshes), ElementsAre("m_9.obj", "m_10.obj"));
    EXPECT_EQ(recording.video, folder / "clip.mp4");
    EXPECT_EQ(recording.unit, LengthUnit::metre);
    EXPECT_NEAR(recording.rate.per_second(), 29.97, 1e-9);
}

TEST_F(Recordings, TheGeometrySequencePlayersFilesAreBesideEachOther) {
    for (const char* name : {"f1.ply", "f2.ply", "f1.dds", "f2.dds"}) write(name);
    const auto manifest = [&](const std::string& more) {
        write("sequence.json",
              R"({"headerSizes": [9, 9], "verticeCounts": [3, 3], "boundsCenter": {"x": 0})" + more + "}");
    };
    manifest(R"(, "textureMode": 2, "DDS": true)");
    auto recording = found();
    EXPECT_THAT(names(recording.meshes), ElementsAre("f1.ply", "f2.ply"));
    EXPECT_THAT(names(recording.images), ElementsAre("f1.dds", "f2.dds"));
    manifest(R"(, "textureMode": 1)");
    EXPECT_THAT(names(found().images), ElementsAre("f1.dds"));
    manifest(R"(, "textureMode": 0)");
    EXPECT_TRUE(found().images.empty());
    manifest(R"(, "useCompression": true)");
    EXPECT_EQ(error().kind, ErrorKind::unsupported);
    fs::remove(folder / "f2.ply");
    manifest("");
    ASSERT_EQ(found().remarks.size(), 1u);
    EXPECT_TRUE(found().remarks[0].is_loss);
    fs::remove(folder / "f1.dds");
    fs::remove(folder / "f2.dds");
    manifest(R"(, "textureMode": 2, "ASTC": true)");
    EXPECT_THAT(found().unread_texture, HasSubstr("ASTC"));
}

// ---- Volograms ------------------------------------------------------------------------------------------------------

void put_array(internal::ByteWriter& out, std::initializer_list<float> numbers) {
    out.u32(static_cast<std::uint32_t>(4 * numbers.size()));
    for (const float number : numbers) out.u32(std::bit_cast<std::uint32_t>(number));
}

// A frame of three vertices, of which the first is at x; with normals, and with a triangle if it is a key frame.
std::vector<std::uint8_t> frame(std::uint32_t number, float x, bool is_key) {
    internal::ByteWriter body, out;
    put_array(body, {x, 0, 0, 1, 0, 0, 0, 1, 0});
    put_array(body, {1, 0, 0, 0, 0, 1, 0, 0, 1});
    if (is_key) {
        body.u32(6);
        for (const std::uint16_t index : {std::uint16_t{0}, std::uint16_t{1}, std::uint16_t{2}}) body.u16(index);
        put_array(body, {0, 0, 1, 0, 0, .25f});
    }
    out.u32(number);
    out.u32(static_cast<std::uint32_t>(body.size()));
    out.u8(is_key);
    out.bytes(body.data());
    out.u32(static_cast<std::uint32_t>(body.size()));
    return out.take();
}

std::vector<std::uint8_t> header(std::uint32_t version, std::uint32_t frames) {
    internal::ByteWriter out;
    if (version < 13) out.u8(4);
    out.bytes(bytes_of("VOLS"));
    out.u32(version);
    out.u32(0);
    if (version < 13) {
        out.bytes(bytes_of(std::string_view("\1m\0\0\0\0\0\0", 8)));
    }
    out.u32(frames);
    if (version >= 11) out.bytes(bytes_of(std::string_view("\1\0", 2)));
    out.bytes(std::vector<std::uint8_t>(version >= 13 ? 10 : version >= 11 ? 6 : 0));
    if (version == 12) out.bytes(std::vector<std::uint8_t>(32));
    if (version >= 13) {
        out.u32(std::bit_cast<std::uint32_t>(25.0f));
        for (const std::uint32_t number : {0u, 0u, 48u, 0u}) out.u32(number);
    }
    return out.take();
}

std::vector<std::uint8_t> joined(std::initializer_list<std::vector<std::uint8_t>> parts) {
    std::vector<std::uint8_t> out;
    for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
}

TEST(Vologram, TrackedFramesHaveTheTrianglesOfTheirKeyFrame) {
    for (const std::uint32_t version : {11u, 12u, 13u}) {
        const auto bytes = joined({header(version, 3), frame(0, 0, true), frame(1, -.5f, false), frame(2, 7, true)});
        const auto vologram = open_vologram(byte_source(bytes));
        ASSERT_TRUE(vologram) << vologram.error().message;
        ASSERT_EQ(vologram->frames.size(), 3u);
        EXPECT_EQ(vologram->frames_per_second, version == 13 ? 25 : 0);
        MeshReadOptions options;
        options.origin = {0, 0, 1};
        const auto mesh = read_vologram_frame(*vologram, 1, options);
        ASSERT_TRUE(mesh) << mesh.error().message;
        // Right-handed, so that the triangle is turned round.
        EXPECT_EQ(mesh->positions, (std::vector<Vector3f>{{.5f, 0, -1}, {-1, 0, -1}, {0, 1, -1}}));
        EXPECT_EQ(mesh->normals[0], (Vector3f{-1, 0, 0}));
        EXPECT_EQ(mesh->triangles, (std::vector<Triangle>{{2, 1, 0}}));
        EXPECT_EQ(mesh->texcoords, (std::vector<Vector2f>{{0, 0}, {1, 0}, {0, .25f}}));
        EXPECT_FALSE(read_vologram_frame(*vologram, 3));
        options.limits = {2, 1};
        EXPECT_EQ(read_vologram_frame(*vologram, 0, options).error().kind, ErrorKind::limit);
    }
}

TEST(Vologram, WhatIsDamagedOrCutOffIsAnError) {
    const auto whole = joined({header(12, 2), frame(0, 0, true), frame(1, 1, false)});
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(open_vologram(byte_source(std::span(whole).first(size)))) << size;
    const auto lost_key = joined({header(12, 1), frame(0, 0, false)});
    EXPECT_THAT(open_vologram(byte_source(lost_key)).error().message, HasSubstr("frame 0 is damaged"));
    const auto many = joined({header(12, 0xFFFFFFFF), frame(0, 0, true)});
    EXPECT_THAT(open_vologram(byte_source(many)).error().message, HasSubstr("4294967295 frames"));
    const auto later = header(14, 1);
    EXPECT_EQ(open_vologram(byte_source(later)).error().kind, ErrorKind::unsupported);
    // Fewer vertices than the key frame's texture coordinates are for.
    auto other = joined({header(12, 1), frame(0, 0, true)});
    const auto vologram = open_vologram(byte_source(other));
    ASSERT_TRUE(vologram);
    auto short_one = *vologram;
    short_one.frames[0].vertices.bytes = 24;
    EXPECT_THAT(read_vologram_frame(short_one, 0).error().message, HasSubstr("do not belong to each other"));
}

TEST_F(Recordings, VologramsHaveTheLargestVideoBeside) {
    const auto text = [](const std::vector<std::uint8_t>& bytes) { return samples::text_of(bytes); };
    write("header.vols", text(header(12, 2)));
    write("sequence_0.vols", text(frame(0, 0, true)));
    write("sequence_1.vols", text(frame(1, 2, false)));
    write("texture_1024_h264.mp4");
    write("texture_2048_h264.mp4");
    const auto recording = found();
    EXPECT_EQ(recording.video, folder / "texture_2048_h264.mp4");
    EXPECT_EQ(recording.unit, LengthUnit::metre);
    EXPECT_EQ(recording.rate.per_second(), 30);
    ASSERT_EQ(frame_count(recording), 2u);
    MeshFileOptions options;
    options.millimetres_per_unit = 1000;
    const auto mesh = read_frame(recording, 1, options);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->positions[0], (Vector3f{-2000, 0, 0}));
    write("one/all.vols", text(joined({header(13, 1), frame(0, 0, true)})));
    EXPECT_EQ(frame_count(found("one")), 1u);
    EXPECT_EQ(frame_count(found("one/all.vols")), 1u);
    EXPECT_EQ(found("one").rate.per_second(), 25);
}

}  // namespace
}  // namespace htvm
