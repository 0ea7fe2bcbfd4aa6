// htvm encode: meshes and a skeleton in, a stream out.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "encoder_options.h"
#include "rate_report.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    CaptureOptions capture;
    EncodingOptions encoding;
    std::string output;
    bool json = false;
};

// One run over the capture: of two, the first writes nothing.
struct Pass {
    Capture& capture;
    Encoder& encoder;
    StreamOutput* output;  // null: the packets go nowhere
    RateReport& rate;
    std::string name;  // for the progress line
    bool json;
};

Result<void> drain(const Pass& pass) {
    while (auto packet = pass.encoder.pull()) {
        pass.rate.buffer.add(*packet);
        if (!pass.output) continue;
        if (auto written = pass.output->write(*packet); !written) return written;
    }
    return {};
}

struct Summary {
    TotalsByType totals;
    double encode_seconds = 0;
    std::size_t without_triangles = 0;
    nlohmann::json frames = nlohmann::json::array();
};

// Under rate control a frame that does not fit is left out, and the stream goes on without it; but not the first, as
// all others need an I-frame before them.
Result<void> drop(const Pass& pass, const Error& error) {
    const auto frame = pass.rate.costs.size();
    const bool goes_on = error.kind == ErrorKind::limit && pass.rate.rate_controlled() && frame > 0;
    if (!goes_on) return fail(error.kind, fmt::format("frame {}: {}", frame, error.message));
    if (pass.output) warn(fmt::format("frame {} is dropped: {}", frame, error.message));
    add_dropped(pass.rate);
    return {};
}

std::string progress_text(const Pass& pass, const FrameInfo& info) {
    std::string text = fmt::format("{} {:.2f} bpv", kind_of(info.type).letter,
                                   bits_per_vertex(info.bytes.total(), info.source_vertices));
    if (pass.rate.controlled()) text += fmt::format(", quality {:.0f}", pass.encoder.last_cost().quality);
    return text;
}

Result<void> encode_frames(const Pass& pass, Summary& summary) {
    Progress progress(pass.name, pass.capture.frames());
    for (;;) {
        const auto mesh = pass.capture.next();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) break;
        if ((*mesh)->triangles.empty()) ++summary.without_triangles;
        const auto start = std::chrono::steady_clock::now();
        const auto pushed = pass.encoder.push(**mesh, pass.capture.pose(), pass.capture.timestamp_us());
        summary.encode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (!pushed) {
            if (auto dropped = drop(pass, pushed.error()); !dropped) return dropped;
            progress.step("dropped");
            continue;
        }
        const auto& info = pass.encoder.last_frame();
        add(summary.totals, info);
        add_coded(pass.rate, pass.encoder.last_cost());
        if (pass.json) {
            summary.frames.push_back(frame_json(info));
            if (pass.rate.controlled()) summary.frames.back()["quality"] = pass.encoder.last_cost().quality;
        }
        if (auto written = drain(pass); !written) return written;
        progress.step(progress_text(pass, info));
    }
    pass.encoder.finish();
    return drain(pass);
}

// The first of two passes: what each frame costs.
Result<void> first_pass(Capture& capture, EncoderOptions& settings) {
    auto encoder = Encoder::create(settings);
    if (!encoder) return tl::unexpected(encoder.error());
    RateReport rate(settings);
    Summary unused;
    if (auto ok = encode_frames({capture, *encoder, nullptr, rate, "pass 1 of 2", false}, unused); !ok) return ok;
    settings.rate.first_pass = std::move(rate.costs);
    capture.rewind();
    return {};
}

