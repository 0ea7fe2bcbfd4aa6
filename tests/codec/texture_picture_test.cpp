#include <gtest/gtest.h>

#include <vector>

#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"
#include "htvm/texture.hpp"

namespace htvm {
namespace {

const std::vector<std::uint8_t> bytes = {10, 11, 0, 0, 0};

TexturePicture small_picture() {
    return {PictureCoder::vp9, ColourMatrix::bt601, true, 300, 200, {4096, 5000, 65535}, bytes};
}

void expect_same(const TexturePicture& a, const TexturePicture& b) {
    EXPECT_EQ(a.coder, b.coder);
    EXPECT_EQ(a.matrix, b.matrix);
    EXPECT_EQ(a.full_range, b.full_range);
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.gains, b.gains);
    EXPECT_EQ(std::vector(a.coded.begin(), a.coded.end()), std::vector(b.coded.begin(), b.coded.end()));
}

TEST(TexturePicture, ComesBack) {
    const auto packet = write_texture_picture(small_picture(), {7, 6, 233333, true});
    EXPECT_EQ(packet.kind, PacketKind::texture);
    EXPECT_EQ(packet.frame, 7u);
    EXPECT_EQ(packet.reference, 6u);
    EXPECT_EQ(packet.timestamp_us, 233333);
    EXPECT_EQ(packet.flags, packet_flag::flags_valid | packet_flag::referred);
    const auto picture = read_texture_picture(packet);
    ASSERT_TRUE(picture) << picture.error().message;
    expect_same(*picture, small_picture());
}

TEST(TexturePicture, IsWrittenAsTheDocumentSays) {
    const auto packet = write_texture_picture(small_picture(), {0, 0, 0, false});
    EXPECT_EQ(packet.flags, packet_flag::flags_valid | packet_flag::access | packet_flag::droppable);
    EXPECT_EQ(packet.payload, (std::vector<std::uint8_t>{2, 6 | 16, 0xac, 0x02, 0xc8, 0x01, 0x00, 0x10, 0x88, 0x13,
                                                         0xff, 0xff, 10, 11, 0, 0, 0}));
}

TEST(TexturePicture, AnImageFileHasNoMatrix) {
    auto image = small_picture();
    image.coder = PictureCoder::webp;
    const auto picture = read_texture_picture(write_texture_picture(image, {3, 3, 0, true}));
    ASSERT_TRUE(picture) << picture.error().message;
    EXPECT_EQ(picture->matrix, ColourMatrix::none);
    EXPECT_FALSE(picture->full_range);
}

TEST(TexturePicture, AnImageFileNeedsNoOther) {
    auto image = small_picture();
    image.coder = PictureCoder::png;
    EXPECT_FALSE(read_texture_picture(write_texture_picture(image, {3, 2, 0, true})));
}

TEST(TexturePicture, CutShortBeforeTheCodersBytesIsAnError) {
    const auto whole = write_texture_picture(small_picture(), {});
    for (std::size_t size = 0; size <= whole.payload.size() - bytes.size(); ++size) {
        auto packet = whole;
        packet.payload.resize(size);
        const auto picture = read_texture_picture(packet);
        ASSERT_FALSE(picture) << size;
        EXPECT_EQ(picture.error().kind, ErrorKind::corrupt_stream) << size;
    }
}

TEST(TexturePicture, SidesOutOfRangeAreAnError) {
    for (const auto& [width, height] : {std::pair{0u, 8u}, {8u, 0u}, {4097u, 8u}, {8u, 4097u}}) {
        auto picture = small_picture();
        picture.width = width;
        picture.height = height;
        EXPECT_FALSE(read_texture_picture(write_texture_picture(picture, {})));
    }
    auto largest = small_picture();
    largest.width = largest.height = 4096;
    EXPECT_TRUE(read_texture_picture(write_texture_picture(largest, {})));
}

TEST(TexturePicture, OtherCodersAndMatricesAreUnsupported) {
    for (const std::size_t field : {0, 1}) {
        auto packet = write_texture_picture(small_picture(), {});
        packet.payload[field] = 9;
        const auto picture = read_texture_picture(packet);
        ASSERT_FALSE(picture);
        EXPECT_EQ(picture.error().kind, ErrorKind::unsupported);
    }
}

// ---- What pictures need -------------------------------------------------------------------------------------------

PacketHeader header_of(PacketKind kind, std::uint32_t frame, std::uint32_t reference) {
    PacketHeader out;
    out.kind = kind;
    out.flags = packet_flag::flags_valid | packet_flag::referred;
    out.frame = frame;
    out.reference = reference;
    return out;
}

using Places = std::vector<std::uint64_t>;

// I0 picture, T1 picture, T2 picture (key), T3 picture.
std::vector<PacketHeader> pictures_of_four_frames() {
    using enum PacketKind;
    return {header_of(sequence, 0, 1), header_of(intra, 0, 0),   header_of(texture, 0, 0),
            header_of(tracked, 1, 0),  header_of(texture, 1, 0), header_of(tracked, 2, 1),
            header_of(texture, 2, 2),  header_of(tracked, 3, 2), header_of(texture, 3, 2)};
}

TEST(TexturePicture, NeedsThePicturesSinceTheLastKeyPictureAndNoFrame) {
    const auto packets = pictures_of_four_frames();
    EXPECT_EQ(closure(packets, 4), (std::vector<std::size_t>{0, 2, 4}));
    EXPECT_EQ(closure(packets, 6), (std::vector<std::size_t>{0, 6}));
    EXPECT_EQ(closure(packets, 8), (std::vector<std::size_t>{0, 6, 8}));
}

TEST(TexturePicture, NoFrameNeedsIt) {
    const auto packets = pictures_of_four_frames();
    EXPECT_EQ(closure(packets, 7), (std::vector<std::size_t>{0, 1, 3, 5, 7}));
    Decoder decoder;
    const auto decoded = decoder.decode(write_texture_picture(small_picture(), {}));
    ASSERT_TRUE(decoded);
    EXPECT_FALSE(*decoded);
}

TEST(TexturePicture, WhoComesLateIsSentThoseSinceTheLastKeyPicture) {
    Dependencies dependencies;
    for (const auto& packet : pictures_of_four_frames()) dependencies.push(packet);
    EXPECT_EQ(dependencies.kept(), (Places{0, 1, 3, 5, 6, 7, 8}));
    EXPECT_EQ(dependencies.closure(), (Places{0, 1, 3, 5, 7}));
    EXPECT_EQ(dependencies.picture_closure(), (Places{0, 6, 8}));
}

TEST(TexturePicture, WithoutTheOneBeforeItCannotBeShown) {
    auto packets = pictures_of_four_frames();
    packets.erase(packets.begin() + 2);
    EXPECT_TRUE(closure(packets, 3).empty());
    EXPECT_EQ(closure(packets, 5), (std::vector<std::size_t>{0, 5}));
}

TEST(TexturePicture, OneThatIsNotReferredToIsNotKept) {
    auto packets = pictures_of_four_frames();
    packets[4].flags = packet_flag::flags_valid | packet_flag::droppable;
    Dependencies dependencies;
    for (std::size_t i = 0; i <= 4; ++i) dependencies.push(packets[i]);
    EXPECT_EQ(dependencies.picture_closure(), (Places{0, 2, 4}));
    EXPECT_EQ(dependencies.kept(), (Places{0, 1, 2, 3}));
}

TEST(TexturePicture, PicturesOfASequenceAreForgottenWithIt) {
    auto packets = pictures_of_four_frames();
    Dependencies dependencies;
    for (const auto& packet : packets) dependencies.push(packet);
    dependencies.push(header_of(PacketKind::sequence, 0, 2));
    EXPECT_TRUE(dependencies.picture_closure().empty());
    EXPECT_EQ(dependencies.kept(), (Places{9}));
}

TEST(TexturePicture, HowManyAreKeptIsBounded) {
    Dependencies dependencies(100);
    dependencies.push(header_of(PacketKind::sequence, 0, 1));
    dependencies.push(header_of(PacketKind::texture, 0, 0));
    for (std::uint32_t frame = 1; frame < 1000; ++frame) {
        dependencies.push(header_of(PacketKind::texture, frame, frame - 1));
        EXPECT_LE(dependencies.kept().size(), 101u);
        EXPECT_EQ(dependencies.picture_closure().empty(), frame >= 100);
    }
    dependencies.push(header_of(PacketKind::texture, 1000, 1000));
    EXPECT_EQ(dependencies.picture_closure().size(), 2u);
}

}  // namespace
}  // namespace htvm
