// I-frames where a capture is begun anew though tracking is not lost: see codec/encoder/tracked/fresh_reference.h.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "codec/patched_sequences.h"

namespace htvm::test {
namespace {

constexpr auto I = FrameType::intra, T = FrameType::tracked;
constexpr std::size_t changed = 20;  // the first frame of the other mesh

// A ball of 300 mm with a relief of 6 mm below, and above from frame `above` on, where few vertices stand for what was
// smooth: elsewhere in each frame. The same triangles in all frames before `changed`, and others from there on.
TestSequence ball_with_relief(std::size_t frames, std::size_t above) {
    constexpr double per_millimetre = 100;
    TestSequence out{"ball with a relief", {}, {}};
    for (std::size_t t = 0; t < frames; ++t) {
        const auto ball_now = ball(5, [&](const Vector3d& d) {
            const double phase = above < changed ? 2 * static_cast<double>(t) : 0;
            const double wave =
                std::sin(45 * d[0] + (d[2] > 0 ? phase : 0)) * std::sin(45 * d[1]) * std::sin(45 * d[2] + 1);
            return per_millimetre * (300 + (d[2] > 0 && t < above ? 0 : 6 * wave));
        });
        SequenceFrame frame;
        for (const auto p : ball_now.positions)
            frame.mesh.positions.push_back({static_cast<float>(p.x / per_millimetre),
                                            static_cast<float>(p.y / per_millimetre),
                                            static_cast<float>(p.z / per_millimetre)});
        frame.mesh.triangles = ball_now.triangles;
        flip_edges(frame.mesh, 4, t < changed ? 1 : 2);
        out.frames.push_back(std::move(frame));
    }
    return out;
}

EncoderOptions frame_by_frame() {
    auto out = patched_options();
    out.tracked.group = 1;
    return out;
}

std::vector<FrameType> with_intra_frames(std::vector<std::size_t> at, std::size_t frames) {
    std::vector<FrameType> out(frames, T);
    for (const auto t : at) out[t] = I;
    return out;
}

TEST(FreshReferences, AreSentAtOnceWhereTheCaptureIsBegunAnewAndFartherOff) {
    const auto coded = encode(numbered_anew(ball_with_relief(24, changed)), frame_by_frame());
    EXPECT_EQ(types_of(coded), with_intra_frames({0, changed}, 24));
    EXPECT_EQ(coded.infos[changed].reason, FrameReason::surface);
}

TEST(FreshReferences, AreSentOnceMoreWhereTheCaptureIsBegunAnewTwice) {
    auto sequence = ball_with_relief(25, changed);
    for (std::size_t t = changed + 1; t < 25; ++t) flip_edges(sequence.frames[t].mesh, 4, 3);
    for (std::size_t t = 0; t < 25; ++t)
        for (auto& p : sequence.frames[t].mesh.positions)
            if (t > changed && p[0] > 0) p[0] += 6 * std::sin(p[1] / 6) * std::sin(p[2] / 6);
    EXPECT_EQ(types_of(encode(sequence, frame_by_frame())), with_intra_frames({0, changed, changed + 1}, 25));
}

TEST(FreshReferences, AreNotSentWhereTheCaptureIsMeshedAnewInEachFrame) {
    EXPECT_EQ(types_of(encode(meshed_anew(ball_with_relief(24, changed)), frame_by_frame())),
              with_intra_frames({0}, 24));
}

TEST(FreshReferences, AreNotSentWhereTheirTFramesWouldBeAsFarOff) {
    EXPECT_EQ(types_of(encode(ball_with_relief(24, 1), frame_by_frame())), with_intra_frames({0}, 24));
}

TEST(FreshReferences, AreNotSentWhereSomebodyWaits) {
    const auto sequence = ball_with_relief(22, changed);
    auto encoder = *Encoder::create(frame_by_frame());
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
        ASSERT_TRUE(encoder.set_repair([] { return true; }));
        ASSERT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, 33333 * static_cast<std::int64_t>(i)));
        EXPECT_EQ(encoder.last_frame().type, i == 0 ? I : T);
    }
}

}  // namespace
}  // namespace htvm::test