void report(const Options& options, const Summary& summary, const RateReport& rate, std::uint64_t bytes, double fps) {
    const auto frames = summary.totals.all().frames;
    const double seconds = static_cast<double>(frames + rate.dropped.size()) / fps;
    const double megabits = 8e-6 * static_cast<double>(bytes);
    if (options.json) {
        nlohmann::json out = {{"output", options.output},
                              {"bytes", bytes},
                              {"frames", summary.frames},
                              {"megabits_per_second", megabits / seconds},
                              {"encode_frames_per_second", static_cast<double>(frames) / summary.encode_seconds}};
        if (rate.controlled()) out["control"] = rate_json(rate, bytes, seconds);
        fmt::print("{}\n", out.dump(2));
        return;
    }
    fmt::print(stderr, "{}", layer_table(summary.totals));
    note(fmt::format("{}: {} frames, {} bytes, {:.2f} Mbit/s at {:g} fps, encoded at {:.1f} frames/s", options.output,
                     frames, bytes, megabits / seconds, fps, static_cast<double>(frames) / summary.encode_seconds));
    if (rate.controlled()) note(rate_summary(rate, bytes, seconds));
}

Result<void> encode(const Options& options) {
    const bool two_passes = options.encoding.passes == 2;
    auto capture = Capture::open(options.capture);
    if (!capture) return tl::unexpected(capture.error());
    auto settings = encoder_options(options.encoding, *capture);
    if (!settings) return tl::unexpected(settings.error());
    // Before the first pass, so that a place that cannot be written to does not cost one.
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    if (two_passes)
        if (auto ok = first_pass(*capture, *settings); !ok) return ok;
    auto encoder = Encoder::create(*settings);
    if (!encoder) return tl::unexpected(encoder.error());
    Summary summary;
    RateReport rate(*settings);
    const std::string name = two_passes ? "pass 2 of 2" : "encoding";
    if (auto ok = encode_frames({*capture, *encoder, &*output, rate, name, options.json}, summary); !ok) return ok;
    const auto frames = summary.totals.all().frames;
    if (frames == 0) return fail(ErrorKind::bad_input, "there was no mesh to encode");
    if (summary.without_triangles > 0)
        warn(fmt::format("{} of {} frames have no triangles; see that the files hold meshes", summary.without_triangles,
                         frames));
    report(options, summary, rate, output->bytes(), capture->fps());
    if (!rate.dropped.empty())
        return fail(
            ErrorKind::limit,
            fmt::format("{} is complete but for {} of {} frames, which did not fit into the buffer; give a higher "
                        "--bitrate or a larger --buffer",
                        options.output, rate.dropped.size(), rate.costs.size()));
    return {};
}

}  // namespace

void add_encode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("encode", "Compress a sequence of meshes into an .htvm stream");
    add_capture_options(*command, options->capture);
    command->add_option("-o,--output", options->output, "The stream: a file, or - for standard output")
        ->type_name("FILE")
        ->required();
    add_encoding_options(*command, options->encoding);
    command->add_flag("--json", options->json, "Print sizes by frame and layer as JSON on standard output");
    command->add_flag_callback(
        "--help-options",
        [] {
            fmt::print("{}", options_in_markdown());
            throw CLI::Success();
        },
        "Print all options of the library with their ranges, as docs/options.md has them, and exit");
    command->footer(
        "Examples:\n"
        "  htvm encode capture/ --skeleton capture/skeleton.json -o person.htvm\n"
        "  htvm encode 'scan_%05d.obj' -q 60 --keyint 60 -o person.htvm\n"
        "  htvm encode capture/ --profile topology -s capture/skeleton.json -o exact.htvm\n"
        "  htvm encode capture/ --bitrate 6 --buffer 0.5 --passes 2 -o person.htvm\n"
        "  rig --ply | htvm encode - --bitrate 8 -o - | nc host 9000");
    command->callback([options, &run] {
        check_together(options->encoding);
        if (options->output == "-" && options->json)
            throw CLI::ValidationError("--json", "prints on standard output, where -o - puts the stream; choose one");
        if (options->encoding.passes == 2 && options->capture.input == "-")
            throw CLI::ValidationError(
                "--passes",
                "2 reads the capture twice, which standard input does not allow; give files, or --passes 1");
        run = [options] { return encode(*options); };
    });
}

}  // namespace htvm::app
