// The payload of T-frames: heads of any numbers, with and without colours and a frame before, and what the layers take.
#include "codec/tracked/tracked_payload.h"

#include <gtest/gtest.h>

#include "codec/hostile_bytes.h"

namespace htvm::internal {
namespace {

using test::below;

std::uint32_t any_count(std::mt19937& random) {
    return static_cast<std::uint32_t>(random()) >> (1 + below(random, 31));
}

std::uint32_t any_step(std::mt19937& random) {
    const auto out = static_cast<std::uint32_t>(random()) >> below(random, 32);
    return below(random, 4) == 0 ? 0 : std::min(out, FieldSteps::most);
}

TrackedHead any_head(std::mt19937& random, bool colours) {
    TrackedHead out;
    out.captured = {any_count(random), any_count(random)};
    out.motion = {static_cast<int>(below(random, 11)), static_cast<int>(below(random, 21))};
    out.displacement.step[0] = any_step(random);
    for (auto& c : out.projection.rows) c = static_cast<float>(below(random, 1000000)) / 999 - 500;
    if (!colours) return out;
    out.colour.turned = below(random, 2) == 0;
    for (auto& step : out.colour.step) step = any_step(random);
    if (below(random, 2) == 0) out.colour_run = any_count(random);
    if (below(random, 2) == 0) out.colour.step[1] = out.colour.step[0];
    return out;
}

std::vector<std::uint8_t> written(const TrackedHead& head, const KnownOfHead& known) {
    RangeEncoder encoder;
    write_tracked_head(encoder, head, known);
    return encoder.finish();
}

Result<TrackedHead> read(std::span<const std::uint8_t> bytes, const KnownOfHead& known) {
    RangeDecoder decoder(bytes);
    return read_tracked_head(decoder, known);
}

TEST(TrackedHead, OfAnyNumbersComesBackWithAndWithoutColoursAndAFrameBefore) {
    std::mt19937 random(1);
    for (int i = 0; i < 3000; ++i) {
        const bool colours = i % 2 == 0;
        const auto before = any_head(random, colours);
        auto head = any_head(random, colours);
        const auto of_reference = any_head(random, colours).projection;
        KnownOfHead known{nullptr, {any_count(random), any_count(random)}, colours, &of_reference};
        if (below(random, 4) == 0) head.projection = of_reference;
        EXPECT_EQ(read(written(head, known), known).value(), head);
        known.before = &before;
        head.colour.turned = before.colour.turned;
        if (below(random, 3) == 0) head.captured = before.captured;
        if (below(random, 3) == 0) head.motion = before.motion;
        if (below(random, 3) == 0) head.displacement = before.displacement;
        if (below(random, 3) == 0) head.colour = before.colour;
        if (below(random, 3) == 0) head.projection = before.projection;
        EXPECT_EQ(read(written(head, known), known).value(), head);
    }
}

TEST(TrackedHead, ThatIsAsBeforeTakesAByteAndOneOfAnotherCaptureAsManyMoreAsItsCountsDiffer) {
    TrackedHead before;
    before.captured = {26000, 52000};
    before.displacement.step[0] = 4506;
    before.colour = {true, {8730, 8730, 8730}};
    const KnownOfHead known{&before, {}, true, &before.projection};
    EXPECT_LE(written(before, known).size(), 1u);
    auto head = before;
    head.captured = {26400, 52800};  // two triangles for each vertex, as on a closed surface
    EXPECT_LE(written(head, known).size(), 4u);
}

TEST(TrackedHead, WithStepsOutOfRangeIsRefused) {
    const KnownOfHead known{nullptr, {}, true};
    for (const int which : {0, 1, 2, 3}) {
        TrackedHead head;
        if (which == 0) head.motion.rotation_exponent = NodeMotionSteps::most_rotation + 1;
        if (which == 1) head.motion.shift_exponent = NodeMotionSteps::most_shift + 1;
        if (which == 2) head.displacement.step[0] = FieldSteps::most + 1;
        if (which == 3) head.colour.step[2] = FieldSteps::most + 1;
        const auto refused = read(written(head, known), known);
        ASSERT_FALSE(refused.has_value());
        EXPECT_EQ(refused.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(TrackedHead, FromAnyBytesIsInRangeOrRefused) {
    std::mt19937 random(3);
    const auto before = any_head(random, true);
    for (const auto* of_before : {static_cast<const TrackedHead*>(nullptr), &before}) {
        const KnownOfHead known{of_before, {2147483647, 0}, true};
        hostile::try_everything(written(before, known), [&](const std::vector<std::uint8_t>& bytes) {
            const auto head = read(bytes, known);
            if (!head) return;
            EXPECT_LE(head->captured.vertices, 0x7FFFFFFFu);
            EXPECT_LE(head->captured.triangles, 0x7FFFFFFFu);
            EXPECT_LE(head->motion.rotation_exponent, NodeMotionSteps::most_rotation);
            for (const auto step : head->colour.step) EXPECT_LE(step, FieldSteps::most);
        });
    }
}

TEST(LayerShares, AreWhatIsBetweenTheEndsAndNoMoreThanThereIs) {
    const auto shares = layer_shares({2, 50, 50, 90}, 92, 0);
    EXPECT_EQ(shares[Layer::transforms], 48u);
    EXPECT_EQ(shares[Layer::geometry], 0u);
    EXPECT_EQ(shares[Layer::colour], 40u);
    EXPECT_EQ(shares.total(), 88u);
    EXPECT_EQ(layer_shares({2, 50, 70, 73}, 71, 0).total(), 69u);  // where zeros were cut off
    EXPECT_EQ(layer_shares({2, 3, 4, 4}, 0, 0).total(), 0u);
}

TEST(LayerShares, OfPresenceAreWhatIsBetweenTheHeadAndTheMotion) {
    const auto shares =
        layer_shares({.head = 2, .motion = 50, .displacement = 60, .colour = 60, .presence = 12}, 92, 0);
    EXPECT_EQ(shares[Layer::presence], 10u);
    EXPECT_EQ(shares[Layer::transforms], 38u);
    EXPECT_EQ(layer_shares({2, 50, 60, 60}, 92, 0)[Layer::presence], 0u);
}

TEST(LayerShares, OfColoursInTheirOwnRunAreAllOfIt) {
    const auto shares = layer_shares({2, 50, 60, 60}, 92, 30);
    EXPECT_EQ(shares[Layer::transforms], 48u);
    EXPECT_EQ(shares[Layer::geometry], 10u);
    EXPECT_EQ(shares[Layer::colour], 30u);
    EXPECT_EQ(layer_shares({2, 50, 70, 70}, 92, 92).total(), 92u);
}

}  // namespace
}  // namespace htvm::internal
