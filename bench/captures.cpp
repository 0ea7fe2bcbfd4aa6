#include "captures.h"

#include <cstdio>
#include <cstdlib>
#include <string>

#include "command_line/capture.h"

namespace htvm::bench {
namespace {

SynthOptions synthetic_options() {
    SynthOptions options;
    if (const char* vertices = std::getenv("HTVM_BENCH_VERTICES")) options.vertices = std::atoi(vertices);
    return options;
}

std::vector<Mesh> read(const char* folder) {
    app::CaptureOptions options;
    options.inputs = {folder};
    options.frames = 300;
    auto capture = app::Capture::open(options);
    std::vector<Mesh> out;
    while (capture) {
        auto mesh = capture->next();
        if (!mesh) {
            std::fprintf(stderr, "%s\n", mesh.error().message.c_str());
            std::exit(1);
        }
        if (!*mesh) return out;
        out.push_back(std::move(**mesh));
    }
    std::fprintf(stderr, "%s\n", capture.error().message.c_str());
    std::exit(1);
}

}  // namespace

const std::vector<SynthFrame>& synthetic_frames() {
    static const auto made = [] {
        constexpr int first_frame = 40, frames = 6;
        std::vector<SynthFrame> out;
        for (int i = 0; i < frames; ++i) out.push_back(synth_frame(synthetic_options(), first_frame + i));
        return out;
    }();
    return made;
}

Mesh& WholeCapture::frame(std::size_t number) {
    if (meshes.size() == 1) return meshes[0];
    const std::size_t period = 2 * (meshes.size() - 1), step = number % period;
    return meshes[step < meshes.size() ? step : period - step];
}

double WholeCapture::vertices() const {
    double sum = 0;
    for (const auto& mesh : meshes) sum += static_cast<double>(mesh.positions.size());
    return sum / static_cast<double>(meshes.size());
}

WholeCapture& whole_capture() {
    static auto capture = [] {
        WholeCapture out;
        if (const char* folder = std::getenv("HTVM_BENCH_CAPTURE")) {
            out.meshes = read(folder);
            return out;
        }
        for (int i = 0; i < 40; ++i) out.meshes.push_back(synth_frame(synthetic_options(), i).mesh);
        return out;
    }();
    return capture;
}

}  // namespace htvm::bench
