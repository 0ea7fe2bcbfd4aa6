// I-frames that begin anew where tracking is not lost: see codec/encoder/tracked/fresh_reference.h.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "codec/patched_sequences.h"

namespace htvm::test {
namespace {

constexpr auto I = FrameType::intra, T = FrameType::tracked;
constexpr int changed = 14;  // the first frame with a relief all over

enum class Relief { stays, wanders };

// A ball of 300 mm with a relief of 6 mm below, which from frame `changed` on is above as well, where few vertices
// stand for what was smooth: the same in all frames, or in each frame elsewhere.
TestSequence ball_with_relief(int frames, Relief relief) {
    constexpr double per_millimetre = 100;
    TestSequence out{"ball with a relief", {}, {}};
    for (int t = 0; t < frames; ++t) {
        const auto ball_now = ball(5, [&](const Vector3d& d) {
            const bool above = d[2] > 0;
            const double phase = above && relief == Relief::wanders ? 2.0 * t : 0;
            const double wave = std::sin(45 * d[0] + phase) * std::sin(45 * d[1]) * std::sin(45 * d[2] + 1);
            return per_millimetre * (300 + (above && t < changed ? 0 : 6 * wave));
        });
        SequenceFrame frame;
        for (const auto p : ball_now.positions)
            frame.mesh.positions.push_back({static_cast<float>(p.x / per_millimetre),
                                            static_cast<float>(p.y / per_millimetre),
                                            static_cast<float>(p.z / per_millimetre)});
        frame.mesh.triangles = ball_now.triangles;
        out.frames.push_back(std::move(frame));
    }
    return meshed_anew(std::move(out));
}

EncoderOptions with_effort(int effort) {
    auto out = patched_options();
    out.tracked.effort = effort;
    out.tracked.group = 1;
    return out;
}

std::vector<FrameType> with_one_intra_frame(std::size_t at, std::size_t frames) {
    std::vector<FrameType> out(frames, T);
    out[0] = out[at] = I;
    return out;
}

TEST(FreshReferences, AreSentWhereTheirTFramesAreNearerThoughNothingIsLost) {
    const auto coded = encode(ball_with_relief(24, Relief::stays), with_effort(6));
    EXPECT_EQ(types_of(coded), with_one_intra_frame(20, 24));  // the second one that is measured far off
    EXPECT_EQ(coded.infos[20].reason, FrameReason::surface);
    const auto at_the_usual_effort = encode(ball_with_relief(24, Relief::stays), with_effort(5));
    EXPECT_EQ(types_of(at_the_usual_effort), with_one_intra_frame(0, 24));
}

TEST(FreshReferences, AreNotSentWhereTheirTFramesWouldBeAsFarOff) {
    const auto coded = encode(ball_with_relief(24, Relief::wanders), with_effort(6));
    EXPECT_EQ(types_of(coded), with_one_intra_frame(0, 24));
}

TEST(FreshReferences, AreNotSentWhereSomebodyWaits) {
    const auto sequence = ball_with_relief(22, Relief::stays);
    auto encoder = *Encoder::create(with_effort(6));
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
        ASSERT_TRUE(encoder.set_repair([] { return true; }));
        ASSERT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, 33333 * static_cast<std::int64_t>(i)));
        EXPECT_EQ(encoder.last_frame().type, i == 0 ? I : T);
    }
}

}  // namespace
}  // namespace htvm::test
