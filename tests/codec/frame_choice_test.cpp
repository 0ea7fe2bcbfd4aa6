// Which kind of frame a frame becomes (paper, section III-B, and beyond it).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/encoder/bones/scene_change.h"
#include "codec/enhanced_options.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "codec/without_reason.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;
using enum FrameType;

// One captured person, moved along x by the given millimetres in each frame, including the skeleton.
TestSequence carried(const std::vector<double>& places) {
    SynthOptions options;
    options.vertices = 1200;
    const auto person = synth_frame(options, 40);
    TestSequence out{"carried", synth_skeleton(), {}};
    for (const double x : places) {
        SequenceFrame frame{person.mesh, person.pose};
        for (auto& p : frame.mesh.positions) p[0] += static_cast<float>(x);
        for (auto& joint : frame.pose->joints) joint[0] += x;
        out.frames.push_back(std::move(frame));
    }
    return out;
}

EncoderOptions by_motion() {
    EncoderOptions options = test::enhanced_options();
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 14 * 10;  // 14 bones that each moved 10 mm
    options.topology.intra_above = 14 * 40;
    return options;
}

TEST(ChoiceByMotion, GoesByTheShiftsOfAllBonesSinceTheLastIntraFrame) {
    const auto coded = encode(carried({0, 5, 9, 11, 39, 41, 45, 52, 82}), by_motion());
    EXPECT_EQ(types_of(coded),
              (std::vector{intra, predicted, predicted, enhanced, enhanced, intra, predicted, enhanced, intra}));
    for (std::size_t t = 0; t < coded.infos.size(); ++t)
        EXPECT_EQ(coded.infos[t].reference, t < 5 ? 0u : t < 8 ? 5u : 8u);
}

TEST(ChoiceByMotion, WaitsForTheLeastKeyInterval) {
    auto options = by_motion();
    options.least_key_interval = 3;
    EXPECT_EQ(types_of(encode(carried({0, 100, 100, 100, 100}), options)),
              (std::vector{intra, enhanced, enhanced, intra, predicted}));
}

TEST(ChoiceByMotion, CodesAfterAllWhatDoesNotFitTheCapture) {
    auto sequence = carried({0, 0, 0});
    for (auto& p : sequence.frames[1].mesh.positions)  // the skeleton stands still, the lower half does not
        if (p[1] < 900) p[2] += 30;
    EXPECT_EQ(types_of(encode(sequence, by_motion())), (std::vector{intra, enhanced, predicted}));
    auto unchecked = by_motion();
    unchecked.topology.animation_error = 0;
    EXPECT_EQ(types_of(encode(sequence, unchecked)), (std::vector{intra, predicted, predicted}));
}

// A walking person, from the synthetic capture.
TestSequence on_foot(int frames, double size = 1) {
    SynthOptions options;
    options.vertices = 1500;
    TestSequence out{"on foot", synth_skeleton(), {}};
    for (int f = 0; f < frames; ++f) {
        const auto captured = synth_frame(options, 40 + f);
        SequenceFrame frame{captured.mesh, captured.pose};
        for (auto& p : frame.mesh.positions)
            for (auto& c : p) c *= static_cast<float>(size);
        for (auto& joint : frame.pose->joints)
            for (auto& c : joint) c *= size;
        out.frames.push_back(std::move(frame));
    }
    return out;
}

TEST(ChoiceOfTheCheaper, IsIntraFramesAsTheyAreAloneWhereNoSkeletonHelps) {
    auto sequence = on_foot(4);
    sequence.skeleton = {};
    for (auto& frame : sequence.frames) frame.pose.reset();
    auto alone = default_options(Profile::topology);
    alone.key_interval = 1;
    const auto chosen = encode(sequence, default_options(Profile::topology));
    EXPECT_EQ(types_of(chosen), (std::vector{intra, intra, intra, intra}));
    const auto expected = encode(sequence, alone);
    // All but the index, and the reasons, which only the choice has.
    EXPECT_EQ(chosen.packets[0].payload, expected.packets[0].payload);
    for (std::size_t i = 1; i + 1 < chosen.packets.size(); ++i)
        EXPECT_EQ(without_reason(chosen.packets[i].payload), expected.packets[i].payload);
}

TEST(ChoiceOfTheCheaper, TakesNoMoreBitsThanIntraFrames) {
    const auto person = on_foot(12);
    auto strangers = person;  // no frame helps to predict the next
    for (std::size_t f = 0; f < strangers.frames.size(); ++f)
        for (auto& p : strangers.frames[f].mesh.positions)
            p[0] += 30 * std::sin(p[1] * (0.05F + 0.013F * static_cast<float>(f)));
    const auto kinds_chosen = [](const TestSequence& sequence, double step) {
        auto options = default_options(Profile::topology);
        options.geometry_step = step;
        auto alone = options;
        alone.key_interval = 1;
        const auto chosen = encode(sequence, options);
        // If EP-frames do not pay off, the only remaining loss is the finer I-frame against which one is tried.
        EXPECT_LE(static_cast<double>(chosen.bytes.size()),
                  1.01 * static_cast<double>(encode(sequence, alone).bytes.size()));
        return types_of(chosen);
    };
    const auto of_person = kinds_chosen(person, 12);
    EXPECT_EQ(std::count(of_person.begin(), of_person.end(), enhanced), 11);
    const auto of_strangers = kinds_chosen(strangers, 1);
    EXPECT_GE(std::count(of_strangers.begin(), of_strangers.end(), intra), 4);
}

