// htvm encode: meshes and a skeleton in, a stream out.
#include <fmt/core.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "encoder_options.h"
#include "layer_table.h"
#include "stream_file.h"
#include "terminal.h"

namespace htvm::app {
namespace {

struct Options {
    CaptureOptions capture;
    EncodingOptions encoding;
    std::string output;
    bool json = false;
};

Result<void> drain(Encoder& encoder, StreamOutput& output) {
    while (auto packet = encoder.pull())
        if (auto written = output.write(*packet); !written) return written;
    return {};
}

struct Summary {
    TotalsByType totals;
    double encode_seconds = 0;
    std::size_t without_triangles = 0;
    nlohmann::json frames = nlohmann::json::array();
};

Result<void> encode_frames(Capture& capture, Encoder& encoder, StreamOutput& output, bool json, Summary& summary) {
    Progress progress("encoding", capture.frames());
    for (;;) {
        const auto mesh = capture.next();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) break;
        if ((*mesh)->triangles.empty()) ++summary.without_triangles;
        const auto start = std::chrono::steady_clock::now();
        if (auto ok = encoder.push(**mesh, capture.pose(), capture.timestamp_us()); !ok) {
            return fail(ok.error().kind, fmt::format("frame {}: {}", summary.totals.all().frames, ok.error().message));
        }
        summary.encode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        const auto& info = encoder.last_frame();
        add(summary.totals, info);
        if (json) summary.frames.push_back(frame_json(info));
        if (auto written = drain(encoder, output); !written) return written;
        progress.step(fmt::format("{} {:.2f} bpv", type_name(info.type),
                                  bits_per_vertex(info.bytes.total(), info.source_vertices)));
    }
    encoder.finish();
    return drain(encoder, output);
}

Result<void> encode(const Options& options) {
    if (options.output == "-" && options.json)
        return fail(ErrorKind::bad_input, "--json prints on standard output, where -o - puts the stream; choose one");
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    auto settings = encoder_options(options.encoding, *capture);
    if (!settings) return tl::unexpected(settings.error());
    auto encoder = Encoder::create(*settings);
    if (!encoder) return tl::unexpected(encoder.error());
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    Summary summary;
    if (auto ok = encode_frames(*capture, *encoder, *output, options.json, summary); !ok) return ok;
    const auto frames = summary.totals.all().frames;
    if (frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
    if (summary.without_triangles > 0)
        warn(fmt::format("{} of {} frames have no triangles; see that the files hold meshes", summary.without_triangles,
                         frames));
    const double seconds = static_cast<double>(frames) / capture->fps();
    const double megabits = 8e-6 * static_cast<double>(output->bytes());
    if (options.json) {
        nlohmann::json out = {{"output", options.output},
                              {"bytes", output->bytes()},
                              {"frames", summary.frames},
                              {"megabits_per_second", megabits / seconds},
                              {"encode_frames_per_second", static_cast<double>(frames) / summary.encode_seconds}};
        fmt::print("{}\n", out.dump(2));
        return {};
    }
    fmt::print(stderr, "{}", layer_table(summary.totals));
    note(fmt::format("{}: {} frames, {} bytes, {:.2f} Mbit/s at {:g} fps, encoded at {:.1f} frames/s", options.output,
                     frames, output->bytes(), megabits / seconds, capture->fps(),
                     static_cast<double>(frames) / summary.encode_seconds));
    return {};
}

}  // namespace

void add_encode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("encode", "Compress a sequence of meshes into an .htvm stream");
    add_capture_options(*command, options->capture);
    command->add_option("-o,--output", options->output, "The stream: a file, or - for standard output")->required();
    add_encoding_options(*command, options->encoding);
    command->add_flag("--json", options->json, "Print sizes by frame and layer as JSON on standard output");
    command->footer(
        "Examples:\n"
        "  htvm encode capture/ --skeleton capture/skeleton.json -o person.htvm\n"
        "  htvm encode 'scan_%05d.obj' -q 70 --keyint 60 -o person.htvm\n"
        "  rig --ply | htvm encode - -o - | nc host 9000");
    command->callback([options, &run] { run = [options] { return encode(*options); }; });
}

}  // namespace htvm::app
