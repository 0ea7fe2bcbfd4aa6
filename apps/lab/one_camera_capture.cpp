#include "one_camera_capture.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "command_line/terminal.h"
#include "core/parallel.h"
#include "synth/depth_cameras.h"
#include "synth/synth.h"

namespace htvm::lab {

using namespace app;
using namespace internal;

Result<OneCameraCapture> one_camera_capture(int frames, const SourceOptions& options, Threads threads) {
    const DepthCameraOptions camera;
    SynthOptions synth{.motion = SynthMotion::calm, .vertices = body_vertices(camera)};
    const auto count = static_cast<std::size_t>(frames);
    std::vector<SourceFrame> made(count);
    OneCameraCapture out;
    out.true_poses.resize(count);
    out.key =
        fmt::format("{} frames of calm motion before one {}, seed {}", frames, sensor_name(camera.sensor), synth.seed);
    note(fmt::format("making {}", out.key));
    parallel_for(count, threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const int number = static_cast<int>(i);
            auto frame = synth_frame(synth, number);
            made[i].index = i;
            made[i].mesh = capture_depth(synth, camera, frame, number).mesh;
            made[i].timestamp_us = std::llround(1e6 * number / synth.fps);
            made[i].pose = std::move(frame.pose);
            out.true_poses[i] = std::move(frame.true_pose);
        }
    });
    SequenceFacts facts;
    facts.fps = synth.fps;
    facts.skeleton = synth_skeleton();
    auto source = SourceFrames::of(std::move(made), std::move(facts), options);
    if (!source) return tl::unexpected(source.error());
    out.source = std::move(*source);
    return out;
}

}  // namespace htvm::lab