TEST(SizeOfTheSubject, DoesNotChangeTheKindsOfTrackedFrames) {
    const auto kinds_at = [](double size) {
        EncoderOptions options;
        options.geometry_step = 4 * size;
        return types_of(encode(on_foot(6, size), options));
    };
    const auto kinds = kinds_at(1);
    EXPECT_GE(std::count(kinds.begin(), kinds.end(), tracked), 4);
    EXPECT_EQ(kinds_at(0.1), kinds);
    EXPECT_EQ(kinds_at(10), kinds);
}

TEST(PredictedFrames, TakeTransformsAndNothingElse) {
    const auto coded = encode(carried({0, 5}), by_motion());
    const auto& bytes = coded.infos[1].bytes;
    EXPECT_EQ(bytes.total(), bytes[Layer::transforms] + bytes.overhead);
    EXPECT_LT(bytes.total(), 250u);
    EXPECT_EQ(coded.infos[1].vertices, coded.infos[0].vertices);
    EXPECT_EQ(coded.infos[1].source_vertices, coded.infos[0].source_vertices);
    EXPECT_EQ(coded.reconstructions[1].triangles, coded.reconstructions[0].triangles);
}

TEST(SceneChanges, ForceAnIntraFrameUnlessSwitchedOff) {
    auto sequence = carried({0, 0, 0});
    auto& mesh = sequence.frames[2].mesh;  // another person enters
    const auto one = mesh;
    const auto n = static_cast<std::uint32_t>(one.positions.size());
    for (const auto& p : one.positions) mesh.positions.push_back({p[0], p[1], p[2] + 1200});
    for (const auto& t : one.triangles) mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    mesh.colours.insert(mesh.colours.end(), one.colours.begin(), one.colours.end());
    EncoderOptions options = test::enhanced_options();
    EXPECT_EQ(types_of(encode(sequence, options)), (std::vector{intra, enhanced, intra}));
    options.topology.scene_changes = false;
    EXPECT_EQ(types_of(encode(sequence, options)), (std::vector{intra, enhanced, enhanced}));
}

TEST(SceneChanges, AreMoreThanATenthOfEitherSurfaceFarFromTheOther) {
    std::vector<LatticePoint> near, more;
    for (int i = 0; i < 1000; ++i) near.push_back({i, 0, 0});
    more = near;
    EXPECT_FALSE(scene_changed(near, more, LatticeUnits(50)));
    for (int i = 0; i < 90; ++i) more.push_back({i, 5000, 0});
    EXPECT_FALSE(scene_changed(near, more, LatticeUnits(50)));
    for (int i = 0; i < 90; ++i) more.push_back({i, 6000, 0});
    EXPECT_TRUE(scene_changed(near, more, LatticeUnits(50)));
    EXPECT_TRUE(scene_changed(more, near, LatticeUnits(50)));
}

TEST(ChoiceByCost, TakesAPredictedFrameWhereNothingButThePlaceChanged) {
    EncoderOptions options = test::enhanced_options();
    options.topology.frame_choice = FrameChoice::rate_distortion;
    options.geometry_step = 8;  // the registration's own error is small compared to this
    auto sequence = carried({0, 30, 60});
    for (auto& frame : sequence.frames) frame.mesh.colours.clear();
    EXPECT_EQ(types_of(encode(sequence, options)), (std::vector{intra, predicted, predicted}));
}

TEST(ChoiceByCost, IsNeverWorseThanIntraFramesAtTheSameQuality) {
    const auto sequence = synthetic(true, 5);
    const auto errors_of = [&](const CodedSequence& coded, std::size_t t) {
        const auto &a = sequence.frames[t].mesh, &b = coded.reconstructions[t];
        return surface_errors({a.positions, a.triangles, a.colours}, {b.positions, b.triangles, b.colours});
    };
    for (const double quality : {25.0, 50.0}) {
        EncoderOptions options = test::enhanced_options();
        options.geometry_step = quality_steps(quality).geometry_step;
        options.colour_step = quality_steps(quality).colour_step;
        options.topology.frame_choice = FrameChoice::rate_distortion;
        const auto chosen = encode(sequence, options);
        options.key_interval = 1;
        const auto plain = encode(sequence, options);
        ASSERT_EQ(chosen.reconstructions.size(), plain.reconstructions.size());
        for (std::size_t t = 0; t < sequence.frames.size(); ++t) {
            // 5 % is allowed, and the encoder estimates from samples.
            EXPECT_LT(errors_of(chosen, t).geometry_rms, 1.12 * errors_of(plain, t).geometry_rms) << "frame " << t;
            EXPECT_LT(errors_of(chosen, t).colour_rms, 1.12 * errors_of(plain, t).colour_rms) << "frame " << t;
        }
    }
}

}  // namespace
}  // namespace htvm::internal
