#include "codec/format/frame_payload.h"

#include <gtest/gtest.h>

#include "codec/hostile_bytes.h"
#include "core/bytes.h"

namespace htvm::internal {
namespace {

FramePayload full_payload() {
    FramePayload payload;
    payload.header = {100000, 200000, 90000, 180000, 1u << 24, 255, intra_coder_draco, 17, 0x7FFFFFFF};
    payload.set(Layer::pose, {1, 2, 3});
    payload.set(Layer::geometry, std::vector<std::uint8_t>(1500, 7));
    payload.set(Layer::mapping, {});
    payload.set(Layer::external_intra, {9});
    return payload;
}

TEST(FramePayload, ComesBackLayerByLayer) {
    for (const auto& payload : {FramePayload{}, full_payload()}) {
        const auto bytes = write_frame_payload(payload);
        const auto read = read_frame_payload(bytes);
        ASSERT_TRUE(read.has_value()) << read.error().message;
        EXPECT_EQ(copy_of(*read).layers, payload.layers);
        EXPECT_EQ(read->present, payload.present);
        const auto &a = read->header, &b = payload.header;
        EXPECT_EQ(a.source_vertices, b.source_vertices);
        EXPECT_EQ(a.source_triangles, b.source_triangles);
        EXPECT_EQ(a.vertices, b.vertices);
        EXPECT_EQ(a.triangles, b.triangles);
        EXPECT_EQ(a.geometry_step, b.geometry_step);
        EXPECT_EQ(a.colour_step, b.colour_step);
        EXPECT_EQ(a.intra_coder, b.intra_coder);
        EXPECT_EQ(a.geometry_codebook, b.geometry_codebook);
        EXPECT_EQ(a.colour_codebook, b.colour_codebook);
    }
}

TEST(FramePayload, AnEmptyLayerIsPresent) {
    const auto bytes = write_frame_payload(full_payload());
    const auto read = read_frame_payload(bytes);
    EXPECT_TRUE(read->has(Layer::mapping));
    EXPECT_FALSE(read->has(Layer::colour));
}

// A payload with the given layer numbers, three bytes each.
std::vector<std::uint8_t> with_layers(const std::vector<std::uint8_t>& numbers) {
    ByteWriter out;
    for (const unsigned v : {1u, 1u, 1u, 1u, 1u, 1u, 0u, 0u, 0u}) out.varint(v);
    out.u8(static_cast<std::uint8_t>(numbers.size()));
    for (const auto number : numbers) {
        out.u8(number);
        out.varint(3);
    }
    for (const auto number : numbers)
        for (int i = 0; i < 3; ++i) out.u8(number);
    return out.take();
}

TEST(FramePayload, LayersOfUnknownNumbersAreSkipped) {
    const auto bytes = with_layers({200, 3, 99, 4});
    const auto read = read_frame_payload(bytes);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(copy_of(*read).of(Layer::geometry), (std::vector<std::uint8_t>{3, 3, 3}));
    EXPECT_EQ(copy_of(*read).of(Layer::colour), (std::vector<std::uint8_t>{4, 4, 4}));
}

TEST(FramePayload, LayersThatAreReadLieInTheBytes) {
    const auto bytes = with_layers({3, 4});
    const auto read = read_frame_payload(bytes);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->of(Layer::geometry).data(), bytes.data() + bytes.size() - 6);
    EXPECT_EQ(read->of(Layer::colour).data(), bytes.data() + bytes.size() - 3);
}

TEST(FramePayload, ALayerThatComesTwiceIsAnError) {
    EXPECT_FALSE(read_frame_payload(with_layers({3, 4, 3})).has_value());
}

TEST(FramePayload, StepsOutOfRangeAreRefused) {
    for (const auto& [geometry, colour] :
         std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 1}, {(1u << 24) + 1, 1}, {1, 0}, {1, 256}}) {
        FramePayload payload;
        payload.header.geometry_step = geometry;
        payload.header.colour_step = colour;
        const auto read = read_frame_payload(write_frame_payload(payload));
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(FramePayload, EveryTruncationIsAnError) {
    const auto bytes = write_frame_payload(full_payload());
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(read_frame_payload(std::span(bytes).first(size)).has_value()) << size;
}

TEST(FramePayload, DamageGivesAnErrorOrNoMoreThanTheBytesHold) {
    hostile::try_everything(
        write_frame_payload(full_payload()),
        [](const std::vector<std::uint8_t>& bytes) {
            const auto read = read_frame_payload(bytes);
            if (!read) {
                EXPECT_EQ(read.error().kind, ErrorKind::corrupt_stream);
                return;
            }
            std::size_t total = 0;
            for (const auto& layer : read->layers) total += layer.size();
            EXPECT_LT(total, bytes.size());
        },
        2000);
}

}  // namespace
}  // namespace htvm::internal
