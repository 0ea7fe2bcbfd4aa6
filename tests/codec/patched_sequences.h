// Sequences in which tracking is lost in one region.
#pragma once

#include <algorithm>
#include <vector>

#include "codec/ball.h"
#include "codec/enhanced_options.h"
#include "codec/test_sequences.h"

namespace htvm::test {

inline constexpr int never = 1 << 30;

// A ball of 300 mm with a horn of so many on top, which is on the right from frame `lost` on: no motion leads there.
// Its triangles are so regular that nothing says which vertex is which once they are numbered anew.
inline TestSequence horned_ball(int frames, int lost = 2, double horn = 150, double width = 0.12) {
    TestSequence out{"horned ball", {}, {}};
    for (int t = 0; t < frames; ++t) {
        const std::size_t axis = t < lost ? 2 : 0;
        const auto ball_now = ball(4, [&](const Vector3d& d) {
            return 300 + horn * std::clamp((d[axis] - (1 - width)) / (width - 0.02), 0.0, 1.0);
        });
        SequenceFrame frame;
        for (const auto p : ball_now.positions) {
            frame.mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
            const auto level = [](std::int32_t c) { return static_cast<std::uint8_t>(128 + c / 4); };
            frame.mesh.colours.push_back({level(p.x), level(p.y), level(p.z)});
        }
        frame.mesh.triangles = ball_now.triangles;
        out.frames.push_back(std::move(frame));
    }
    return numbered_anew(std::move(out));
}

inline std::vector<FrameType> types_of(const CodedSequence& coded) {
    std::vector<FrameType> out;
    for (const auto& info : coded.infos) out.push_back(info.type);
    return out;
}

inline EncoderOptions patched_options() {
    auto out = options_at_2_mm(Profile::tracked);
    out.subject_size = 1750;
    return out;
}

}  // namespace htvm::test
