// Limbs that are followed, patched or lost: by hand, where the answer is known.
#include "limb_events.h"

#include <gtest/gtest.h>

#include "metrics/shapes.h"
#include "synth/motion.h"

namespace htvm::lab {
namespace {

constexpr auto hand = static_cast<std::size_t>(synth::Part::left_hand);

// A square of 100 mm at z = height is the hand, with 36 marks.
Mesh hand_at(float height) { return shapes::plane(100, 10, height); }

std::vector<SurfaceMark> hand_marks() { return std::vector<SurfaceMark>(36, {hand, {}}); }

SyntheticFrame frame_of(int number, float true_height, Mesh decoded) {
    SyntheticFrame frame;
    frame.number = number;
    frame.surface = hand_at(true_height);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 6; ++x) {
            frame.truth.positions.push_back(
                {20.3f + 10 * static_cast<float>(x), 20.7f + 10 * static_cast<float>(y), true_height});
            frame.truth.normals.push_back({0, 0, 1});
        }
    frame.truth.limbs.resize(1);
    frame.truth.limbs[0].part = hand;
    frame.decoded = std::move(decoded);
    frame.type = number == 0 ? FrameType::intra : FrameType::tracked;
    frame.topology = 1;
    frame.kept_triangles = number == 0 ? 0 : frame.decoded.triangles.size();
    return frame;
}

LimbInFrame measured(LimbMeter& meter, const SyntheticFrame& frame) {
    const auto limbs = meter.add(frame);
    EXPECT_TRUE(limbs.has_value());
    EXPECT_EQ(limbs->limbs.size(), 1u);
    return limbs->limbs.at(0);
}

TEST(LimbMeter, ALimbIsRightWhereItsSurfaceIsAndWrongWhereItStaysBehind) {
    LimbMeter meter(hand_marks());
    EXPECT_EQ(measured(meter, frame_of(0, 0, hand_at(0))).right, 1);
    EXPECT_EQ(measured(meter, frame_of(1, 300, hand_at(296))).right, 1);
    EXPECT_EQ(measured(meter, frame_of(2, 600, hand_at(300))).right, 0);
}

TEST(LimbMeter, ALimbThatStaysBehindIsWrongThoughSomethingElseCoversItsPlace) {
    Mesh two = hand_at(0);
    const Mesh cover = hand_at(300);
    const auto shift = static_cast<std::uint32_t>(two.positions.size());
    two.positions.insert(two.positions.end(), cover.positions.begin(), cover.positions.end());
    for (const auto& t : cover.triangles) two.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    LimbMeter meter(hand_marks());
    EXPECT_EQ(measured(meter, frame_of(0, 0, two)).right, 1);
    EXPECT_EQ(measured(meter, frame_of(1, 300, two)).right, 0);
    // Where triangles are new, it is the cover that is on the limb.
    auto anew = frame_of(2, 300, two);
    anew.topology = 2;
    EXPECT_EQ(measured(meter, anew).right, 1);
}

TEST(LimbMeter, MarksThatTheCaptureDoesNotShowAreNotCounted) {
    auto frame = frame_of(0, 0, hand_at(50));
    for (std::size_t i = 0; i < 30; ++i) frame.truth.positions[i][2] = 8;
    LimbMeter meter(hand_marks());
    EXPECT_TRUE(measured(meter, frame).hidden);
    EXPECT_FALSE(measured(meter, frame_of(1, 0, hand_at(50))).hidden);
}

TEST(LimbMeter, TellsHowMuchOfALimbIsOnThePatch) {
    LimbMeter meter(hand_marks());
    auto frame = frame_of(1, 0, hand_at(0));
    frame.type = FrameType::patched;
    frame.kept_triangles = 100;  // the lower half of 10 x 10 squares
    EXPECT_NEAR(measured(meter, frame).renewed, 0.5, 1e-9);
}

// A stream of frames 10, 11, ... from a word: I and i, made of the tracked mesh; T; P, a TP-frame with half of the limb
// on its patch; p, with another part on it. Wrong frames: in lower case behind them, x.
std::vector<FrameOfLimbs> stream(const std::string& word) {
    std::vector<FrameOfLimbs> out;
    for (const char c : word) {
        if (c == 'x') {
            out.back().limbs[0].right = 0.5;
            continue;
        }
        FrameOfLimbs frame;
        frame.number = 10 + static_cast<int>(out.size());
        frame.type = c == 'I' || c == 'i'   ? FrameType::intra
                     : c == 'P' || c == 'p' ? FrameType::patched
                                            : FrameType::tracked;
        frame.renewal = c == 'i';
        frame.limbs.push_back({hand, false, 1, c == 'P' ? 0.5 : 0.01});
        out.push_back(frame);
    }
    return out;
}

// The outcome of an event in frames 12 and 13, with two frames behind it.
LimbOutcome outcome(const std::string& word) {
    LimbRule rule;
    rule.frames_after = 2;
    const LimbEvent event{LimbEventKind::fast, hand, 0, 12, 13, 300};
    return judge_events(std::vector{event}, stream(word), rule).at(0).outcome;
}

TEST(JudgedEvents, AreFollowedWhereTFramesAreRight) {
    EXPECT_EQ(outcome("ITTTTTTT"), LimbOutcome::followed);
    EXPECT_EQ(outcome("ITxTTTTTxT"), LimbOutcome::followed);  // wrong before and behind
    EXPECT_EQ(outcome("ITTpTTTT"), LimbOutcome::followed);    // another part is patched
    EXPECT_EQ(outcome("ITTiTTTT"), LimbOutcome::followed);    // nothing was lost for that I-frame
}

TEST(JudgedEvents, ArePatchedWhereAPatchMakesTheLimbRight) {
    EXPECT_EQ(outcome("ITTPTTTT"), LimbOutcome::patched);
    EXPECT_EQ(outcome("ITTxTxPTTT"), LimbOutcome::patched);
    EXPECT_EQ(outcome("ITTTTPTT"), LimbOutcome::patched);
    EXPECT_EQ(outcome("ITTTTTPT"), LimbOutcome::followed);  // too late to belong to it
}

TEST(JudgedEvents, AreIFramesWhereOneOfTheCaptureCame) {
    EXPECT_EQ(outcome("ITTxITTT"), LimbOutcome::intra);
    EXPECT_EQ(outcome("ITTPITTT"), LimbOutcome::intra);
}

TEST(JudgedEvents, AreLostWhereTheLimbIsWrongAndNotMended) {
    EXPECT_EQ(outcome("ITTxTTTT"), LimbOutcome::lost);  // right again by chance, but it was seen
    EXPECT_EQ(outcome("ITTTTxTT"), LimbOutcome::lost);
    EXPECT_EQ(outcome("ITTxpTTT"), LimbOutcome::lost);
    EXPECT_EQ(outcome("ITTPxTTT"), LimbOutcome::lost);  // the patch did not help
    EXPECT_EQ(outcome("ITTPTxTT"), LimbOutcome::lost);
    EXPECT_EQ(outcome("ITTxITxTT"), LimbOutcome::lost);
}

TEST(JudgedEvents, AreHiddenWhereTheLimbIsNeverShown) {
    auto frames = stream("ITTTTTTT");
    for (auto& frame : frames) frame.limbs[0].hidden = true;
    const LimbEvent event{LimbEventKind::occluded, hand, 0, 12, 13, 0};
    const auto judged = judge_events(std::vector{event}, frames).at(0);
    EXPECT_EQ(judged.outcome, LimbOutcome::hidden);
    OutcomeCounts counts;
    add(counts, judged);
    EXPECT_EQ(counts.counted(), 0u);
    EXPECT_EQ(counts.followed_share(), 1);
}

TEST(JudgedEvents, AreCountedByOutcome) {
    OutcomeCounts counts;
    for (const auto outcome : {LimbOutcome::followed, LimbOutcome::followed, LimbOutcome::followed,
                               LimbOutcome::patched, LimbOutcome::hidden})
        add(counts, {{}, outcome, 1, 0});
    EXPECT_EQ(counts.counted(), 4u);
    EXPECT_EQ(counts[LimbOutcome::patched], 1u);
    EXPECT_EQ(counts.followed_share(), 0.75);
}

TEST(LimbEvents, OfAPersonWhoHardlyMovesAreFollowed) {
    SyntheticOptions options;
    options.synth.motion = SynthMotion::calm;
    options.synth.vertices = 6000;
    auto marks = surface_marks(options.synth, 2000);
    auto stream = SyntheticStream::start(options, marks);
    ASSERT_TRUE(stream.has_value());
    LimbMeter meter(marks);
    for (int i = 0; i < 3; ++i) {
        const auto frame = stream->next();
        ASSERT_TRUE(frame.has_value()) << frame.error().message;
        EXPECT_EQ(frame->number, i);
        EXPECT_EQ(frame->type, i == 0 ? FrameType::intra : FrameType::tracked);
        EXPECT_EQ(frame->kept_triangles, i == 0 ? 0 : frame->decoded.triangles.size());
        EXPECT_EQ(frame->recoded, i == 0 ? 1 : 0);
        const auto limbs = meter.add(*frame);
        ASSERT_TRUE(limbs.has_value());
        ASSERT_EQ(limbs->limbs.size(), 4u);
        for (const auto& limb : limbs->limbs) {
            EXPECT_FALSE(limb.hidden);
            EXPECT_GE(limb.right, 0.95) << part_name(limb.part) << " in frame " << i;
        }
    }
}

}  // namespace
}  // namespace htvm::lab
