// Captures that somebody has tracked already: the same connectivity frame after frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "codec/test_sequences.h"

namespace htvm::internal {
namespace {

using namespace test;

// A person who turns head over heels, by a third of a circle from each frame to the next.
TestSequence tumbling(int frames) {
    const auto person = synthetic_frame(1500, 60).mesh;
    TestSequence out{"tumbling", {}, {}};
    for (int t = 0; t < frames; ++t) {
        auto mesh = person;
        const double angle = t * 2 * std::numbers::pi / 3;
        const auto cosine = static_cast<float>(std::cos(angle)), sine = static_cast<float>(std::sin(angle));
        const auto turn = [&](std::vector<Vector3f>& vectors) {
            for (auto& v : vectors) v = {v[0], cosine * v[1] + sine * v[2], cosine * v[2] - sine * v[1]};
        };
        turn(mesh.positions);
        turn(mesh.normals);
        out.frames.push_back({std::move(mesh), {}});
    }
    return out;
}

std::size_t intra_frames(const TestSequence& sequence, unsigned threads = 1) {
    auto options = default_options(Profile::tracked);
    options.threads = threads;
    options.latency_frames = threads > 1 ? 1 : 0;
    const auto coded = encode(sequence, options);
    return static_cast<std::size_t>(std::count_if(
        coded.infos.begin(), coded.infos.end(), [](const FrameInfo& info) { return info.type != FrameType::tracked; }));
}

TEST(KeptVertices, AreFollowedFartherThanASurfaceCanBe) {
    const auto sequence = tumbling(4);
    EXPECT_EQ(intra_frames(sequence), 1u);
    EXPECT_EQ(intra_frames(numbered_anew(sequence)), 1u);
    EXPECT_EQ(intra_frames(meshed_anew(sequence)), 4u);
}

TEST(KeptVertices, AreFollowedInFramesThatAreRegisteredAhead) { EXPECT_EQ(intra_frames(tumbling(6), 2), 1u); }

}  // namespace
}  // namespace htvm::internal
