// The size of the subject does not matter: a doll's or a giant's capture, with steps in proportion, is coded as an
// adult's is.
#include <gtest/gtest.h>

#include "codec/enhanced_options.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"

namespace htvm::test {
namespace {

// The synthetic person's arms come down from a T-pose.
TestSequence arms_down(int frames) {
    TestSequence out{"arms down", {}, {}};
    for (int t = 0; t < frames; ++t) out.frames.push_back({synthetic_frame(2000, 2 * t).mesh, {}});
    return out;
}

TestSequence scaled(TestSequence sequence, double factor) {
    sequence.name += ", times " + std::to_string(factor);
    for (auto& frame : sequence.frames)
        for (auto& p : frame.mesh.positions)
            for (auto& c : p) c *= static_cast<float>(factor);
    return sequence;
}

std::vector<FrameType> kinds_of(const CodedSequence& coded) {
    std::vector<FrameType> out;
    for (const auto& info : coded.infos) out.push_back(info.type);
    return out;
}

struct OfSize {
    double factor;
    EncoderOptions options;
};

// The options for a tenth, for once and for ten times the size. Steps and sizes are in mm.
std::vector<OfSize> of_sizes(const EncoderOptions& options) {
    std::vector<OfSize> out;
    for (const double factor : {0.1, 1.0, 10.0}) {
        out.push_back({factor, options});
        out.back().options.geometry_step *= factor;
        out.back().options.subject_size *= factor;
    }
    return out;
}

void expect_the_same_for_any_size(const TestSequence& sequence, const EncoderOptions& options, double share) {
    const auto adult = encode(sequence, options);
    for (const auto& size : of_sizes(options)) {
        const auto other = scaled(sequence, size.factor);
        SCOPED_TRACE(other.name);
        const auto coded = encode(other, size.options);
        EXPECT_EQ(kinds_of(coded), kinds_of(adult));
        EXPECT_NEAR(static_cast<double>(coded.bytes.size()) / static_cast<double>(adult.bytes.size()), 1, share);
    }
}

TEST(SubjectSize, MotionIsCodedInTheSameFrameKindsAndAsManyBytes) {
    expect_the_same_for_any_size(arms_down(8), options_at_2_mm(Profile::tracked), 0.03);
}

TEST(SubjectSize, WhatIsLostIsPatchedForAnySize) {
    const auto sequence = horned_ball(4);
    // More may differ: a ball is so regular that rounding decides which of its edges are collapsed.
    expect_the_same_for_any_size(sequence, patched_options(), 0.1);
    EXPECT_EQ(encode(sequence, patched_options()).infos[2].type, FrameType::patched);
}

TEST(SubjectSize, ABitrateBuysTheSameErrorInProportion) {
    auto options = options_at_2_mm(Profile::tracked);
    options.rate.bits_per_second = 600'000;
    // Which steps the rate leads to decides whether the reference has levels.
    expect_the_same_for_any_size(arms_down(8), options, 0.12);
}

}  // namespace
}  // namespace htvm::test
