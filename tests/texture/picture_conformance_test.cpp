// A stream with pictures of every kind, which every version must decode to the same samples: pictures_6.htvm in
// tests/data/conformance. Its meshes are those of charts_6.htvm, with the same digests; pictures_6.pictures has a line
// for each picture: its frame, coder, width, height, gains, matrix, range, the CRC-32 of its coded bytes and that of
// its decoded samples (the rows of the three planes one after another; of an image file, red, green and blue of its
// pixels). HTVM_WRITE_CONFORMANCE=pictures_6 in the environment writes it anew, which other versions of the coders do
// to other bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/crc32.h"
#include "htvm/decoder.hpp"
#include "htvm/picture_decoder.hpp"
#include "htvm/picture_encoder.hpp"
#include "io/image_file.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;

const fs::path folder = fs::path(HTVM_TEST_DATA) / "conformance";

std::vector<Packet> packets_in(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    PacketReader reader;
    reader.push(bytes);
    std::vector<Packet> out;
    while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    return out;
}

std::string lines_in(const fs::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::uint32_t digest(const PicturePlanes& planes) {
    std::vector<std::uint8_t> samples;
    for (std::size_t p = 0; p < 3; ++p) {
        const auto width = p == 0 ? planes.width : (planes.width + 1) / 2;
        const auto height = p == 0 ? planes.height : (planes.height + 1) / 2;
        for (std::uint32_t y = 0; y < height; ++y) {
            const auto* row = planes.samples[p] + static_cast<std::ptrdiff_t>(y) * planes.strides[p];
            samples.insert(samples.end(), row, row + width);
        }
    }
    return internal::crc32(samples);
}

std::string as_written(const Packet& packet) {
    std::ostringstream out;
    const auto written = read_texture_picture(packet);
    EXPECT_TRUE(written) << written.error().message;
    if (!written) return {};
    out << packet.frame << ' ' << static_cast<int>(written->coder) << ' ' << written->width << ' ' << written->height;
    for (const auto gain : written->gains) out << ' ' << gain;
    char rest[40];
    std::snprintf(rest, sizeof rest, " %d %d %08x", static_cast<int>(written->matrix), written->full_range ? 1 : 0,
                  internal::crc32(written->coded));
    out << rest;
    return out.str();
}

std::string pictures_of(const std::vector<Packet>& packets) {
    PictureDecoder decoder({.read_image_file = [](auto bytes) { return read_image(bytes); }});
    std::ostringstream out;
    for (const auto& packet : packets) {
        if (packet.kind != PacketKind::texture) continue;
        const auto taken = decoder.decode(packet);
        if (!taken && taken.error().kind == ErrorKind::unsupported) {
            out << packet.frame << " unknown\n";
            continue;
        }
        EXPECT_TRUE(taken) << taken.error().message;
        if (!taken) continue;
        const auto samples = decoder.planes() ? digest(*decoder.planes()) : internal::crc32(decoder.image()->rgb);
        char decoded[16];
        std::snprintf(decoded, sizeof decoded, " %08x\n", samples);
        out << as_written(packet) << decoded;
    }
    return out.str();
}

// A chequered board that moves over a slope.
Image board(int width, int height, int time) {
    Image out{width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = 0; k < 3; ++k)
                out.rgb.push_back(static_cast<std::uint8_t>(((x + 2 * time) / 16 + y / 16) % 2 == 0
                                                                ? 40 + 60 * k
                                                                : 255 * (k == 1 ? x : y) / (k == 1 ? width : height)));
    return out;
}

std::vector<std::uint8_t> coded(PictureEncoder& encoder, const OwnPlanes& planes) {
    // The encoder takes one kind alone. What they are is in the packet.
    auto view = planes.view();
    view.matrix = ColourMatrix::bt709;
    view.full_range = false;
    auto out = encoder.encode(view);
    EXPECT_TRUE(out) << out.error().message;
    return out ? std::move(out->bytes) : std::vector<std::uint8_t>(1);
}

PictureEncoder encoder_of(PictureCoder coder, std::uint32_t width, std::uint32_t height) {
    PictureEncoderOptions options;
    options.coder = coder;
    options.width = width;
    options.height = height;
    options.quantiser = 45;
    auto out = PictureEncoder::create(options);
    EXPECT_TRUE(out) << out.error().message;
    return std::move(*out);
}

// The pictures of seven frames: AV1 with gains, the third of which nothing needs; one of a coder that nobody knows; a
// key picture of another size, matrix and range; VP9; a file.
std::vector<Packet> pictures(const std::vector<Packet>& frames) {
    constexpr std::array<std::uint16_t, 3> gains = {4000, 4096, 4300};
    std::vector<Packet> out;
    const auto add = [&](TexturePicture picture, const std::vector<std::uint8_t>& bytes, std::size_t needed,
                         bool referred = true) {
        const auto& frame = frames[out.size()];
        picture.coded = bytes;
        out.push_back(
            write_texture_picture(picture, {frame.frame, frames[needed].frame, frame.timestamp_us, referred}));
    };
    TexturePicture picture;
    picture.width = picture.height = 128;
    picture.gains = gains;
    auto video = encoder_of(PictureCoder::av1, 128, 128);
    for (int time = 0; time < 3; ++time)
        add(picture, coded(video, OwnPlanes(board(128, 128, time))), static_cast<std::size_t>(std::max(time - 1, 0)),
            time < 2);
    add(picture, {1, 2, 3}, 3);
    out.back().payload[0] = 200;
    picture = {};
    picture.width = 97;
    picture.height = 66;
    picture.matrix = ColourMatrix::bt601;
    picture.full_range = true;
    auto other = encoder_of(PictureCoder::av1, 97, 66);
    add(picture, coded(other, OwnPlanes(board(97, 66, 4), picture.matrix, picture.full_range)), 4);
    picture = {};
    picture.coder = PictureCoder::vp9;
    picture.width = picture.height = 128;
    auto vp9 = encoder_of(PictureCoder::vp9, 128, 128);
    add(picture, coded(vp9, OwnPlanes(board(128, 128, 5))), 5);
    picture.coder = PictureCoder::png;
    picture.matrix = ColourMatrix::none;
    picture.width = picture.height = 32;
    picture.gains = gains;
    add(picture, *write_png_image(board(32, 32, 6)), 6);
    return out;
}

void write() {
    const auto charts = packets_in(folder / "charts_6.htvm");
    std::vector<Packet> frames, all;
    for (const auto& packet : charts)
        if (frame_type(packet.kind)) frames.push_back(packet);
    ASSERT_EQ(frames.size(), 7u);
    auto next = pictures(frames);
    std::size_t written = 0;
    std::vector<std::uint8_t> bytes;
    const auto put = [&](const Packet& packet) {
        const auto more = write_packet(packet);
        bytes.insert(bytes.end(), more.begin(), more.end());
        all.push_back(packet);
    };
    for (const auto& packet : charts) {
        if (packet.kind == PacketKind::index) continue;
        put(packet);
        if (frame_type(packet.kind)) put(next[written++]);
    }
    ASSERT_LE(bytes.size(), 40000u) << "the repository holds small streams only";
    std::ofstream(folder / "pictures_6.htvm", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::ofstream(folder / "pictures_6.pictures") << pictures_of(all);
    fs::copy_file(folder / "charts_6.digests", folder / "pictures_6.digests", fs::copy_options::overwrite_existing);
}

TEST(PictureConformance, StoredPicturesDecodeToTheirDigests) {
    const char* asked_for = std::getenv("HTVM_WRITE_CONFORMANCE");
    if (asked_for && asked_for == std::string("pictures_6")) write();
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is missing";
    EXPECT_EQ(pictures_of(packets_in(folder / "pictures_6.htvm")), lines_in(folder / "pictures_6.pictures"));
    EXPECT_EQ(lines_in(folder / "pictures_6.digests"), lines_in(folder / "charts_6.digests"));
}

// Four frames of `htvm synth`, 64 x 64 pixels, transcoded; pictures_h264.pictures is as that of pictures_6, but for the
// digests of what is decoded.
TEST(PictureConformance, PicturesOfH264AreReadAndLeftToBrowsers) {
    const fs::path data = HTVM_TEST_DATA;
    if (!fs::exists(data)) GTEST_SKIP() << data << " is missing";
    std::string read;
    PictureDecoder decoder;
    for (const auto& packet : packets_in(data / "pictures_h264.htvm")) {
        if (packet.kind != PacketKind::texture) continue;
        read += as_written(packet) + "\n";
        const auto taken = decoder.decode(packet);
        ASSERT_FALSE(taken);
        EXPECT_EQ(taken.error().kind, ErrorKind::unsupported);
    }
    EXPECT_EQ(read, lines_in(data / "pictures_h264.pictures"));
    EXPECT_EQ(std::count(read.begin(), read.end(), '\n'), 4);
}

}  // namespace
}  // namespace htvm
