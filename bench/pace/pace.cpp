// How fast a capture is encoded, frame by frame, with all meshes in memory as a camera delivers them: frames/s over all
// frames, I-frames and patches counted, the frames of each kind, and where their time goes. docs/performance.md says
// what was measured with it, and how to count instructions.
//
// Processor time hardly depends on what else the machine does; real time does.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clocks.h"
#include "htvm/encoder.hpp"
#include "io/mesh_file.h"
#include "io/sequence.h"
#include "synth/synth.h"

namespace {

using htvm::pace::milliseconds, htvm::pace::processor_milliseconds;

struct Options {
    std::string capture, profile = "tracked";
    std::size_t frames = 60, first = 0;
    double quality = 42, unit = 1;
    unsigned threads = 1;
    int effort = 5, latency_frames = 0, vertices = 35000;
    bool each = false;
};

struct Captured {
    htvm::Mesh mesh;
    std::optional<htvm::Pose> pose;
};

std::vector<Captured> read_capture(const Options& options) {
    std::vector<Captured> out;
    if (options.capture == "synth") {
        htvm::SynthOptions person;
        person.vertices = options.vertices;
        for (std::size_t i = 0; i < options.frames; ++i) {
            auto frame = htvm::synth_frame(person, static_cast<int>(options.first + i));
            out.push_back({std::move(frame.mesh), std::move(frame.pose)});
        }
        return out;
    }
    const auto files = htvm::find_sequence(options.capture);
    if (!files) {
        fmt::print(stderr, "{}\n", files.error().message);
        return out;
    }
    htvm::MeshFileOptions file;
    file.millimetres_per_unit = options.unit;
    for (std::size_t i = options.first; i < files->paths.size() && out.size() < options.frames; ++i) {
        auto mesh = htvm::read_mesh(files->paths[i], file);
        if (!mesh) {
            fmt::print(stderr, "{}\n", mesh.error().message);
            return {};
        }
        out.push_back({std::move(*mesh), std::nullopt});
    }
    return out;
}

struct Sums {
    std::size_t frames = 0, bytes = 0;
    double real = 0, processor = 0;
    std::map<std::string, double> stages;
};

void print(const std::string& what, const Sums& sums) {
    const auto frames = static_cast<double>(sums.frames);
    fmt::print("{:8} {:4} frames {:9} bytes {:8.2f} ms real {:8.2f} ms processor {:7.2f} frames/s\n", what, sums.frames,
               sums.bytes, sums.real / frames, sums.processor / frames, 1e3 * frames / sums.real);
    for (const auto& [stage, real] : sums.stages) fmt::print("         {:24} {:8.2f} ms\n", stage, real / frames);
}

int measure(const Options& options) {
    const auto frames = read_capture(options);
    if (frames.empty()) return 1;
    const bool tracked = options.profile == "tracked";
    auto encoding = htvm::default_options(tracked ? htvm::Profile::tracked : htvm::Profile::topology);
    if (!tracked && frames[0].pose) encoding.skeleton = htvm::synth_skeleton();
    encoding.quality = options.quality;
    encoding.threads = options.threads;
    encoding.tracked.effort = options.effort;
    encoding.latency_frames = options.latency_frames;
    auto encoder = htvm::Encoder::create(encoding);
    if (!encoder) {
        fmt::print(stderr, "{}\n", encoder.error().message);
        return 1;
    }
    Sums all;
    std::map<std::string, Sums> kinds;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double real = milliseconds(), processor = processor_milliseconds();
        const auto done = encoder->push(frames[i].mesh, encoding.skeleton.bones.empty() ? nullptr : &*frames[i].pose,
                                        static_cast<std::int64_t>(33333 * i));
        const double took = milliseconds() - real, took_processor = processor_milliseconds() - processor;
        if (!done) {
            fmt::print(stderr, "frame {}: {}\n", i, done.error().message);
            return 1;
        }
        std::size_t bytes = 0;
        while (const auto packet = encoder->pull()) bytes += packet->payload.size();
        const std::string kind = htvm::kind_of(encoder->last_frame().type).letter;
        if (options.each) fmt::print("{:4} {:3} {:6} bytes {:8.2f} ms\n", i, kind, bytes, took_processor);
        for (auto* sums : {&all, &kinds[kind]}) {
            ++sums->frames;
            sums->bytes += bytes;
            sums->real += took;
            sums->processor += took_processor;
            for (const auto& stage : encoder->stage_times()) sums->stages[stage.stage] += stage.milliseconds;
        }
    }
    all.stages.clear();
    print("all", all);
    for (const auto& [kind, sums] : kinds) print(kind, sums);
    return 0;
}

}  // namespace

int main(int count, char** words) {
    Options options;
    CLI::App app("How fast a capture is encoded with all meshes in memory: frames/s, and where the time goes");
    app.add_option("capture", options.capture, "The meshes, as for htvm encode, or 'synth' for the synthetic person")
        ->required();
    app.add_option("--frames", options.frames, "At most so many")->capture_default_str();
    app.add_option("--first", options.first, "Skip so many")->capture_default_str();
    app.add_option("-q,--quality", options.quality)->capture_default_str();
    app.add_option("--vertices", options.vertices, "Of the synthetic person")->capture_default_str();
    app.add_option("--unit", options.unit, "Millimetres per unit of the files")->capture_default_str();
    app.add_option("--profile", options.profile, "tracked or topology, whose skeleton is the synthetic person's own")
        ->check(CLI::IsMember({"tracked", "topology"}))
        ->capture_default_str();
    app.add_option("--threads", options.threads, "0: one per core")->capture_default_str();
    app.add_option("--effort", options.effort, "0 to 9, as for htvm encode")->capture_default_str();
    app.add_option("--latency-frames", options.latency_frames, "As for htvm encode: then a push is of the frame before")
        ->capture_default_str();
    app.add_flag("--each", options.each, "Print each frame's kind, bytes and processor time");
    CLI11_PARSE(app, count, words);
    return measure(options);
}
